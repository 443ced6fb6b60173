"""Restarts for solvers without restarts: from random poses until the solver claims success."""

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from ..protocol import total
from .protocol import Ask, BenchRobot, PoseRequest, SolverOutput, attempt

_SEED = 1986


def restarted(ask: Ask, robot: BenchRobot, restarts: int) -> Ask:
    """Return a solver with up to `restarts` further attempts from seeded random poses.

    An attempt succeeds by claiming an answer within the limits, which some solvers ignore; an
    exception is a failure. The poses depend on the target only, and all attempts are prepared
    before the clock runs.
    """

    def is_success(output: SolverOutput) -> bool:
        if not output.claim or output.q is None:
            return False
        q = np.asarray(output.q)
        return bool((q >= robot.lower).all() and (q <= robot.upper).all())

    def ask_again(request: PoseRequest) -> Callable[[], SolverOutput]:
        poses = robot.draw(generator_of(*request), restarts)
        attempts = [ask(request._replace(start=q.copy())) for q in (request.start, *poses)]

        def solve() -> SolverOutput:
            outputs: list[SolverOutput] = []
            for solve_once in attempts:
                outputs.append(attempt(solve_once))
                if is_success(outputs[-1]):
                    break
            answers = [output for output in outputs if output.q is not None]
            last = answers[-1] if answers else outputs[-1]
            claim = None if last.claim is None else is_success(last)
            error = next((output.error for output in outputs if output.error), "")
            return SolverOutput(last.q, claim, total(output.time for output in outputs), error)

        return solve

    return ask_again


def generator_of(*target: Any) -> np.random.Generator:
    """Return a target's own generator, always with the same seed."""
    return np.random.default_rng([_SEED, digest_of(*target)])


def digest_of(*target: Any) -> int:
    """Return an unsigned number of 32 bits from all parts of a target."""
    digest = 0
    for part in target:
        digest = zlib.crc32(np.ascontiguousarray(part).tobytes(), digest)
    return digest
