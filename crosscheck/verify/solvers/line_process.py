"""A process that is talked with in lines, and never waited for longer than was said.

Pipes are read and written as they allow, so that neither a program that does not read nor one that
prints without end blocks anything. Memory is limited by watching what is resident: limits of the
address space (RLIMIT_AS, RLIMIT_DATA) would forbid programs that reserve far more than they use,
as Java, JavaScript, compiled Python and every program under a sanitizer do.
"""

import contextlib
import fcntl
import os
import resource
import selectors
import signal
import subprocess
import time
import weakref
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ..contestant import Failure, FailureKind
from ..message import shown
from ..sentence import Sentence, sentence
from .processes import HAS_PROC, MARKER, carry, dismiss, end_group, family, guard, new_marker

# How often a process that lets one wait is looked at [s], as often as the looking is cheap.
TICK = 0.05 if HAS_PROC else 0.5
# How much of standard error is kept [B], and how many of its lines are shown.
STDERR_KEPT, STDERR_SHOWN = 4096, 3
# How often it is read once a program ended: more than a pipe holds.
STDERR_ROUNDS = 8
# Below this share of a processor a program waits rather than computes.
IDLE = 0.1
# How long what closed one of its pipes may still take to answer, or to end [s].
SHUT = 0.5
_CHUNK = 1 << 18
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


class _Look(NamedTuple):
    """What a program was seen to do: at a time, the processors' time used, and if it runs [s]."""

    time: float
    used: float
    runs: bool


class LostError(Exception):
    """A program is of no more use; the failure says why."""

    def __init__(self, kind: FailureKind, words: Sentence) -> None:
        super().__init__(str(words))
        self.failure = Failure(kind, words)

    @classmethod
    def of(cls, failure: Failure) -> "LostError":
        """Return the error of a failure."""
        return cls(failure.kind, failure.sentence)


