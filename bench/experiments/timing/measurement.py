"""The timing: every case in one process that does nothing else."""

import functools
import secrets
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.isolation import WorkerProcess
from ...harness.record import Key
from ...harness.stopwatch import Budget
from .case import TIMING, Case
from .cases import cases
from .job import TimingJob

# So long [s] a case may take.
PATIENCE = 1800.0


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time [s] that it is measured for.

    Cases that are compared are measured together, by the first of their blocks to be measured.
    """
    run = secrets.token_hex(8)
    for case in cases():
        measure = partial(timed, run, case, scale.seconds)
        name, settings = case.work.problem, case.settings
        block = Block(TIMING, name, case.solver, measure, settings, scale.seconds, case.facts)
        yield replace(block, budget=block.size)


# What was found for cases that were measured together with another, by the run and the case; it is
# handed out for so long [s].
_found: dict[tuple[str, Key], tuple[Measured | str, Budget]] = {}
FRESH = 3600.0


def timed(run: str, case: Case, seconds: float) -> Measured:
    """Time a case for about so long, alternating with those that it is compared with.

    Keep the seconds of one operation, (sweep, round), the bytes that it moves, by how much a fixed
    loop varied meanwhile, and a word that those measured together have in common. What is found
    for the others is handed out when they are asked for in the same run.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    for key in [key for key, (_, fresh) in _found.items() if key[0] != run or fresh.is_spent]:
        del _found[key]
    if (run, case.key) not in _found:
        together = _together(case, seconds).items()
        _found.update({(run, key): (found, Budget(FRESH)) for key, found in together})
    found, _ = _found.pop((run, case.key))
    if isinstance(found, str):
        raise RuntimeError(found)
    return found


def _together(case: Case, seconds: float) -> dict[Key, Measured | str]:
    """Return what is found for all cases of a group, or why nothing is."""
    group = [c for c in cases() if (c.work.subject, c.work.group) == case.work[1:3]]
    found = worker_process().find(TimingJob(tuple(c.key for c in group), seconds))
    facts = {"noise": metrics.relative_spread(np.array(found["paces"])),
             "together": secrets.token_hex(4)}  # fmt: skip
    return {
        one.key: trouble or _measured(one, np.array(rounds), facts)
        for one, rounds, trouble in zip(group, found["rounds"], found["troubles"], strict=True)
    }


def _measured(case: Case, rounds: np.ndarray, facts: dict[str, Any]) -> Measured:
    arrays = {"seconds": rounds / case.operations, "moved": np.array(case.moved / case.operations)}
    return Measured(arrays, facts=facts)


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which all cases are timed."""
    return WorkerProcess(PATIENCE)
