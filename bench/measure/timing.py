"""A timed solve, from the adapter to the record: attempts, restarts, jobs, and rounds of turns.

An adapter's `make_solve(request)` converts a target and returns a solve, timed by `clock`. A
`Job` sets a solver up in the worker's process and solves all targets in order. Afterwards the
solvers of the same targets are timed in turns, each turn a job of its own.
"""

import contextlib
import ctypes
import importlib
import math
import random
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .. import clock
from ..peers.connection import remark
from ..peers.protocol import (
    BenchRobot,
    NoAnswerError,
    OwnTime,
    PoseRequest,
    Solve,
    SolveFactory,
    SolverOutput,
    UnableError,
    describe,
    total,
)
from .isolation import (
    Finished,
    JobOutcome,
    Message,
    Ready,
    Solved,
    believed,
    raised,
    worker_process,
)
from .progress import TROUBLE, Progress
from .record import FIRST_TARGETS

_SEED = 1986  # of restarts
# Times of slow solves are sent whenever their sum exceeds this [s], lest a worker seem silent.
_SILENCE = 0.5
# A user's solver may take so long for a target, on average, and at least so long in all [s].
_TARGET_SECONDS, _LEAST_SECONDS = 0.2, 10.0
# A solver that hangs on this many targets does not finish.
MAXIMUM_SILENCES = 3


def attempt(solve: Callable[[], SolverOutput]) -> SolverOutput:
    """Return the answer of a solve with its time; an exception is a failed attempt."""

    def solution() -> SolverOutput:
        try:
            return solve()
        except Exception as error:  # an exception of an engine is its result
            return SolverOutput(None, False, error=describe(error))

    output, seconds = clock.time_call(solution)
    return output._replace(time=output.time or OwnTime(seconds))


def restarted(make_solve: SolveFactory, robot: BenchRobot, restarts: int) -> SolveFactory:
    """Return a solver with up to `restarts` further attempts from seeded random poses.

    An attempt succeeds by claiming an answer within the limits, which some solvers ignore; an
    exception is a failure. The poses depend on the target only, and all attempts are prepared
    before the clock runs.
    """
    limits = robot.lower, robot.upper

    def is_success(output: SolverOutput) -> bool:
        q = output.q
        return bool(output.claim) and q is not None and all(np.clip(q, *limits) == q)

    def make_restarts(request: PoseRequest) -> Callable[[], SolverOutput]:
        poses = robot.draw(np.random.default_rng([_SEED, digest_of(*request)]), restarts)
        attempts = [make_solve(request._replace(start=q.copy())) for q in (request.start, *poses)]

        def solve() -> SolverOutput:
            outputs: list[SolverOutput] = []
            for solve_once in attempts:
                outputs.append(attempt(solve_once))
                if is_success(outputs[-1]):
                    break
            last = next((o for o in reversed(outputs) if o.q is not None), outputs[-1])
            claim = None if last.claim is None else is_success(last)
            error = next((output.error for output in outputs if output.error), "")
            return SolverOutput(last.q, claim, total(output.time for output in outputs), error)

        return solve

    return make_restarts


def digest_of(*target: Any) -> int:
    """Return an unsigned number of 32 bits from all parts of a target."""
    digest = 0
    for part in target:
        digest = zlib.crc32(np.ascontiguousarray(part).tobytes(), digest)
    return digest


