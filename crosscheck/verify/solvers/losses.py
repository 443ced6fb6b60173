"""What a program may take, and the sentences for what becomes of one that takes more or ends."""

import os
import signal
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ...child_process import SILENT, ChildProcess, Loss, LostError
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


class Limits(NamedTuple):
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


LIMITS = Limits()


class FailureError(Exception):
    """A program is of no more use; the failure says why."""

    def __init__(self, kind: FailureKind, words: Sentence) -> None:
        super().__init__(str(words))
        self.failure = Failure(kind, words)


def failure_of(
    lost: LostError, process: ChildProcess, limits: Limits, patience: float
) -> FailureError:
    """Return why a process was lost, after so much patience [s]."""
    match lost.loss:
        case Loss.MEMORY:
            return FailureError(
                FailureKind.MEMORY,
                sentence("It took more than {limit:.3g} GB of memory.", limit=limits.memory / 1e9),
            )
        case Loss.TOO_LONG:
            return FailureError(
                FailureKind.GARBAGE,
                sentence(
                    "It printed more than {most} bytes without an end of line, beginning with: "
                    "{line}",
                    most=limits.line,
                    line=shown(bytes(process.partial[:200]), 60),
                ),
            )
        case loss if loss in SILENT:
            what = _silence(loss, process, patience)
            return FailureError(FailureKind.HUNG, _with_stderr(what, process))
        case loss:
            return FailureError(FailureKind.CRASHED, _with_stderr(_end(loss, process), process))


def _end(loss: Loss, process: ChildProcess) -> Sentence:
    if loss is Loss.CLOSED:
        return sentence("It closed its standard output, but runs on.")
    if loss is Loss.CUT:
        line = shown(bytes(process.partial[-400:]), 60)
        return sentence(
            "It ended in the middle of a line ({line}): {how}.", line=line, how=ending(process.code)
        )
    return sentence("It ended instead of answering: {how}.", how=ending(process.code))


def _silence(loss: Loss, process: ChildProcess, patience: float) -> Sentence:
    """Return why nothing came in time."""
    match loss:
        case Loss.DEAF:
            return sentence("It closed its standard input before it had read the request.")
        case Loss.UNFINISHED:
            return sentence(
                "It printed {count} bytes, but no end of line within {seconds:g} s: {line}",
                count=len(process.partial),
                seconds=patience,
                line=shown(bytes(process.partial[:400]), 60),
            )
        case Loss.UNREAD:
            return sentence(
                "It did not read the whole request of {count} bytes within {seconds:g} s.",
                count=process.sent,
                seconds=patience,
            )
        case Loss.COMPUTING:
            return sentence("It computed for {seconds:g} s without an answer.", seconds=patience)
        case _:
            return sentence(
                "It gave no answer within {seconds:g} s and was not computing: does it end each "
                "answer with an end of line, and flush its output?",
                seconds=patience,
            )


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
    return FailureError(FailureKind.CRASHED, _obstacle(program, error))


def _obstacle(program: str, error: Exception) -> Sentence:
    match error:
        case FileNotFoundError() if Path(program).is_file() and os.sep not in program:
            return sentence(
                "There is no command {program}; for the file here write ./{program}.",
                program=program,
            )
        case FileNotFoundError() if not Path(program).exists():
            return sentence("There is no command {program}.", program=program)
        case PermissionError():
            return sentence("{program} cannot be executed: chmod +x {program}", program=program)
        case _:
            return sentence(
                "{program} cannot be started ({why}): is it built for this machine, and does a "
                "script begin with #!?",
                program=program,
                why=str(getattr(error, "strerror", None) or error),
            )


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
