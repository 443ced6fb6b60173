"""The timing: every case in one process that does nothing else."""

import functools
from collections.abc import Iterator
from functools import partial

import numpy as np

from ...harness.block import Block, Measured, Scale
from ...harness.isolation import WorkerProcess
from .case import TIMING, Case
from .cases import cases
from .job import TimingJob

# So long [s] a case may take.
PATIENCE = 1800.0


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time [s] that it is measured for."""
    for case in cases():
        measure = partial(timed, case, scale.seconds)
        name, settings = case.work.problem, case.settings
        yield Block(TIMING, name, case.solver, measure, settings, scale.seconds, case.facts)


def timed(case: Case, seconds: float) -> Measured:
    """Time a case for about so long; keep the seconds of one operation, and the bytes it moves.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    found = worker_process().find(TimingJob(case.key, seconds))
    rounds = np.array(found["seconds"]) / case.operations
    return Measured({"seconds": rounds, "moved": np.array(case.moved / case.operations)})


@functools.cache
def worker_process() -> WorkerProcess:
    """Return the one process in which all cases are timed."""
    return WorkerProcess(PATIENCE)