def seed_shared_generators(seed: int) -> None:
    """Seed the generators of the process, from which an engine may draw.

    Without the seed, an answer would depend on earlier solves.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (the shared generator)
    with contextlib.suppress(AttributeError, OSError, TypeError):  # without a C library
        ctypes.CDLL(None).srand(seed)


def messages_of(job: Any) -> Iterator[Message]:
    """Yield the messages of a job, which sets up a solver of a module and yields its answers.

    The first trouble of a user's solver, `user_solver`, is announced ahead of its target.
    """
    user_solver, is_silent = job.user_solver, bool(job.user_solver)
    try:
        adapter = importlib.import_module(job.module)
        solver, ready = job.set_up(adapter)
        yield replace(ready, remark=remark() if user_solver else "")
        for answer in job.answers(solver):
            trouble = answer.trouble or answer.time.doubt
            if is_silent and trouble:
                yield Progress(user_solver, TROUBLE, trouble)
                is_silent = False
            yield answer
        yield Finished()
    except Exception as error:  # an exception of an engine is its result
        if user_solver and isinstance(error, NoAnswerError):
            yield Progress(user_solver, TROUBLE, describe(error))
        yield Finished(str(error) if isinstance(error, UnableError) else describe(error))


class Job(NamedTuple):
    """Targets and their solver."""

    module: str  # the adapter's module, by its full name
    model: Any  # the robot or skeleton that the adapter is prepared for
    # solved in order: `request(i)` is the request of a target, `shape` the number of targets and of
    # the numbers of an answer
    targets: Any
    tolerance: Any  # when a target counts as reached
    settings: Mapping[str, Any]  # of the adapter
    restarts: int = 0  # further attempts from random poses, made here for solvers without restarts
    user_solver: str = ""  # the name of a user's solver, to announce its first trouble; else ""
    warms_up: bool = True  # whether the first target is solved once before, uncounted

    @property
    def budget(self) -> float:
        """The time after which a user's solver begins no further target [s]."""
        seconds = max(_LEAST_SECONDS, _TARGET_SECONDS * self.targets.shape[0])
        return seconds if self.user_solver else math.inf

    def perform(self) -> Iterator[Message]:
        """Yield the answers to all targets."""
        return messages_of(self)

    def set_up(self, adapter: Any) -> tuple[SolveFactory, Ready]:
        """Return the function of the adapter that takes requests, and how long that took."""
        make_solve, setup = clock.time_call(lambda: self.prepared(adapter))
        first = self.solve(make_solve, 0)() if self.warms_up else None
        if self.restarts and first is not None and first.claim < 0:
            raise UnableError("not started again, for it claims nothing of its answers")
        return make_solve, Ready(setup, overhead=self._overhead(adapter))

    def prepared(self, adapter: Any) -> SolveFactory:
        """Return the function of the adapter that takes requests, with restarts."""
        make_solve: SolveFactory = adapter.prepare(self.model, self.tolerance, **self.settings)
        return restarted(make_solve, self.model, self.restarts) if self.restarts else make_solve

    def _overhead(self, adapter: Any) -> float:
        """Return the part of a solve's time outside the solver [s], NaN of users' solvers."""
        if self.user_solver or not self.warms_up:
            return math.nan
        if not getattr(adapter, "METERED", False):  # a single call
            return clock.overhead(lambda: Solve(lambda: None, lambda q: (q, None)))
        job = self._replace(restarts=0)
        return clock.overhead(lambda: job.prepared(adapter)(self.targets.request(0)))

    def answers(self, make_solve: SolveFactory) -> Iterator[Solved]:
        """Solve the targets in order, until the budget is spent."""
        duration = 0.0
        for i in range(self.targets.shape[0]):
            answer = self.solve(make_solve, i)()
            yield answer
            duration += answer.duration
            if duration > self.budget:
                break

    def solve(self, make_solve: SolveFactory, i: int) -> Callable[[], Solved]:
        """Return the solve of a target, which is converted before the clock runs."""
        request = self.targets.request(i)
        try:
            solve = make_solve(request)
        except Exception as error:
            solve = partial(SolverOutput, None, False, OwnTime(0.0), describe(error))
        return partial(self._solved, solve, digest_of(*request))

    def _solved(self, solve: Callable[[], SolverOutput], digest: int) -> Solved:
        seed_shared_generators(digest)
        output = attempt(solve)
        q, trouble = np.full(self.targets.shape[1], np.nan), output.error
        if output.q is not None:
            answer = np.array(output.q, dtype=float)
            if answer.shape == q.shape:
                q = answer
            else:
                trouble = f"returned {answer.shape} numbers, not {q.shape}"
        claim = -1 if output.claim is None else int(output.claim)
        return Solved(q, claim, output.time or OwnTime(math.nan), trouble)


