"""The timing: the cases of a group take turns in a process of their own."""

import functools
import math
import secrets
from collections.abc import Iterator
from functools import partial
from time import perf_counter, process_time
from timeit import Timer
from typing import Any

import numpy as np

from plumbob.reference import set_backend, set_num_threads

from ...clock import pace
from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import in_a_fresh_process
from ...harness.progress import announce
from ...peers.protocol import describe
from . import cloth, ik, kinematics, robots
from .case import TimedCase

# Time limit of a case [s].
PATIENCE = 1800.0
# Sweeps over the cases of a group, in random order: the drift of the machine affects all. Nine is
# the least number with a median's interval inside the extremes.
SWEEPS = 9
# Rounds of a case in all sweeps.
ROUNDS = 200
# A call shorter than this time [s] is repeated once, uncounted, before each of its later sweeps.
# Caches are then as in a loop of calls.
QUICK = 1e-3


@functools.cache
def cases() -> tuple[TimedCase, ...]:
    """Return the cases of all subjects."""
    return tuple(case for subject in (kinematics, robots, ik, cloth) for case in subject.cases())


def compared(subject: str, group: str) -> list[TimedCase]:
    """Return the cases of a group, which are compared."""
    return [c for c in cases() if (c.work.subject, c.work.group) == (subject, group)]


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time for measuring [s]."""
    run = secrets.token_hex(8)
    for case in cases():
        measure = partial(measure_case, run, case, scale.seconds)
        settings, seconds = {"operations": case.operations}, scale.seconds
        yield Block("timing", case.work.problem, case.solver, measure, settings, size=seconds,
                    facts=case.work.facts, budget=seconds)  # fmt: skip


def measure_case(run: str, case: TimedCase, seconds: float) -> Measured:
    """Return the rounds of a case, measured together with its group.

    Its facts are the variation of a fixed loop meanwhile, and a word common to the group.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    group = case.work.subject, case.work.group
    results, i = _measure_group(run, *group, seconds), compared(*group).index(case)
    if trouble := results["troubles"][i]:
        raise RuntimeError(trouble)
    rounds = np.array(results["rounds"][i]) / case.operations
    error = {"error": case.error()} if case.error else {}
    return {"seconds": rounds, "moved": case.moved / case.operations, **error, **results["facts"]}


@functools.lru_cache(maxsize=1)  # the blocks of a group follow one another
def _measure_group(run: str, subject: str, group: str, seconds: float) -> dict[str, Any]:
    results = in_a_fresh_process(PATIENCE, sweep, subject, group, seconds)
    noise = metrics.relative_spread(np.array(results["paces"]))
    return {**results, "facts": {"noise": noise, "together": secrets.token_hex(4)}}


def sweep(subject: str, group: str, seconds: float) -> dict[str, Any]:
    """Time each case of a group for so long [s], sweep after sweep.

    Return the rounds of each case [s], (sweep, round), its first exception, and the time of a fixed
    loop beside each measurement.
    """
    cases = compared(subject, group)
    timers = [_rounds(case, seconds) for case in cases]
    rounds: list[list[list[float]]] = [[] for _ in cases]
    troubles, paces, generator = [""] * len(cases), [], np.random.default_rng(len(cases))
    for i in range(SWEEPS):
        announce(f"{group}, sweep {i + 1} of {SWEEPS}")
        for number in generator.permutation(len(cases)):
            paces.append(pace())
            if troubles[number]:
                continue
            case = cases[number]
            try:
                with set_backend(case.backend), set_num_threads(case.cores):
                    rounds[number].append(next(timers[number]))
            except Exception as error:
                rounds[number], troubles[number] = [], describe(error)
    return {"rounds": rounds, "troubles": troubles, "paces": paces}


def _rounds(case: TimedCase, seconds: float) -> Iterator[list[float]]:
    """Yield the times of a call in the rounds of each sweep [s].

    The call is prepared, compiled and counted before the first.
    """
    call = case.prepare()
    call()  # may compile
    timer = Timer(call, timer=process_time if case.cores == 1 else perf_counter)
    loops, count = shape(timer, seconds)
    first = [t / loops for t in timer.repeat(count, loops)]
    yield first
    while True:
        if min(first) < QUICK:
            call()
        yield [t / loops for t in timer.repeat(count, loops)]


def shape(timer: Timer, seconds: float) -> tuple[int, int]:
    """Return the calls of a round, and the rounds of a sweep, that take so long in total.

    The processor's clock takes longer than a short call, so many calls are timed at once.
    """
    shortest = seconds / ROUNDS
    loops, single = 1, timer.timeit(1)
    for _ in range(2):
        loops = max(1, math.ceil(shortest / single))
        single = min(timer.repeat(5, loops)) / loops if single < shortest else single
    loops = max(1, math.ceil(shortest / single))
    return loops, max(1, int(seconds / SWEEPS / (loops * single)))
