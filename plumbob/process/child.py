"""A program in a process of its own: crashes, hangs and garbage do no harm to others.

Pipes are read and written without blocking, even if a program never reads or prints without end.
Memory is limited by checks of the resident memory. Limits of the address space (RLIMIT_AS,
RLIMIT_DATA) would forbid programs that reserve far more than they use. Examples are Java,
JavaScript, compiled Python and every program under a sanitizer.
"""

import contextlib
import math
import os
import pickle
import resource
import selectors
import signal
import struct
import subprocess
import sys
import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum, auto
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from .tree import Process, carry, end_group, family, guard, new_marker

CallResult = TypeVar("CallResult")

# Period of the checks of an awaited process [s].
TICK = 0.05
# Length of the kept end of standard error [B].
STDERR_LENGTH = 4096
# Below this share of a processor a program waits rather than computes.
IDLE = 0.1
# Time for a process to answer or to end after closing a pipe [s].
GRACE = 1.0
_CHUNK = 1 << 18  # bytes of a read
# Limit of the duration of a call over its limit of processor time: the processor is shared.
_WALL = 10
# Limit of the time to load and compile before the first call [s].
_START = 300.0
# In safe-path mode (-P) nothing is imported from the working directory. Our packages come from the
# location of this file, before any others on the path.
_ROOT = Path(__file__).parents[2]
_PATH = "import sys; sys.path.insert(0, sys.argv[1]); "


class Loss(Enum):
    """Why a process is lost."""

    ENDED = auto()
    TRUNCATED = auto()  # ended in the middle of a message
    CLOSED = auto()  # closed its output, but runs on
    GARBLED = auto()  # its output is no message
    TOO_LONG = auto()  # a message without an end
    MEMORY = auto()
    PROCESSOR = auto()  # took too much processor time
    # No message came in time:
    DEAF = auto()  # closed its input before reading the request
    UNFINISHED = auto()  # sent a part of a message
    UNREAD = auto()  # did not read the whole request
    COMPUTING = auto()
    WAITING = auto()


SILENT = (Loss.DEAF, Loss.UNFINISHED, Loss.UNREAD, Loss.COMPUTING, Loss.WAITING)


class LostError(Exception):
    """A process is lost for the reason `loss`; the message is for people."""

    def __init__(self, loss: Loss, message: str = "") -> None:
        super().__init__(message or loss.name)
        self.loss = loss


def take_line(received: bytearray) -> tuple[bytes, ...]:
    """Remove the first line, whose end can only be in the last chunk; return () without one."""
    end = received.find(b"\n", max(0, len(received) - _CHUNK))
    if end < 0:
        return ()
    line = bytes(received[:end])
    del received[: end + 1]
    return (line,)


def take_pickle(received: bytearray) -> tuple[Any, ...]:
    """Remove and return the first complete object, () if none; see `multiprocessing.connection`."""
    if len(received) < 4:
        return ()
    size: int = struct.unpack_from("!i", received)[0]
    if size < 0:
        raise ValueError(f"expected a length, got {size}")
    if len(received) < 4 + size:
        return ()
    message = pickle.loads(bytes(received[4 : 4 + size]))
    del received[: 4 + size]
    return (message,)


def pickled(message: object) -> bytes:
    """Return an object as bytes for `take_pickle` and a Connection."""
    content = pickle.dumps(message)
    return struct.pack("!i", len(content)) + content


