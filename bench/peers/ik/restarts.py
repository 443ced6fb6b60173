"""Restarts for solvers that make one attempt: again from random poses until one is claimed."""

import numpy as np

from reference.arguments import FloatArray

from ...experiments.robots.problem import Robot
from .protocol import Ask, Solve, SolverOutput

_SEED = 1986


def restarted(ask: Ask, robot: Robot, restarts: int) -> Ask:
    """Return a solver that makes up to `restarts` further attempts from seeded random poses.

    An attempt counts only if its answer keeps the limits: not all solvers look at them.
    """
    rng = np.random.default_rng(_SEED)

    def keeps_limits(q: FloatArray) -> bool:
        return bool((q >= robot.lower).all() and (q <= robot.upper).all())

    def again(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        def solve() -> SolverOutput:
            answer = ask(positions, rotations, start)()
            for _ in range(restarts):
                if answer.claimed and answer.q is not None and keeps_limits(answer.q):
                    return answer
                answer = ask(positions, rotations, robot.draw(rng, 1)[0])()
            good = answer.claimed and answer.q is not None and keeps_limits(answer.q)
            return SolverOutput(answer.q, good if answer.claimed is not None else None)

        return solve

    return again
