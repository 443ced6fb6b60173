"""Targets for a solver with its settings, solved in order in a worker's process."""

import contextlib
import ctypes
import functools
import importlib
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..peers.ik.overhead import overhead
from ..peers.ik.protocol import SolverOutput, attempt
from ..peers.ik.restarts import digest_of, restarted
from ..peers.protocol import NoAnswerError, OwnTime, describe, remark_of
from ..peers.stopwatch import time_call
from ..problems.robots import UnableError
from .isolation import JobOutcome, WorkerProcess, raised
from .machine import pace
from .progress import TROUBLE, Progress
from .record import FIRST_TARGETS
from .worker import Finished, Lap, Message, Ready, Solved

# Times of slow solves are sent whenever their sum exceeds this [s], lest a worker seem silent.
_LAP_SECONDS = 0.5
# A user's solver may take so long for a target, on average, and at least so long in all [s].
_TARGET_SECONDS, _LEAST_SECONDS = 0.2, 10.0
# A solver that hangs on this many targets does not finish.
MAXIMUM_SILENCES = 3


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
    entrant: str = ""  # the name of a user's solver, to announce its first trouble; else ""
    warms_up: bool = True  # whether the first target is solved once before, uncounted

    @property
    def budget(self) -> float:
        """The time after which a user's solver begins no further target [s]."""
        seconds = max(_LEAST_SECONDS, _TARGET_SECONDS * self.targets.shape[0])
        return seconds if self.entrant else math.inf

    def perform(self) -> Iterator[Message]:
        """Yield the messages of the job, each as soon as available."""
        try:
            adapter = importlib.import_module(self.module)
            ask, setup = time_call(self.prepared)
            first = self._solved(ask(self.targets.request(0))) if self.warms_up else None
            if self.restarts and first is not None and first.claim < 0:
                raise UnableError("not started again, for it claims nothing of its answers")
        except Exception as error:  # an exception of an engine is its result
            yield from unfit(error, self.entrant)
        else:
            yield Ready(setup, remark_of(adapter), self._overhead(adapter))
            yield from announced(self._answers(ask), self.entrant)
            yield Finished()

    def prepared(self) -> Any:
        """Return the function of the adapter that takes requests."""
        ask = self._prepare()
        return restarted(ask, self.model, self.restarts) if self.restarts else ask

    def _prepare(self) -> Any:
        adapter = importlib.import_module(self.module)
        return adapter.prepare(self.model, self.tolerance, **self.settings)

    def _overhead(self, adapter: Any) -> float:
        """Return the part of a solve's time outside the solver [s], NaN of users' solvers."""
        if self.entrant or not self.warms_up:
            return math.nan
        return overhead(adapter, self._prepare, self.targets.request(0))

    def _answers(self, ask: Any) -> Iterator[Solved]:
        """Solve the targets in order, until the budget is spent."""
        spent = 0.0
        for i in range(self.targets.shape[0]):
            request = self.targets.request(i)
            solve = ask(request)
            seed_shared_generators(digest_of(*request))
            answer = self._solved(solve)
            yield answer
            spent += answer.seconds
            if spent > self.budget:
                break

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

    def times(self, ask: Any, count: int) -> Iterator[OwnTime]:
        """Yield the times of the first targets, all converted before the first is solved.

        The first is solved once before: caches are then as in a loop of solves.
        """
        requests = [self.targets.request(i) for i in range(count)]
        solves = [(digest_of(*request), ask(request)) for request in requests]
        for number, (digest, solve) in enumerate([solves[0], *solves]):
            seed_shared_generators(digest)
            output, seconds = time_call(partial(attempt, solve))
            if number:
                yield output.time or OwnTime(seconds)


def first_targets(job: Job, outcome: JobOutcome) -> dict[str, Any]:
    """Return as a fact how many targets a slow solver was given, nothing if all."""
    count = len(outcome.solved)
    is_cut = 0 < count < job.targets.shape[0] and job.budget < math.inf and not outcome.is_lost
    return {FIRST_TARGETS: count} if is_cut else {}


def answers(job: Job) -> JobOutcome:
    """Return the answers of a job; after the loss of a process, continue in a new process.

    Skip the target at a loss. A solver that hangs on `MAXIMUM_SILENCES` targets does not finish.
    """
    count, size = job.targets.shape
    outcome = last = worker_process().perform(job)
    solved, silences = [*outcome.solved], 0
    while last.is_lost and len(solved) < count and silences < MAXIMUM_SILENCES:
        silences += last.is_silent
        solved.append(Solved(np.full(size, np.nan), 0, 0.0, last.trouble))
        if len(solved) < count and silences < MAXIMUM_SILENCES:
            last = worker_process().perform(job._replace(targets=job.targets.after(len(solved))))
            solved += last.solved
    if not outcome.is_lost:
        return outcome
    is_lost = last.is_lost and len(solved) < count
    return outcome._replace(solved=solved, trouble=raised(solved), is_lost=is_lost)


class TimedTurns(NamedTuple):
    """Solvers of the same targets, timed in turns, round after round."""

    jobs: tuple[Job, ...]  # the solvers
    target_count: int  # the first targets are timed, so many
    rounds: int

    def perform(self) -> Iterator[Message]:
        """Yield the times of each solver in each round; the order of a round is drawn."""
        yield Ready(0.0)
        asks, generator = {}, np.random.default_rng(len(self.jobs))
        for number, job in enumerate(self.jobs):
            yield Lap(number)
            with contextlib.suppress(Exception):  # it has said so when it was asked for answers
                asks[number] = job.prepared()
        for _ in range(self.rounds):
            for number in generator.permutation(list(asks)).tolist():
                yield Lap(number, control=pace())
                yield from self._laps(number, asks[number])
        yield Finished()

    def _laps(self, number: int, ask: Any) -> Iterator[Lap]:
        times: list[OwnTime] = []
        for time in self.jobs[number].times(ask, self.target_count):
            times.append(time)
            if sum(max(t.seconds, t.round_trip) for t in times) > _LAP_SECONDS:
                yield Lap(number, tuple(times))
                times = []
        yield Lap(number, tuple(times))


class Times(NamedTuple):
    """The times of a solver's targets, and of a fixed loop before each round [s]."""

    seconds: np.ndarray  # (round, target)
    control: np.ndarray  # (round,)


def times_in_turns(jobs: Sequence[Job], count: int, rounds: int) -> list[Times | None]:
    """Return the times of solvers taking turns; None of solvers lost or not started."""
    remaining = list(range(len(jobs)))
    while remaining:
        turns = TimedTurns(tuple(jobs[i] for i in remaining), count, rounds)
        outcome = worker_process().perform(turns)
        if not (outcome.is_lost and outcome.laps):
            break
        del remaining[outcome.laps[-1].number]
    times: list[Times | None] = [None] * len(jobs)
    for number, i in enumerate(remaining):
        laps = [lap for lap in outcome.laps if lap.number == number]
        own = [time for lap in laps for time in lap.times]
        if len(own) == rounds * count:
            doubted = any(time.doubt for time in own)  # then all times are round trips
            seconds = [max(t.seconds, t.round_trip * doubted) for t in own]
            control = np.array([lap.control for lap in laps if lap.control])
            times[i] = Times(np.reshape(seconds, (rounds, count)), control)
    return times


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

    Without the seed, an answer would depend on earlier solves.
    """
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 (the shared generator)
    with contextlib.suppress(AttributeError, OSError, TypeError):  # without a C library
        ctypes.CDLL(None).srand(seed)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the process in which all solvers of targets work in turn."""
    return WorkerProcess()
