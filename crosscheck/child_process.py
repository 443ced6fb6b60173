"""Python in a process of its own: a call that crashes, hangs or talks nonsense costs no other."""

import contextlib
import os
import queue
import resource
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any, TypeVar

Result = TypeVar("Result")

# A call may last so many times its limit of processor time: others may use the processor, too.
_WALL = 10
# A process whose connection has ended is given so long [s] to end by itself.
_LEAVE = 1.0
# In safe-path mode (-P) nothing is imported from the working directory; our packages come from
# where this file is, before any other that the path may lead to.
_ROOT = Path(__file__).parents[2]
_PATH = "import sys; sys.path.insert(0, sys.argv[1]); "
_CALLS = "import plumbob.crosscheck.child_process as c; c.perform_calls({})"


class LostError(Exception):
    """A call crashed its process or took too long; the message says which."""


class PipedProcess:
    """A Python process in a group of its own, and threads that talk with it so that we never wait.

    What it prints goes nowhere.

    Attributes:
        process: the process.
    """

    def __init__(self, program: str, environment: Mapping[str, str] | None = None) -> None:
        """Start a program; `{}` in it stands for the descriptor of its end of the connection."""
        self._outgoing: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._incoming: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self._connection, theirs = Pipe()
        with theirs:
            program = _PATH + program.format(theirs.fileno())
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-c", program, str(_ROOT)],
                pass_fds=[theirs.fileno()],
                env=environment,
                process_group=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        self._threads = [threading.Thread(target=f, daemon=True) for f in (self._write, self._read)]
        for thread in self._threads:
            thread.start()

    def send(self, message: object) -> None:
        """Send a message; whether it arrives is known from what is received."""
        self._outgoing.put(bytes(ForkingPickler.dumps(message)))

    def receive(self, patience: float) -> Any:
        """Return the next message.

        Raises:
            TimeoutError: if none came in time [s].
            EOFError: if there will be none: the process ended, or sent what cannot be read.
        """
        try:
            received = self._incoming.get(timeout=patience)
        except queue.Empty:
            raise TimeoutError from None
        if not received:
            raise EOFError
        return received[0]

    def ending(self) -> str:
        """Return how the process ended, "with code 3" or "by SIGSEGV", "" if it still runs."""
        try:
            code = self.process.wait(timeout=_LEAVE)
        except subprocess.TimeoutExpired:
            return ""
        names = {int(known): known.name for known in signal.Signals}
        return f"with code {code}" if code >= 0 else f"by {names.get(-code, f'signal {-code}')}"

    def end(self) -> None:
        """End the process and all that it has started."""
        kill_group(self.process)
        self._outgoing.put(None)
        with (
            socket.socket(fileno=os.dup(self._connection.fileno())) as ours,
            contextlib.suppress(OSError),
        ):
            ours.shutdown(socket.SHUT_RDWR)  # whoever else may hold the other end
        for thread in self._threads:
            thread.join()
        self._connection.close()
        assert self.process.stdin is not None
        self.process.stdin.close()

    def _write(self) -> None:
        with contextlib.suppress(OSError):  # then reading ends too
            while (message := self._outgoing.get()) is not None:
                self._connection.send_bytes(message)

    def _read(self) -> None:
        """Pass on messages; an empty tuple is the end, whatever the process does or sends."""
        with contextlib.suppress(Exception):
            while True:
                self._incoming.put((self._connection.recv(),))
        self._incoming.put(())


def kill_group(process: "subprocess.Popen[Any]") -> None:
    """Kill a process that leads a group, and all that it has started; return when it is gone."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()


def attach(descriptor: int) -> Connection:
    """Return the connection that this process was started with; its end is that of its parent."""
    os.set_inheritable(descriptor, False)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    return Connection(descriptor)


def _end_with_parent() -> None:
    """Wait for the end of the input, which only the parent holds open, and leave."""
    os.read(0, 1)
    os._exit(1)


class ChildProcess:
    """A process that performs calls one by one, started when one comes, and anew after a loss.

    Attributes:
        prepare: called first in every process, to load and compile.
        patience: how much processor time a call may take [s].
        start_patience: how much `prepare` may take [s].
    """

    def __init__(
        self, prepare: Callable[[], object], patience: float = 60.0, start_patience: float = 300.0
    ) -> None:
        self.prepare = prepare
        self.patience = patience
        self.start_patience = start_patience
        self._child: PipedProcess | None = None

    def __enter__(self) -> "ChildProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def call(self, function: Callable[..., Result], *arguments: object) -> Result:
        """Return what a function of a module returns, which must not raise.

        Raises:
            LostError: if the process ended, or the call took too much processor time or too long.
        """
        try:
            if self._child is None:
                self._child = PipedProcess(_CALLS, one_thread())
                _perform(self._child, self.start_patience, self.prepare)
            result: Result = _perform(self._child, self.patience, function, *arguments)
            return result
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the process, if there is one."""
        child, self._child = self._child, None
        if child is not None:
            child.end()


def _perform(child: PipedProcess, patience: float, *call: object) -> Any:
    child.send((patience, *call))
    try:
        return child.receive(_WALL * patience)
    except TimeoutError:
        raise LostError(f"it gives no answer within {_WALL * patience:g} s") from None
    except EOFError:
        if (ending := child.ending()) == "by SIGPROF":
            raise LostError(f"it takes more than {patience:g} s of processor time") from None
        raise LostError(f"the process ends {ending or 'the connection'}") from None


def perform_calls(descriptor: int) -> None:
    """Perform calls in a process that was started for them until nobody listens."""
    connection = attach(descriptor)
    while True:
        try:
            patience, function, *arguments = connection.recv()
        except EOFError:
            return
        # SIGPROF ends the process after so much processor time, whatever code it is in.
        signal.setitimer(signal.ITIMER_PROF, patience)
        result = function(*arguments)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        connection.send(result)


def one_thread() -> dict[str, str]:
    """Return an environment in which the linear algebra of NumPy and SciPy keeps to one core."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {**os.environ, **dict.fromkeys(names, "1")}
