"""Targets to be solved one by one in a worker's process, by one solver with its settings."""

import contextlib
import ctypes
import functools
import importlib
import random
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..peers.ik.protocol import Solve, UnableError, attempt
from ..peers.ik.restarts import restarted
from ..peers.protocol import NoAnswerError, OwnTime, describe, remark_of
from .isolation import WorkerProcess
from .progress import TROUBLE, Progress
from .stopwatch import Budget, time_call
from .worker import Done, Message, Ready, Solved, Unfit

# A solve that took less [s] is made again so often, uncounted, right before the next.
QUICK, AGAIN = 1e-3, 4


class Requests(Protocol):
    """Targets as a solver is asked for them."""

    @property
    def shape(self) -> tuple[int, int]:
        """The number of targets, and of the numbers of an answer."""

    def request(self, i: int) -> tuple[Any, ...]:
        """Return what `ask` is called with for a target."""


class Job(NamedTuple):
    """What is to be solved, and by what.

    Attributes:
        module: the adapter's module, by its full name.
        model: what the adapter is prepared for: a robot, or a skeleton.
        targets: solved in order.
        tolerance: when a target counts as reached.
        settings: what the adapter is prepared with.
        restarts: further attempts from random poses, made here for solvers that make one.
        budget: no further target is begun after so long [s].
        entrant: the name of a user's solver, whose first trouble is announced; "" of others.
        warms_up: whether the first target is solved, and quick solves are made again, uncounted.
    """

    module: str
    model: Any
    targets: Requests
    tolerance: Any
    settings: Mapping[str, Any]
    restarts: int
    budget: float
    entrant: str = ""
    warms_up: bool = True

    def perform(self) -> Iterator[Message]:
        """Yield what comes of it, each part as soon as it is there."""
        try:
            adapter = importlib.import_module(self.module)
            ask, setup = time_call(lambda: self._prepared(adapter))
            first = self._solved(ask(*self.targets.request(0))) if self.warms_up else None
            if self.restarts and first is not None and first.claim < 0:
                raise UnableError("not started again, for it claims nothing of its answers")
        except Exception as error:  # whatever an engine raises is its result
            yield from unfit(error, self.entrant)
        else:
            yield Ready(setup, remark_of(adapter))
            yield from announced(self._all_solved(ask), self.entrant)
            yield Done()

    def _prepared(self, adapter: Any) -> Any:
        ask = adapter.prepare(self.model, self.tolerance, **self.settings)
        return restarted(ask, self.model, self.restarts) if self.restarts else ask

    def _all_solved(self, ask: Any) -> Iterator[Solved]:
        """Yield the targets one by one, for as long as the budget lasts."""
        budget, before = Budget(self.budget), None
        for i in range(self.targets.shape[0]):
            if budget.is_spent:
                return
            solve = ask(*self.targets.request(i))
            if before is not None and self.warms_up:
                # So that caches are as in a loop of solves and nothing else.
                for _ in range(AGAIN):
                    again = attempt(before)
                    budget.excuse(again.time.at_door if again.time else 0.0)
            _seed_shared_generators(i)
            solved = self._solved(solve)
            budget.excuse(solved.at_door)
            before = solve if solved.seconds < QUICK else None
            yield solved

    def _solved(self, solve: Solve) -> Solved:
        output, seconds = time_call(lambda: attempt(solve))
        nothing = np.full(self.targets.shape[1], np.nan)
        q = nothing if output.q is None else np.array(output.q, dtype=float)
        trouble = output.error
        if q.shape != nothing.shape:
            q, trouble = nothing, f"returned {q.shape} numbers, not {nothing.shape}"
        claimed = -1 if output.claim is None else int(output.claim)
        return solved_in(output.time or OwnTime(seconds), q, claimed, trouble)


def solved_in(time: OwnTime, q: np.ndarray, claimed: int, trouble: str = "") -> Solved:
    """Return a message on a target that took so long."""
    return Solved(q, claimed, time.seconds, trouble, time.round_trip, time.doubt)


def unfit(error: Exception, entrant: str) -> Iterator[Message]:
    """Yield that a job cannot be done; that a user's solver does not answer is announced."""
    if entrant and isinstance(error, NoAnswerError):
        yield Progress(entrant, TROUBLE, describe(error))
    yield Unfit(str(error) if isinstance(error, UnableError) else describe(error))


def announced(targets: Iterator[Solved], entrant: str) -> Iterator[Message]:
    """Yield targets; ahead of the first one in trouble, what troubles a user's solver."""
    is_silent = bool(entrant)
    for target in targets:
        if is_silent and (target.trouble or target.doubt):
            yield Progress(entrant, TROUBLE, target.trouble or target.doubt)
            is_silent = False
        yield target


def _seed_shared_generators(seed: int) -> None:
    """Seed the generators that all of a process shares: an engine may draw from any of them.

    Else an answer would depend on how often solves before it were made again.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (that is the one which is shared)
    with contextlib.suppress(AttributeError, OSError, TypeError):  # no C library to be asked
        ctypes.CDLL(None).srand(seed)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which solvers of targets work, one after the other."""
    return WorkerProcess()
