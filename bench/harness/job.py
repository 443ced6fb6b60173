"""Targets that a solver with its settings solves in order in a worker's process."""

import contextlib
import ctypes
import functools
import importlib
import math
import random
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..peers.ik.overhead import overhead
from ..peers.ik.protocol import SolverOutput, attempt
from ..peers.ik.restarts import digest_of, restarted
from ..peers.protocol import NoAnswerError, OwnTime, describe, remark_of
from ..problems.robots import UnableError
from .isolation import WorkerProcess
from .progress import TROUBLE, Progress
from .stopwatch import Budget, time_call
from .worker import Finished, Message, Ready, Solved

# A solve that took less [s] is repeated so often, uncounted, right before the next.
QUICK, REPEATS = 1e-3, 4


class Job(NamedTuple):
    """Targets and the solver that solves them."""

    module: str  # the adapter's module, by its full name
    model: Any  # the robot or skeleton that the adapter is prepared for
    # solved in order: `request(i)` is the request of a target, `shape` the number of targets and of
    # the numbers of an answer
    targets: Any
    tolerance: Any  # when a target counts as reached
    settings: Mapping[str, Any]  # of the adapter
    restarts: int  # further attempts from random poses, made here for solvers without restarts
    budget: float  # no further target is begun after so long [s]
    entrant: str = ""  # the name of a user's solver, to announce its first trouble; else ""
    # whether the first target is solved, and quick solves are repeated, uncounted
    warms_up: bool = True

    def perform(self) -> Iterator[Message]:
        """Yield the messages of the job, each as soon as it is there."""
        try:
            adapter = importlib.import_module(self.module)
            prepare = partial(adapter.prepare, self.model, self.tolerance, **self.settings)
            ask, setup = time_call(prepare)
            if self.restarts:
                ask = restarted(ask, self.model, self.restarts)
            first = self._solved(ask(self.targets.request(0))) if self.warms_up else None
            if self.restarts and first is not None and first.claim < 0:
                raise UnableError("not started again, for it claims nothing of its answers")
        except Exception as error:  # an exception of an engine is its result
            yield from unfit(error, self.entrant)
        else:
            yield Ready(setup, remark_of(adapter), self._overhead(adapter, prepare))
            yield from announced(self._answers(ask), self.entrant)
            yield Finished()

    def _overhead(self, adapter: Any, prepare: Callable[[], Any]) -> float:
        """Return the time of a solve that the solver does not use [s], NaN of users' solvers."""
        if self.entrant or not self.warms_up:
            return math.nan
        return overhead(adapter, prepare, self.targets.request(0))

    def _answers(self, ask: Any) -> Iterator[Solved]:
        """Solve the targets in order within the budget."""
        budget, previous = Budget(self.budget), None
        for i in range(self.targets.shape[0]):
            if budget.is_spent:
                return
            request = self.targets.request(i)
            solve = ask(request)
            # So that caches are as in a loop of solves and nothing else.
            for _ in range(REPEATS if self.warms_up else 0):
                if previous is None:
                    break
                repeated = attempt(previous)
                budget.excuse(repeated.time.overhead if repeated.time else 0.0)
            seed_shared_generators(digest_of(*request))
            solved = self._solved(solve)
            budget.excuse(solved.overhead)
            previous = solve if solved.seconds < QUICK else None
            yield solved

    def _solved(self, solve: Callable[[], SolverOutput]) -> Solved:
        output, seconds = time_call(lambda: attempt(solve))
        q, trouble = np.full(self.targets.shape[1], np.nan), output.error
        if output.q is not None:
            answer = np.array(output.q, dtype=float)
            if answer.shape == q.shape:
                q = answer
            else:
                trouble = f"returned {answer.shape} numbers, not {q.shape}"
        claim = -1 if output.claim is None else int(output.claim)
        return solved_in(output.time or OwnTime(seconds), q, claim, trouble)


def solved_in(time: OwnTime, q: np.ndarray, claim: int, trouble: str = "") -> Solved:
    """Return the answer for a target that took so long."""
    return Solved(q, claim, time.seconds, trouble, time.round_trip, time.doubt)


def unfit(error: Exception, entrant: str) -> Iterator[Message]:
    """Yield why a job cannot be done; announce that a user's solver does not answer."""
    if entrant and isinstance(error, NoAnswerError):
        yield Progress(entrant, TROUBLE, describe(error))
    yield Finished(str(error) if isinstance(error, UnableError) else describe(error))


def announced(targets: Iterator[Solved], entrant: str) -> Iterator[Message]:
    """Yield targets; announce the first trouble of a user's solver ahead of its target."""
    is_silent = bool(entrant)
    for target in targets:
        if is_silent and (target.trouble or target.doubt):
            yield Progress(entrant, TROUBLE, target.trouble or target.doubt)
            is_silent = False
        yield target


def seed_shared_generators(seed: int) -> None:
    """Seed the generators of the process, from which an engine may draw.

    Without it, an answer would depend on how often earlier solves were repeated.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (the shared generator)
    with contextlib.suppress(AttributeError, OSError, TypeError):  # without a C library
        ctypes.CDLL(None).srand(seed)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers of targets work in turn."""
    return WorkerProcess()