def answers(job: Job) -> JobOutcome:
    """Return the answers of a job; after the loss of a process, continue in a new process.

    Skip the target at a loss. A solver that hangs on `MAXIMUM_SILENCES` targets does not finish.
    """
    count, size = job.targets.shape
    outcome = last = worker_process().perform(job)
    solved, silences = [*outcome.solved], 0
    while last.is_lost and len(solved) < count and silences < MAXIMUM_SILENCES:
        silences += last.is_silent
        solved.append(Solved(np.full(size, np.nan), 0, OwnTime(0.0), last.trouble))
        if len(solved) < count and silences < MAXIMUM_SILENCES:
            last = worker_process().perform(job._replace(targets=job.targets.after(len(solved))))
            solved += last.solved
    if not outcome.is_lost:
        return outcome
    is_lost = last.is_lost and len(solved) < count
    return replace(outcome, solved=solved, trouble=raised(solved), is_lost=is_lost)


def first_targets(job: Job, outcome: JobOutcome) -> dict[str, Any]:
    """Return as a fact how many targets a slow solver was given, nothing if all."""
    count = len(outcome.solved)
    is_cut = 0 < count < job.targets.shape[0] and job.budget < math.inf and not outcome.is_lost
    return {FIRST_TARGETS: count} if is_cut else {}


# The solvers that take turns, by their numbers, in the worker's process.
_factories: dict[int, SolveFactory] = {}


class Turn(NamedTuple):
    """The turn of a solver: its first targets, timed."""

    module: str  # the adapter's module
    number: int  # of the solver
    job: Job
    target_count: int
    is_first: bool  # whether the solver is set up anew
    user_solver: str = ""  # whose trouble was announced with the answers

    def perform(self) -> Iterator[Message]:
        """Yield the pace before the turn, and the answers."""
        return messages_of(self)

    def set_up(self, adapter: Any) -> tuple[SolveFactory, Ready]:
        """Return the solver, as set up in its first turn."""
        if self.is_first or self.number not in _factories:
            _factories[self.number] = self.job.prepared(adapter)
        return _factories[self.number], Ready(pace=clock.pace())

    def answers(self, make_solve: SolveFactory) -> Iterator[Solved]:
        """Solve the targets, all converted before the first is solved.

        The first target is solved once before: caches are then as in a loop of solves.
        """
        solves = [self.job.solve(make_solve, i) for i in range(self.target_count)]
        solves[0]()
        unsent: list[Solved] = []
        for solve in solves:
            unsent.append(solve())
            if sum(answer.duration for answer in unsent) > _SILENCE:
                yield from unsent
                unsent = []
        yield from unsent


class Times(NamedTuple):
    """The times of a solver's targets, and of a fixed loop before each round [s]."""

    seconds: np.ndarray  # (round, target)
    control: np.ndarray  # (round,)


def times_in_turns(jobs: Sequence[Job], count: int, rounds: int) -> list[Times | None]:
    """Return the times of solvers taking turns, round after round, in a drawn order.

    Return None in place of a solver that is lost or not set up.
    """
    outcomes: dict[int, list[JobOutcome]] = {number: [] for number in range(len(jobs))}
    generator = np.random.default_rng(len(jobs))
    for i in range(rounds):
        for number in generator.permutation(list(outcomes)).tolist():
            job = jobs[number]
            turn = Turn(job.module, number, job, count, is_first=i == 0)
            outcomes[number].append(worker_process().perform(turn))
            if len(outcomes[number][-1].solved) < count:
                del outcomes[number]
    return [_times(outcomes[i], count) if i in outcomes else None for i in range(len(jobs))]


def _times(outcomes: Sequence[JobOutcome], count: int) -> Times:
    solved = believed([answer for outcome in outcomes for answer in outcome.solved])
    seconds = np.reshape([answer.seconds for answer in solved], (len(outcomes), count))
    return Times(seconds, np.array([outcome.pace for outcome in outcomes]))
