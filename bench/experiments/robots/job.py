"""Targets to be solved one by one in a worker's process, by one solver with its settings."""

import contextlib
import ctypes
import importlib
import random
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...harness.stopwatch import Budget, round_trips, timed
from ...harness.worker import Done, Message, Ready, Solved, Unfit, describe
from ...peers.ik.protocol import Ask, Solve, UnableError, attempt, remark_of
from ...peers.ik.restarts import restarted
from ...problems.evaluate import Targets, Tolerance
from ...problems.robots import Robot

# A solve that took less [s] is made again so often, uncounted, right before the next.
QUICK, AGAIN = 1e-3, 4


class Job(NamedTuple):
    """What is to be solved, and by what.

    Attributes:
        module: the adapter's module, by its full name.
        robot: the robot.
        targets: solved in order.
        tolerance: when a target counts as reached.
        settings: what the adapter is prepared with.
        restarts: further attempts from random poses, made here for solvers that make one.
        budget: no further target is begun after so long [s].
    """

    module: str
    robot: Robot
    targets: Targets
    tolerance: Tolerance
    settings: Mapping[str, Any]
    restarts: int
    budget: float

    def perform(self) -> Iterator[Message]:
        """Yield what comes of it, each part as soon as it is there."""
        try:
            adapter = importlib.import_module(self.module)
            ask, setup = timed(lambda: _prepared(adapter, self))
            first = _solve(_asked(ask, self, 0), self)  # may compile
            if self.restarts and first.claimed < 0:
                raise UnableError("not started again, for it claims nothing of its answers")
        except UnableError as error:
            yield Unfit(str(error))
        except Exception as error:  # whatever an engine raises is its result
            yield Unfit(describe(error))
        else:
            yield Ready(setup, remark_of(adapter))
            yield from _solved(ask, self)
            yield Done()


def _solved(ask: Ask, job: Job) -> Iterator[Solved]:
    """Yield the targets one by one, for as long as the budget lasts."""
    budget, before = Budget(job.budget), None
    for i in range(len(job.targets.starts)):
        if budget.is_spent:
            return
        solve = _asked(ask, job, i)
        if before is not None:  # so that caches are as in a loop of solves and nothing else
            with contextlib.suppress(Exception):
                for _ in range(AGAIN):
                    before()
        _seed_shared_generators(i)
        solved = _solve(solve, job)
        before = solve if solved.seconds < QUICK else None
        yield solved


def _seed_shared_generators(seed: int) -> None:
    """Seed the generators that all of a process shares: an engine may draw from any of them.

    Else an answer would depend on how often solves before it were made again.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (that is the one which is shared)
    with contextlib.suppress(AttributeError, OSError, TypeError):  # no C library to be asked
        ctypes.CDLL(None).srand(seed)


def _prepared(adapter: Any, job: Job) -> Ask:
    ask = adapter.prepare(job.robot, job.tolerance, **job.settings)
    return restarted(ask, job.robot, job.restarts) if job.restarts else ask


def _asked(ask: Ask, job: Job, i: int) -> Solve:
    positions, rotations, starts, _ = job.targets
    return ask(positions[i], rotations[i], starts[i].copy())


def _solve(solve: Solve, job: Job) -> Solved:
    output, seconds = timed(lambda: attempt(solve))
    nothing = np.full(job.targets.starts.shape[-1], np.nan)
    q = nothing if output.q is None else np.array(output.q, dtype=float)
    trouble = output.error
    if q.shape != nothing.shape:
        q, trouble = nothing, f"returned {q.shape} numbers, not {nothing.shape}"
    claimed = -1 if output.claimed is None else int(output.claimed)
    seconds = seconds if output.seconds is None else output.seconds
    return Solved(q, claimed, seconds, trouble, *round_trips())
