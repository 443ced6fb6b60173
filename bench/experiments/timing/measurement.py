"""The timing: all cases that are compared, in turns, in one process that does nothing else."""

import functools
import math
import secrets
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from timeit import Timer
from typing import Any

import numpy as np

from plumbob.reference import set_backend, set_num_threads

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import in_a_fresh_process
from ...harness.machine import pace
from ...harness.progress import announce
from ...peers.protocol import describe
from . import cloth, ik, kinematics
from .case import Case
from .values import Timed

# So long [s] a case may take.
PATIENCE = 1800.0
# Cases are gone through so often, in an order by lot, so that what a machine drifts meanwhile falls
# on all of them; nine is the least of which a median's interval leaves out the extremes.
SWEEPS = 9
# Rounds of a case, together.
ROUNDS = 200
# A call that takes less [s] is made once more, uncounted, before each of its later sweeps, so that
# caches are as in a loop of such calls.
QUICK = 1e-3


@functools.cache
def cases() -> tuple[Case, ...]:
    """Return the cases of all subjects."""
    return tuple(case for subject in (kinematics, ik, cloth) for case in subject.cases())


def compared(subject: str, group: str) -> list[Case]:
    """Return the cases that are compared: all that work on the same."""
    return [c for c in cases() if (c.work.subject, c.work.group) == (subject, group)]


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time [s] that it is measured for."""
    run = secrets.token_hex(8)
    for case in cases():
        measure = partial(timed, run, case, scale.seconds)
        settings, facts, size = {"operations": case.operations}, case.work.facts, scale.seconds
        name = case.work.problem
        block = Block("timing", name, case.solver, measure, settings, size, facts)
        yield replace(block, budget=size)


def timed(run: str, case: Case, seconds: float) -> Measured:
    """Return what is measured of a case, together with all that it is compared with.

    By how much a fixed loop varied meanwhile and a word that those measured together in a run have
    in common are its facts.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    results = _together(run, case.work.subject, case.work.group, seconds)
    i = compared(case.work.subject, case.work.group).index(case)
    if trouble := results["troubles"][i]:
        raise RuntimeError(trouble)
    rounds = np.array(results["rounds"][i]) / case.operations
    return Measured(Timed(rounds, case.moved / case.operations), facts=results["facts"])


@functools.lru_cache(maxsize=1)  # blocks that are compared follow one another
def _together(run: str, subject: str, group: str, seconds: float) -> dict[str, Any]:
    """Return what is measured of all cases of a group."""
    results = in_a_fresh_process(PATIENCE, sweep, subject, group, seconds)
    noise = metrics.relative_spread(np.array(results["paces"]))
    return {**results, "facts": {"noise": noise, "together": secrets.token_hex(4)}}


def sweep(subject: str, group: str, seconds: float) -> dict[str, Any]:
    """Time the cases of a group for so long each, sweep after sweep.

    Return the rounds of each [s], (sweep, round), what it raised first, and how long a fixed loop
    took beside each measurement.
    """
    rounds = [Rounds(case, seconds) for case in compared(subject, group)]
    lot, paces = np.random.default_rng(len(rounds)), []
    for i in range(SWEEPS):
        announce(f"{group}, sweep {i + 1} of {SWEEPS}")
        for number in lot.permutation(len(rounds)):
            paces.append(pace())
            rounds[number].take()
    return {
        "rounds": [case.seconds for case in rounds],
        "troubles": [case.trouble for case in rounds],
        "paces": paces,
    }


class Rounds:
    """The rounds of one case, whose call is prepared, compiled and counted before the first.

    Attributes:
        seconds: of one call [s], (sweep, round); as many rounds in each sweep.
        trouble: what the case raised first, else "".
    """

    def __init__(self, case: Case, seconds: float) -> None:
        """Take how long all rounds are to take together [s]."""
        self.seconds: list[list[float]] = []
        self.trouble = ""
        self._case, self._budget = case, seconds
        self._call: Callable[[], Any] | None = None

    def take(self) -> None:
        """Make the rounds of a sweep, unless the case raises or raised before."""
        if self.trouble:
            return
        try:
            with set_backend(self._case.backend), set_num_threads(self._case.cores):
                self.seconds.append(self._rounds())
        except Exception as error:
            self.seconds, self.trouble = [], describe(error)

    def _rounds(self) -> list[float]:
        if self._call is None:
            self._call = self._case.prepare()
            self._call()  # may compile
            self._timer = Timer(self._call)
            self._loops, self._count = shape(self._timer, self._budget)
        elif min(self.seconds[0]) < QUICK:
            self._call()
        return [t / self._loops for t in self._timer.repeat(self._count, self._loops)]


def shape(timer: Timer, seconds: float) -> tuple[int, int]:
    """Return how many calls make a round, and how many rounds a sweep, to take so long in all."""
    least = seconds / ROUNDS
    single = timer.timeit(1)
    if single < least:
        single = min(timer.repeat(5, 1))
    loops = max(1, math.ceil(least / single))
    return loops, max(1, int(seconds / SWEEPS / (loops * single)))