class ChildProcess:
    """A program in a session of its own, with messages on its three pipes.

    The program ends with this object and with this process, whatever the cause. `partial` holds the
    bytes received after the last message, `last_words` the end of its standard error.
    """

    def __init__(
        self,
        command: Sequence[str | Path],
        take: Callable[[bytearray], tuple[Any, ...]] = take_line,
        folder: Path | None = None,
        environment: Mapping[str, str] | None = None,
        memory: float = math.inf,
        longest: float = math.inf,
    ) -> None:
        """Start a program; raise OSError on failure, ValueError if the command holds NUL.

        `take` removes and returns the first message of the received bytes, or returns () if there
        is none yet; with pickled objects, prints of the program are discarded. `memory` limits the
        memory of the program and its descendants [B]. A limited program is not trusted: processes
        that leave its group and session are ended too. `longest` limits its messages [B].
        """
        self._take, self._memory, self._longest = take, memory, longest
        self._marker = new_marker() if memory < math.inf else 0
        self._process: Any = subprocess.Popen(
            command,
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL if take is take_pickle else subprocess.PIPE,
            cwd=folder,
            env=environment,
            start_new_session=True,
            pipesize=_CHUNK,  # fewer changes of context for large messages
            # A limit set later would miss processes started at once.
            preexec_fn=partial(carry, self._marker) if self._marker else None,
        )
        self.pid: int = self._process.pid
        self.partial, self.last_words = bytearray(), bytearray()
        self._unsent, self.request_length = bytearray(), 0
        self._heard = self._heard_before = 0  # of standard error, and before the last request [B]
        self._is_deaf = False
        self._looks: list[tuple[float, list[Process]]] = []
        self._selector = selectors.DefaultSelector()
        for pipe in _pipes(self._process):
            os.set_blocking(pipe.fileno(), False)
            if pipe is not self._process.stdin:
                self._selector.register(pipe, selectors.EVENT_READ)
        watch = guard(self.pid, self._marker)
        self._end = weakref.finalize(self, _end, self._process, watch, self._marker, self._selector)

    @property
    def code(self) -> int:
        """The exit code of an ended process, or minus the signal."""
        return int(self._process.returncode)

    @property
    def ending(self) -> str:
        """How the process ended: "with code 3" or "by SIGSEGV"."""
        if self.code >= 0:
            return f"with code {self.code}"
        try:
            return f"by {signal.Signals(-self.code).name}"
        except ValueError:
            return f"by signal {-self.code}"

    @property
    def recent_words(self) -> bytes:
        """The part of `last_words` since the last message was sent."""
        count = self._heard - self._heard_before
        return bytes(self.last_words[-count:]) if count else b""

    def send(self, message: bytes) -> None:
        """Queue a message, which is written while the answer is awaited."""
        if self._process.stderr:
            self._listen()
        self._heard_before = self._heard
        self._unsent += message
        self.request_length = len(message)
        if not self._is_deaf:
            self._forget(self._process.stdin)
            self._selector.register(self._process.stdin, selectors.EVENT_WRITE)

    def receive(self, seconds: float = math.inf, processor: float = math.inf) -> Any:
        """Return the next message, within limits of time and of the program's processor time [s].

        Raise LostError if none comes in time, the program ended, or exceeds a limit.
        """
        start = looked = time.monotonic()
        self._looks.clear()
        while not (message := self._next_message()):
            now = time.monotonic()
            limit = start + (min(seconds, GRACE) if self._is_deaf else seconds)
            if now - looked >= TICK or now >= limit:
                looked = now
                self._look(processor)
                if message := self._next_message():  # an answer, and then its end
                    break
            if now >= limit:
                raise LostError(self._silence())
            self._exchange(max(min(TICK, limit - now), 0.0))
        return message[0]

    def leave(self, seconds: float) -> tuple[bool, int]:
        """Close its input, end all after some time [s]; return whether it left, and its strays."""
        self._forget(self._process.stdin)
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        has_left = self._ends_within(seconds)
        strays = len(family(self.pid, self._marker)) if has_left else 0
        self.end()
        return has_left, strays

    def end(self) -> None:
        """Kill the program and all of its descendants."""
        self._end()

    def _next_message(self) -> tuple[Any, ...]:
        try:
            return self._take(self.partial)
        except Exception:
            raise LostError(Loss.GARBLED) from None

    def _exchange(self, seconds: float) -> None:
        """Write and read without blocking, or wait for a pipe for so long [s]."""
        if not self._pump(seconds):
            raise self._ended()
        if len(self.partial) > self._longest:
            raise LostError(Loss.TOO_LONG)

    def _pump(self, seconds: float) -> bool:
        """Do what `_exchange` does, and return whether standard output is still open."""
        is_open = True
        for key, _ in self._selector.select(seconds):
            if key.fileobj is self._process.stdin:
                self._write()
                continue
            if key.fileobj is self._process.stderr:
                self._listen()
                continue
            with contextlib.suppress(BlockingIOError):
                chunk = os.read(key.fd, _CHUNK)
                self.partial += chunk
                if not chunk:
                    self._forget(key.fileobj)
                    is_open = False
        return is_open

    def _listen(self) -> None:
        """Read standard error, and keep its end."""
        chunk = b""
        with contextlib.suppress(BlockingIOError):
            chunk = os.read(self._process.stderr.fileno(), _CHUNK)
            if not chunk:
                self._forget(self._process.stderr)
        self._heard += len(chunk)
        self.last_words += chunk
        if len(self.last_words) > STDERR_LENGTH:  # from the first whole line on
            self.last_words = self.last_words[-STDERR_LENGTH:]
            self.last_words = self.last_words.partition(b"\n")[2] or self.last_words

    def _write(self) -> None:
        try:
            with _no_signal_of_pipes():
                count = os.write(self._process.stdin.fileno(), self._unsent[:_CHUNK])
            del self._unsent[:count]
        except BlockingIOError:
            return
        except OSError:  # it does not read, or has ended
            self._is_deaf = True
            self._unsent.clear()
        if not self._unsent:
            self._forget(self._process.stdin)

    def _forget(self, pipe: Any) -> None:
        with contextlib.suppress(KeyError):
            self._selector.unregister(pipe)

    def _ends_within(self, seconds: float) -> bool:
        """Return whether the program ends in time; discard its output until then."""
        deadline, length = time.monotonic() + seconds, len(self.partial)
        while not (has_ended := self._has_ended()) and time.monotonic() < deadline:
            self._pump(TICK / 10)
            del self.partial[length:]
        return has_ended

    def _has_ended(self) -> bool:
        """Return whether the program ended; keep its process number reserved where possible."""
        if not hasattr(os, "waitid") or self._process.returncode is not None:
            return self._process.poll() is not None
        options = os.WEXITED | os.WNOWAIT | os.WNOHANG
        return os.waitid(os.P_PID, self.pid, options) is not None

    def _look(self, processor: float) -> None:
        """Raise if the program ended or exceeds a limit; record its processes."""
        if self._has_ended():  # while another process holds its pipes
            before = len(self.partial)
            self._exchange(0.0)
            if len(self.partial) == before:
                raise self._ended()
        if min(self._memory, processor) == math.inf:  # a timed program is not disturbed
            return
        members = family(self.pid, self._marker)
        self._looks.append((time.monotonic(), members))
        if sum(member.memory for member in members) > self._memory:
            raise LostError(Loss.MEMORY)
        if self._used() > processor:
            raise LostError(Loss.PROCESSOR)

    def _used(self) -> float:
        """Return the program's processor time since its first record [s]."""
        first, last = (sum(p.seconds for p in self._looks[i][1]) for i in (0, -1))
        return last - first

    def _ended(self) -> LostError:
        """Return the error of a program that closed its output."""
        has_ended = self._ends_within(GRACE)
        for _ in range(8):  # more than the pipe of its last words holds
            self._pump(0.0)
        self.end()
        if not has_ended:
            return LostError(Loss.CLOSED)
        return LostError(Loss.TRUNCATED if self.partial else Loss.ENDED)

    def _silence(self) -> Loss:
        """Return why no message came in time."""
        if self._is_deaf:
            return Loss.DEAF
        if self.partial:
            return Loss.UNFINISHED
        if self._unsent:
            return Loss.UNREAD
        if not self._looks:
            return Loss.WAITING
        runs = [any(process.runs for process in members) for _, members in self._looks]
        seconds = self._looks[-1][0] - self._looks[0][0]
        computed = self._used() > IDLE * seconds or 2 * sum(runs) > len(runs)
        return Loss.COMPUTING if computed else Loss.WAITING


