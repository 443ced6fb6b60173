"""Solvers in a process of their own, which is ended when it falls silent; what it sent counts."""

import atexit
import contextlib
import os
import pickle
import queue
import subprocess
import sys
import threading
from collections import Counter
from typing import NamedTuple

from .worker import Done, Message, Ready, Solved, Unfit, Work

# A worker that says nothing for so long [s] is ended: before it is ready it may compile.
START_PATIENCE = 180.0
TARGET_PATIENCE = 10.0


class Outcome(NamedTuple):
    """What came of a job.

    Attributes:
        setup: how long the solver took to be set up [s].
        solved: the targets that were done, in order.
        trouble: why there are no more, or what was raised and how often; else "".
        lost: whether the worker was lost over the next target.
    """

    setup: float
    solved: list[Solved]
    trouble: str
    lost: bool = False


class Workshop:
    """One worker, started when the first job comes, and anew after one that was lost."""

    def __init__(
        self, start_patience: float = START_PATIENCE, target_patience: float = TARGET_PATIENCE
    ) -> None:
        # While it is being set up, and once it is ready.
        self._patience = start_patience, target_patience
        self._worker: _Worker | None = None
        atexit.register(self.close)

    @property
    def patience(self) -> float:
        """How long a worker may be silent over a target [s]."""
        return self._patience[True]

    def perform(self, job: Work) -> Outcome:
        """Return what came of a job, however it ended."""
        setup, ready, solved = 0.0, False, list[Solved]()
        try:
            worker = self._worker = self._worker or _Worker()
            worker.send(job)
            while True:
                message = worker.messages.get(timeout=self._patience[ready])
                match message:
                    case Ready():
                        setup, ready = message.setup, True
                    case Solved():
                        solved.append(message)
                    case Unfit():
                        return Outcome(setup, solved, message.why)
                    case Done():
                        return Outcome(setup, solved, raised(solved))
                    case None:
                        return Outcome(setup, solved, self._crash(worker), ready)
        except queue.Empty:
            self.close()
            silent = f"ended after {self._patience[ready]:g} s of silence"
            return Outcome(setup, solved, silent, ready)
        except BaseException:  # what is still under way must not answer the next job
            self.close()
            raise

    def close(self) -> None:
        """End the worker, if there is one."""
        worker, self._worker = self._worker, None
        if worker is not None:
            worker.end()

    def _crash(self, worker: "_Worker") -> str:
        code = worker.code()
        self.close()
        return f"its process ended with code {code}"


class _Worker:
    """A process that performs jobs, and a thread that passes on what it says, None at the end."""

    def __init__(self) -> None:
        self.messages: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bench.worker"], env=one_thread(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self._relay = threading.Thread(target=self._pass_on, daemon=True)
        self._relay.start()

    def send(self, job: Work) -> None:
        """Send a job; if the process is gone, the end of its messages says so."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()

    def code(self) -> int | None:
        """Return the code of a process that has no more to say."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        return self._process.returncode

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._relay.join()
        for pipe in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(BrokenPipeError):
                assert pipe is not None
                pipe.close()

    def _pass_on(self) -> None:
        assert self._process.stdout is not None
        with contextlib.suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):
            while True:
                self.messages.put(pickle.load(self._process.stdout))
        self.messages.put(None)


def raised(solved: list[Solved]) -> str:
    """Return what a solver raised most often, and how often; "" if it raised nothing."""
    counts = Counter(one.trouble for one in solved if one.trouble)
    if not counts:
        return ""
    what, times = counts.most_common(1)[0]
    return f"{what}, on {times} of {len(solved)} targets"


def one_thread() -> dict[str, str]:
    """Return an environment in which the linear algebra of NumPy and SciPy keeps to one core."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {**os.environ, **dict.fromkeys(names, "1")}
