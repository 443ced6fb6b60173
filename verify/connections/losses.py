"""The limits of a program, and the sentences on an exceeded limit or an ended program."""

import os
import signal
import tomllib
from pathlib import Path
from typing import NamedTuple

from plumbob.process.child import ChildProcess, Loss
from plumbob.text.printable import one_line
from plumbob.text.sentence import Sentence, sentence

from ..exchange import Failure, FailureKind

# How many lines of standard error are shown.
STDERR_SHOWN = 3
# Our own frames, and the lines around a list of frames, are nothing to show.
_HIDDEN = (
    *(str(Path(__file__).parents[1]), 'File "<string>"'),
    *("Extension modules:", "Timeout (", "Thread 0x"),
)
# Python's marks below a part of a line.
_MARKS = " ^~"
_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


class ProcessLimits(NamedTuple):
    """The limits of a program."""

    # for the greeting, and for the first request of each task, with compilation [s]
    first: float = 30.0
    request: float = 10.0  # for any other request [s]
    leave: float = 2.0  # to end once its input has ended [s]
    memory: int = 4 << 30  # together with all that it starts [B]
    # the longest line of an answer, read within seconds whatever its content [B]
    line: int = 1 << 24
    prints: int = 10_000  # the most lines beside an answer


LIMITS = ProcessLimits()


class FailureError(Exception):
    """A program is of no more use; the failure says why."""

    def __init__(self, kind: FailureKind, message: Sentence) -> None:
        super().__init__(str(message))
        self.failure = Failure(kind, message)


def failure_of(
    loss: Loss, process: ChildProcess, limits: ProcessLimits, patience: float
) -> FailureError:
    """Return why a process was lost, after so much patience [s]."""
    entry = _TABLE["loss"][loss.name]
    part = process.partial[-400:] if loss is Loss.TRUNCATED else process.partial[:400]
    values = {
        "limit": limits.memory / 1e9,
        "most": limits.line,
        "line": one_line(bytes(part), 60),
        "count": process.request_length if loss is Loss.UNREAD else len(process.partial),
        "seconds": patience,
        "how": ending(process.code) if loss in (Loss.ENDED, Loss.TRUNCATED) else "",
    }
    message = Sentence(entry["sentence"], values)
    if entry.get("last_words", True):
        is_hung = entry["kind"] == FailureKind.HUNG  # what it wrote before is no reason of that
        words = process.recent_words if is_hung else bytes(process.last_words)
        lines = list(dict.fromkeys(map(one_line, words.splitlines())))
        lines = [line for line in lines if not any(text in line for text in _HIDDEN)]
        lines = [line for line in lines if line.strip(_MARKS)]
        if lines:
            message = sentence(
                "{what} Its last lines on standard error: {lines}",
                what=message,
                lines=" / ".join(lines[-STDERR_SHOWN:]),
            )
    return FailureError(FailureKind(entry["kind"]), message)


def garbage(key: str, **values: object) -> FailureError:
    """Return why the output of a program is no answer."""
    return FailureError(FailureKind.GARBAGE, Sentence(_TABLE["garbage"][key]["sentence"], values))


def ending(code: int) -> Sentence:
    """Return how a program ended, from its exit code or minus the number of a signal."""
    if code >= 0:
        return sentence("exit code {code}", code=code)
    name = signal.Signals(-code).name if -code in list(signal.Signals) else str(-code)
    if name in _TABLE["signal"]:
        return Sentence(_TABLE["signal"][name]["sentence"], {})
    return sentence("it was ended by signal {name}", name=name)


def not_started(program: str, error: Exception) -> FailureError:
    """Return why a program could not be started."""
    match error:
        case FileNotFoundError() if Path(program).is_file() and os.sep not in program:
            key = "no command, but a file"
        case FileNotFoundError() if not Path(program).exists():
            key = "no command"
        case PermissionError():
            key = "not executable"
        case _:
            key = "not for this machine"
    values = {"program": program, "why": str(getattr(error, "strerror", None) or error)}
    return FailureError(FailureKind.CRASHED, Sentence(_TABLE["start"][key]["sentence"], values))


def departure(process: ChildProcess, patience: float) -> tuple[Sentence, ...]:
    """End a program's input, then all running processes; return remarks on the departure."""
    has_left, strays = process.leave(patience)
    code = process.code if has_left else 0
    values = {"count": strays, "how": ending(code)}
    remarks = {"stays": not has_left, "leaves processes": strays > 0, "ends badly": code != 0}
    table = _TABLE["departure"]
    return tuple(
        Sentence(table[key]["sentence"], values) for key, holds in remarks.items() if holds
    )
