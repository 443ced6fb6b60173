"""TRAC-IK by pytracik: two searches at once, in two threads, restarted until time is up.

One is Newton's with random jumps, the other sequential quadratic programming. It stops when the six
components of the error are within eps. Its limits are single precision. The evaluation's tolerance
is on two norms of three components each, so eps is that over the square root of three.
"""

import math

import pytracik
from scipy.spatial.transform import Rotation

from .protocol import Ask, FloatArray, Robot, Solve, SolverOutput, Tolerance, needs_a_chain


def prepare(robot: Robot, tolerance: Tolerance, seconds: float = 0.005) -> Ask:
    """Return the solver, set up for a robot, with so much time for each target [s]."""
    needs_a_chain(robot)
    eps, speed = min(tolerance) / math.sqrt(3.0), pytracik.SolveType.Speed
    known = (robot.root, robot.effectors[0], robot.text)
    engine = pytracik.TRAC_IK(*known, seconds, eps, speed)

    def ask(positions: FloatArray, rotations: FloatArray, start: FloatArray) -> Solve:
        target = (*positions[0], *Rotation.from_matrix(rotations[0]).as_quat())

        def solve() -> SolverOutput:
            found = pytracik.ik(engine, start, *target)
            return SolverOutput(found[1:], True) if found[0] >= 0 else SolverOutput(None, False)

        return solve

    return ask