def _pipes(process: Any) -> list[Any]:
    return [pipe for pipe in (process.stdin, process.stdout, process.stderr) if pipe]


def _end(
    process: Any, watch: subprocess.Popen[bytes], marker: int, selector: selectors.BaseSelector
) -> None:
    end_group(process.pid, marker)
    with contextlib.suppress(subprocess.TimeoutExpired):  # stuck in the kernel
        process.wait(GRACE)
    watch.kill()
    watch.communicate()
    selector.close()
    for pipe in _pipes(process):
        pipe.close()


@contextlib.contextmanager
def _no_signal_of_pipes() -> Iterator[None]:
    """Make a write to a closed pipe an error, whatever the handler of SIGPIPE."""
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        yield
    finally:
        if signal.SIGPIPE not in blocked:
            if signal.SIGPIPE in signal.sigpending():
                signal.sigwait({signal.SIGPIPE})
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGPIPE})


def python_process(statement: str) -> ChildProcess:
    """Start Python with our packages, on one thread, for pickled objects."""
    command = [sys.executable, "-P", "-c", _PATH + statement, str(_ROOT)]
    return ChildProcess(command, take_pickle, environment=one_thread())


def one_thread() -> dict[str, str]:
    """Return an environment to limit the linear algebra of NumPy and SciPy to a single core."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {**os.environ, **dict.fromkeys(names, "1")}


def take_streams() -> tuple[int, int]:
    """Return the descriptors of requests and answers, and hide both from solvers.

    Solvers then read an empty input, and print to standard error.
    """
    requests, answers = os.dup(0), os.dup(1)
    empty_input = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty_input, 0)
    os.close(empty_input)
    os.dup2(2, 1)
    return requests, answers


def connect() -> tuple[Connection, Connection]:
    """Return the connections of pickled requests and answers with the parent of this process."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    requests, answers = take_streams()
    return Connection(requests, writable=False), Connection(answers, readable=False)