class LineProcess:
    """A program that was started, with its three pipes.

    Attributes:
        pid: its process.

    Raises:
        LostError: if it cannot be started.
    """

    def __init__(self, command: Sequence[str], folder: Path | None, limits: Limits) -> None:
        self._limits = limits
        self._marker = new_marker()
        self._process = _start(command, folder, self._marker)
        self.pid: int = self._process.pid
        self._unsent = bytearray()
        self._sent = 0
        self._received = bytearray()
        self._searched = 0
        self._stderr = bytearray()
        self._refuses_input = False
        self._looks: list[_Look] = []
        self._selector = selectors.DefaultSelector()
        for pipe in (self._process.stdout, self._process.stderr):
            self._selector.register(pipe, selectors.EVENT_READ)
        self._end = weakref.finalize(
            self,
            _end,
            self._process,
            guard(self._process.pid, self._marker),
            self._marker,
            self._selector,
        )

    def send(self, line: bytes) -> None:
        """Let a line be written while the answer is awaited."""
        self._unsent += line
        self._sent = len(line)
        if not self._refuses_input:
            self._forget(self._process.stdin)
            self._selector.register(self._process.stdin, selectors.EVENT_WRITE)

    def receive(self, seconds: float, patience: float) -> bytes:
        """Return the next line that the program prints, without its end.

        Args:
            seconds: how long to wait [s].
            patience: how long was waited in all if that was in vain, for the message [s].

        Raises:
            LostError: if none comes in time, the program ended, or takes too much.
        """
        start = looked = time.monotonic()
        self._looks.clear()
        while (line := self._next_line()) is None:
            now = time.monotonic()
            limit = min(seconds, SHUT) if self._refuses_input else seconds
            if now - looked >= TICK or now - start >= limit:
                looked = now
                self._look()
                if b"\n" in self._received[self._searched :]:  # an answer, and then its end
                    continue
            if now - start >= limit:
                raise self._late(patience)
            self._exchange(max(min(TICK, start + limit - now), 0.0))
        return line

    def leave(self) -> tuple[Sentence, ...]:
        """End the input, then all that still runs; return what was odd in how it left."""
        remarks = []
        self._forget(self._process.stdin)
        with _no_signal_of_pipes(), contextlib.suppress(OSError):
            self._process.stdin.close()
        deadline = time.monotonic() + self._limits.leave
        while not self._has_ended() and time.monotonic() < deadline:
            self._drain(TICK / 10)
        if not self._has_ended():
            remarks.append(sentence("It does not leave when its input ends."))
        elif others := family(self._process.pid, self._marker):
            remarks.append(
                sentence(
                    "It left processes running that it had started ({count}); they were ended.",
                    count=len(others),
                )
            )
        left = self._has_ended()
        self._end()
        if left and self._process.returncode:
            remarks.append(
                sentence("When its input ended it did not just leave: {how}.", how=self._how())
            )
        return tuple(remarks)

    def end(self) -> None:
        """End it and whatever it has started."""
        self._end()

    def _next_line(self) -> bytes | None:
        at = self._received.find(b"\n", self._searched)
        self._searched = len(self._received)
        if at < 0:
            return None
        line = bytes(self._received[:at])
        del self._received[: at + 1]
        self._searched = 0
        return line

    def _exchange(self, seconds: float) -> None:
        """Write and read what the pipes allow; return after so many seconds if they allow none."""
        ended = False
        for key, _ in self._selector.select(seconds):
            if key.fileobj is self._process.stdin:
                self._write()
            elif key.fileobj is self._process.stderr:
                self._read_stderr()
            else:
                chunk = _read(self._process.stdout)
                ended = chunk == b""
                self._received += chunk or b""
        if ended:
            raise self._silent()
        if len(self._received) > self._limits.line:
            raise LostError(
                FailureKind.GARBAGE,
                sentence(
                    "It printed more than {most} bytes without an end of line, beginning with: "
                    "{line}",
                    most=self._limits.line,
                    line=shown(bytes(self._received[:200]), 60),
                ),
            )

    def _write(self) -> None:
        try:
            with _no_signal_of_pipes():
                written = os.write(self._process.stdin.fileno(), self._unsent[:_CHUNK])
            del self._unsent[:written]
        except BlockingIOError:
            return
        except OSError:  # it does not read, or is no more
            self._refuses_input = True
            self._unsent.clear()
        if not self._unsent:
            self._forget(self._process.stdin)

    def _read_stderr(self) -> None:
        chunk = _read(self._process.stderr)
        self._stderr += chunk or b""
        del self._stderr[:-STDERR_KEPT]
        if chunk == b"":
            self._forget(self._process.stderr)

    def _drain(self, seconds: float) -> None:
        """Throw away what is printed."""
        for key, _ in self._selector.select(seconds):
            if key.fileobj is self._process.stderr:
                self._read_stderr()
            elif key.fileobj is self._process.stdin or _read(key.fileobj) == b"":
                self._forget(key.fileobj)
        if not self._selector.get_map():
            time.sleep(seconds)

    def _forget(self, pipe: Any) -> None:
        with contextlib.suppress(KeyError):
            self._selector.unregister(pipe)

    def _look(self) -> None:
        """Raise if it ended or is too large; note what it does."""
        if self._has_ended():  # while something else holds its pipes
            before = len(self._received)
            self._exchange(0.0)
            if len(self._received) == before:
                raise self._silent()
        members = family(self._process.pid, self._marker)
        if sum(one.memory for one in members) > self._limits.memory:
            raise LostError(
                FailureKind.MEMORY,
                sentence(
                    "It took more than {limit:.3g} GB of memory.", limit=self._limits.memory / 1e9
                ),
            )
        used = sum(one.seconds for one in members)
        self._looks.append(_Look(time.monotonic(), used, any(one.runs for one in members)))

    def _computes(self) -> bool:
        """Return whether it computed rather than waited, most times when it was looked at."""
        first, *_, last = (self._looks[0], *self._looks)
        if last.used - first.used > IDLE * (last.time - first.time):
            return True
        return 2 * sum(one.runs for one in self._looks) > len(self._looks)

    def _has_ended(self) -> bool:
        """Return whether the program ended, leaving its number its own where that can be had."""
        if not hasattr(os, "waitid") or self._process.returncode is not None:
            return self._process.poll() is not None
        options = os.WEXITED | os.WNOWAIT | os.WNOHANG
        return os.waitid(os.P_PID, self._process.pid, options) is not None

    def _silent(self) -> LostError:
        """Return why nothing more will come."""
        deadline = time.monotonic() + SHUT
        while not self._has_ended() and time.monotonic() < deadline:
            time.sleep(TICK / 10)
        for _ in range(STDERR_ROUNDS):
            self._read_stderr()
        ended = self._has_ended()
        self._end()
        if not ended:
            what = sentence("It closed its standard output, but runs on.")
        elif self._received:
            line = shown(bytes(self._received[-400:]), 60)
            what = sentence(
                "It ended in the middle of a line ({line}): {how}.", line=line, how=self._how()
            )
        else:
            what = sentence("It ended instead of answering: {how}.", how=self._how())
        return LostError(FailureKind.CRASHED, self._with_stderr(what))

    def _late(self, patience: float) -> LostError:
        """Return why nothing came in time."""
        if self._refuses_input:
            what = sentence("It closed its standard input before it had read the request.")
        elif self._received:
            what = sentence(
                "It printed {count} bytes, but no end of line within {seconds:g} s: {line}",
                count=len(self._received),
                seconds=patience,
                line=shown(bytes(self._received[:400]), 60),
            )
        elif self._unsent:
            what = sentence(
                "It did not read the whole request of {count} bytes within {seconds:g} s.",
                count=self._sent,
                seconds=patience,
            )
        elif self._computes():
            what = sentence("It computed for {seconds:g} s without an answer.", seconds=patience)
        else:
            what = sentence(
                "It gave no answer within {seconds:g} s and was not computing: does it end each "
                "answer with an end of line, and flush its output?",
                seconds=patience,
            )
        return LostError(FailureKind.HUNG, self._with_stderr(what))

    def _how(self) -> Sentence:
        code = self._process.returncode
        if code >= 0:
            return sentence("exit code {code}", code=code)
        name = signal.Signals(-code).name if -code in list(signal.Signals) else str(-code)
        return _SIGNALS.get(-code, sentence("it was ended by signal {name}", name=name))

    def _with_stderr(self, what: Sentence) -> Sentence:
        lines = [shown(line) for line in bytes(self._stderr).splitlines()]
        lines = [line for line in lines if line and not any(one in line for one in _OURS)]
        if not lines:
            return what
        return sentence(
            "{what} Its last words on standard error: {lines}",
            what=what,
            lines=" / ".join(lines[-STDERR_SHOWN:]),
        )


