"""The timing: all cases that are compared, in turns, in one process that does nothing else."""

import functools
import math
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from ...harness.record import Key
from ...harness.worker import describe
from . import cloth, ik, kinematics
from .case import TIMING, Case
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


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time [s] that it is measured for."""
    run = secrets.token_hex(8)
    for case in cases():
        measure = partial(timed, run, case, scale.seconds)
        name, settings = case.work.problem, case.settings
        yield Block(TIMING, name, case.solver, measure, settings, scale.seconds, case.facts)


def timed(run: str, case: Case, seconds: float) -> Measured:
    """Return what is measured of a case, together with all that it is compared with.

    The seconds of one operation, (sweep, round), the bytes that it moves, by how much a fixed loop
    varied meanwhile, and a word that those measured together in a run have in common.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    result = _together(run, case.work.subject, case.work.group, seconds)[case.key]
    if isinstance(result, str):
        raise RuntimeError(result)
    return result


@functools.lru_cache(maxsize=1)  # blocks that are compared follow one another
def _together(run: str, subject: str, group: str, seconds: float) -> dict[Key, Measured | str]:
    """Return what is measured of each case of a group, or what it raised."""
    compared = [c for c in cases() if (c.work.subject, c.work.group) == (subject, group)]
    keys = tuple(case.key for case in compared)
    results = in_a_fresh_process(PATIENCE, sweep, keys, seconds)
    noise, word = metrics.relative_spread(np.array(results["paces"])), secrets.token_hex(4)
    return {
        case.key: trouble or _measured(case, rounds, {"noise": noise, "together": word})
        for case, rounds, trouble in zip(
            compared, results["rounds"], results["troubles"], strict=True
        )
    }


def _measured(case: Case, rounds: Sequence[Sequence[float]], facts: Mapping[str, Any]) -> Measured:
    seconds, moved = np.array(rounds) / case.operations, case.moved / case.operations
    return Measured(Timed(seconds, moved), facts=facts)


def sweep(keys: Sequence[Key], seconds: float) -> dict[str, Any]:
    """Time the cases of these keys for so long each, sweep after sweep.

    Return the rounds of each [s], (sweep, round), what it raised first, and how long a fixed loop
    took beside each measurement.
    """
    known = {case.key: case for case in cases()}
    rounds = [Rounds(known[key], seconds) for key in keys]
    lot, paces = np.random.default_rng(len(rounds)), []
    for i in range(SWEEPS):
        announce(f"{known[keys[0]].work.group}, sweep {i + 1} of {SWEEPS}")
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
