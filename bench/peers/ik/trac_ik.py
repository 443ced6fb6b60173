"""TRAC-IK by pytracik: two searches at once, in two threads, restarted until time is up.

One is Newton's with random jumps, the other sequential quadratic programming. It stops when the six
components of the error are within eps. Its limits are single precision. The evaluation's tolerance
is on two norms of three components each, so eps is that over the square root of three.
"""

import math

import numpy as np
import pytracik

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.evaluate import Tolerance
from ...experiments.robots.problem import Robot
from .protocol import Ask, Solve, SolverOutput, needs_a_chain


def prepare(robot: Robot, tolerance: Tolerance, seconds: float = 0.005) -> Ask:
    """Return the solver, set up for a robot, with so much time for each target [s]."""
    needs_a_chain(robot)
    eps = min(tolerance) / math.sqrt(3.0)
    engine = pytracik.TRAC_IK(
        robot.root, robot.effectors[0], robot.text, seconds, eps, pytracik.SolveType.Speed
    )

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target = (*positions[0], *quaternion_with_w_last(rotations[0]))

        def solve() -> SolverOutput:
            found = pytracik.ik(engine, start, *target)
            return (
                SolverOutput(found[1:], bool(found[0] >= 0))
                if found[0] >= 0
                else SolverOutput(None, False)
            )

        return solve

    return ask


def quaternion_with_w_last(R: FloatArray) -> FloatArray:
    """Return x, y, z, w of a rotation, by the largest of four sums (Shepperd 1978)."""
    trace = np.trace(R)
    K = np.empty((4, 4))
    K[:3, :3] = R + R.T + (1.0 - trace) * np.eye(3)
    K[:3, 3] = K[3, :3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    K[3, 3] = 1.0 + trace
    row = K[np.argmax(np.diag(K))]
    return row / np.linalg.norm(row)