class CallProcess:
    """A process that performs calls in turn, started at the first call and after a loss."""

    def __init__(self, prepare: Callable[[], object], patience: float) -> None:
        """Set the first call of each process, and the limit of processor time of a call [s]."""
        self._prepare, self._patience = prepare, patience
        self._child: ChildProcess | None = None

    def call(self, function: Callable[..., CallResult], *arguments: object) -> CallResult:
        """Return the result of a function of a module, which must not raise.

        Raise LostError if the process ended, or the call took too much processor time or too long.
        """
        try:
            if self._child is None:
                self._child = python_process(f"import {__name__} as c; c.perform_calls()")
                _perform(self._child, _START, self._prepare)
            return _perform(self._child, self._patience, function, *arguments)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the process, if any."""
        child, self._child = self._child, None
        if child is not None:
            child.end()


def _perform(child: ChildProcess, patience: float, *call: object) -> Any:
    child.send(pickled(call))
    try:
        return child.receive(_WALL * patience, patience)
    except LostError as error:
        loss = error.loss
    message = "the process ends the connection"
    if loss is Loss.PROCESSOR:
        message = f"it takes more than {patience:g} s of processor time"
    elif loss in SILENT:
        message = f"it gives no answer within {_WALL * patience:g} s"
    elif loss in (Loss.ENDED, Loss.TRUNCATED):
        message = f"the process ends {child.ending}"
    raise LostError(loss, message)


def perform_calls() -> None:
    """Perform the calls of the parent process."""
    requests, answers = connect()
    with contextlib.suppress(EOFError):
        while True:
            function, *arguments = requests.recv()
            answers.send(function(*arguments))
