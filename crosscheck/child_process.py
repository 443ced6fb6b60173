"""Calls that may crash or never end, in a process of their own."""

import multiprocessing
import os
import resource
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

Result = TypeVar("Result")


class LostError(Exception):
    """A call crashed its process or took too long; the message says which."""


class ChildProcess:
    """A process that performs calls one by one, started when one comes, and anew after a loss.

    What it would print goes nowhere.

    Attributes:
        prepare: called first in every process, to load and compile.
        patience: how long a call may take [s].
        start_patience: how long the start and `prepare` may take [s].
    """

    def __init__(
        self, prepare: Callable[[], object], patience: float = 60.0, start_patience: float = 300.0
    ) -> None:
        self.prepare = prepare
        self.patience = patience
        self.start_patience = start_patience
        self._process: Any = None
        self._pipe: Any = None

    def __enter__(self) -> "ChildProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def call(self, function: Callable[..., Result], *arguments: object) -> Result:
        """Return what a function of a module returns, which must not raise.

        Raises:
            LostError: if the process ended or took too long.
        """
        try:
            if self._process is None:
                self._start()
                self._perform(self.start_patience, self.prepare)
            return self._perform(self.patience, function, *arguments)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the process, if there is one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.join()
            self._pipe.close()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def _perform(self, patience: float, *call: object) -> Any:
        try:
            self._pipe.send(call)
            if not self._pipe.poll(patience):
                raise LostError(f"it takes longer than {patience:g} s")
            return self._pipe.recv()
        except (EOFError, OSError):
            self._process.join()
            raise LostError(_ended(self._process.exitcode)) from None


def _ended(code: int) -> str:
    if code >= 0:
        return f"the process ends with code {code}"
    return f"the process ends by {signal.Signals(-code).name}"


def _serve(pipe: Connection) -> None:
    """Perform calls until nobody listens; leave interrupts to who started this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    while True:
        try:
            function, *arguments = pipe.recv()
            pipe.send(function(*arguments))
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return