def _read(pipe: Any) -> bytes | None:
    """Return what is there, b"" if there never will be anything more, None if there is nothing."""
    try:
        return os.read(pipe.fileno(), _CHUNK)
    except BlockingIOError:
        return None


def _start(command: Sequence[str], folder: Path | None, marker: int) -> Any:
    try:
        process: Any = subprocess.Popen(
            command,
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=folder,
            env=os.environ | {MARKER: str(marker)},
            start_new_session=True,
            # A limit that is set later would miss what the program starts at once.
            preexec_fn=partial(carry, marker) if HAS_PROC else None,
        )
    except (OSError, ValueError) as error:
        raise LostError(FailureKind.CRASHED, _not_started(command[0], error)) from None
    for pipe in (process.stdin, process.stdout, process.stderr):
        os.set_blocking(pipe.fileno(), False)
        if hasattr(fcntl, "F_SETPIPE_SZ"):  # fewer changes of context for large messages
            with contextlib.suppress(OSError):
                fcntl.fcntl(pipe.fileno(), fcntl.F_SETPIPE_SZ, _CHUNK)
    if hasattr(resource, "prlimit"):
        with contextlib.suppress(OSError):  # it has ended already
            resource.prlimit(process.pid, resource.RLIMIT_CORE, (0, 0))
    return process


def _not_started(program: str, error: Exception) -> Sentence:
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


def _end(
    process: Any, guard: subprocess.Popen[bytes], marker: int, selector: selectors.BaseSelector
) -> None:
    end_group(process.pid, marker)
    with contextlib.suppress(subprocess.TimeoutExpired):  # what the system does not let go
        process.wait(SHUT)
    dismiss(guard)
    selector.close()
    for pipe in (process.stdin, process.stdout, process.stderr):
        with contextlib.suppress(OSError):
            pipe.close()


@contextlib.contextmanager
def _no_signal_of_pipes() -> Iterator[None]:
    """Let writing where nobody reads be an error only, whatever SIGPIPE is set to do."""
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        yield
    finally:
        if signal.SIGPIPE not in blocked:
            if signal.SIGPIPE in signal.sigpending():
                signal.sigwait({signal.SIGPIPE})
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGPIPE})
