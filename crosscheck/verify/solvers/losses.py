"""What a program may take, and the sentences for what becomes of one that takes more or ends."""

import os
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ...child_process import SILENT, ChildProcess, Loss
from ..contestant import Failure, FailureKind
from ..message import shown
from ..sentence import Sentence, sentence

# How many lines of standard error are shown.
STDERR_SHOWN = 3
# Frames of ours, and a list that Python ends its last words with, are nothing to show.
_OURS = (str(Path(__file__).parents[1]), 'File "<string>"', "Extension modules:")

_SIGNALS: Mapping[int, Sentence] = {
    signal.SIGSEGV: sentence("it used memory that is not its own (segmentation fault)"),
    signal.SIGBUS: sentence("it used memory that does not exist (bus error)"),
    signal.SIGABRT: sentence("it aborted, as after a failed assertion or an uncaught exception"),
    signal.SIGFPE: sentence("it divided an integer by zero, or the like (SIGFPE)"),
    signal.SIGILL: sentence("it came to an instruction that this processor does not have (SIGILL)"),
    signal.SIGKILL: sentence("it was killed from outside, perhaps for want of memory"),
    signal.SIGPIPE: sentence("it wrote where nobody reads (SIGPIPE)"),
}


class ProcessLimits(NamedTuple):
    """What a program may take.

    Attributes:
        first: for the greeting, and for the first request of each task, when it compiles [s].
        request: for any other request [s].
        leave: to end once its input has ended [s].
        memory: together with all that it starts [B].
        line: the longest line that it may answer, read within seconds whatever it holds [B].
        prints: the most lines beside an answer.
    """

    first: float = 30.0
    request: float = 10.0
    leave: float = 2.0
    memory: int = 4 << 30
    line: int = 1 << 24
    prints: int = 10_000


LIMITS = ProcessLimits()


class FailureError(Exception):
    """A program is of no more use; the failure says why."""

    def __init__(self, kind: FailureKind, words: Sentence) -> None:
        super().__init__(str(words))
        self.failure = Failure(kind, words)


_KINDS = {
    Loss.MEMORY: FailureKind.MEMORY,
    Loss.TOO_LONG: FailureKind.GARBAGE,
    **dict.fromkeys(SILENT, FailureKind.HUNG),
}
_WORDS = {
    Loss.MEMORY: sentence("It took more than {limit:.3g} GB of memory."),
    Loss.TOO_LONG: sentence(
        "It printed more than {most} bytes without an end of line, beginning with: {line}"
    ),
    Loss.ENDED: sentence("It ended instead of answering: {how}."),
    Loss.TRUNCATED: sentence("It ended in the middle of a line ({line}): {how}."),
    Loss.CLOSED: sentence("It closed its standard output, but runs on."),
    Loss.DEAF: sentence("It closed its standard input before it had read the request."),
    Loss.UNFINISHED: sentence(
        "It printed {count} bytes, but no end of line within {seconds:g} s: {line}"
    ),
    Loss.UNREAD: sentence(
        "It did not read the whole request of {count} bytes within {seconds:g} s."
    ),
    Loss.COMPUTING: sentence("It computed for {seconds:g} s without an answer."),
    Loss.WAITING: sentence(
        "It gave no answer within {seconds:g} s and was not computing: does it end each answer "
        "with an end of line, and flush its output?"
    ),
}


def failure_of(
    loss: Loss, process: ChildProcess, limits: ProcessLimits, patience: float
) -> FailureError:
    """Return why a process was lost, after so much patience [s]."""
    part = process.partial[-400:] if loss is Loss.TRUNCATED else process.partial[:400]
    values = {
        "limit": limits.memory / 1e9,
        "most": limits.line,
        "line": shown(bytes(part), 60),
        "count": process.request_length if loss is Loss.UNREAD else len(process.partial),
        "seconds": patience,
        "how": ending(process.code) if loss in (Loss.ENDED, Loss.TRUNCATED) else "",
    }
    words = _WORDS[loss]._replace(values=values)
    if loss in (Loss.MEMORY, Loss.TOO_LONG):
        return FailureError(_KINDS[loss], words)
    return FailureError(_KINDS.get(loss, FailureKind.CRASHED), _with_stderr(words, process))


def ending(code: int) -> Sentence:
    """Return how a program ended, from its exit code or minus the number of a signal."""
    if code >= 0:
        return sentence("exit code {code}", code=code)
    name = signal.Signals(-code).name if -code in list(signal.Signals) else str(-code)
    return _SIGNALS.get(-code, sentence("it was ended by signal {name}", name=name))


def _with_stderr(what: Sentence, process: ChildProcess) -> Sentence:
    lines = [shown(line) for line in bytes(process.last_words).splitlines()]
    lines = [line for line in lines if line and not any(ours in line for ours in _OURS)]
    if not lines:
        return what
    return sentence(
        "{what} Its last words on standard error: {lines}",
        what=what,
        lines=" / ".join(lines[-STDERR_SHOWN:]),
    )


def not_started(program: str, error: Exception) -> FailureError:
    """Return why a program could not be started."""
    why = str(getattr(error, "strerror", None) or error)
    match error:
        case FileNotFoundError() if Path(program).is_file() and os.sep not in program:
            words = sentence("There is no command {program}; for the file here write ./{program}.")
        case FileNotFoundError() if not Path(program).exists():
            words = sentence("There is no command {program}.")
        case PermissionError():
            words = sentence("{program} cannot be executed: chmod +x {program}")
        case _:
            words = sentence(
                "{program} cannot be started ({why}): is it built for this machine, and does a "
                "script begin with #!?"
            )
    words = words._replace(values={"program": program, "why": why})
    return FailureError(FailureKind.CRASHED, words)


def departure(process: ChildProcess, patience: float) -> tuple[Sentence, ...]:
    """End a program's input, then all that still runs; return what was odd in how it left."""
    has_left, strays = process.leave(patience)
    if not has_left:
        return (sentence("It does not leave when its input ends."),)
    remarks = []
    if strays:
        remarks.append(
            sentence(
                "It left processes running that it had started ({count}); they were ended.",
                count=strays,
            )
        )
    if process.code:
        how = ending(process.code)
        remarks.append(sentence("When its input ended it did not just leave: {how}.", how=how))
    return tuple(remarks)
