"""TRAC-IK by pytracik: two searches at once, in two threads, restarted until time is up.

The first is Newton's with random jumps, the second sequential quadratic programming. TRAC-IK stops
when the six components of the error are within eps. Its limits are single precision. The
evaluation's tolerance is on two norms of three components each, so eps is the tolerance over the
square root of three.
"""

import math
from collections.abc import Sequence
from functools import partial

from ..peer import RESTARTS, Peer, Run
from ..protocol import BenchRobot, PoseRequest, Solve, SolveFactory, Tolerance

PEER = Peer(
    "TRAC-IK",
    __name__,
    "pytracik",
    "MIT",
    "Newton's method and SQP in two threads, restarted",
    "poses and limits of one chain of hinges",
    (
        # The time in its authors' comparison, and ten times as long.
        Run(RESTARTS, {"seconds": 0.005, "kind": "Speed"}, "5 ms"),
        Run(RESTARTS, {"seconds": 0.05, "kind": "Speed"}, "50 ms"),
    ),
    use="a fixed time, C++ or ROS",
)


def prepare(
    robot: BenchRobot, tolerance: Tolerance, seconds: float = 0.005, kind: str = "Speed"
) -> SolveFactory:
    """Return the solver, set up for a robot, with so much time for each target [s]."""
    import pytracik

    robot.require_chain()
    eps, solve_type = min(tolerance) / math.sqrt(3.0), getattr(pytracik.SolveType, kind)
    chain = (robot.root, robot.effectors[0], robot.text)
    engine = pytracik.TRAC_IK(*chain, seconds, eps, solve_type)

    def make_solve(request: PoseRequest) -> Solve:
        target = (*request.positions[0], *request.quaternion)
        return Solve(partial(pytracik.ik, engine, request.start, *target), _read)

    return make_solve


def _read(answer: Sequence[float]) -> tuple[Sequence[float] | None, bool]:
    code, *q = answer
    return (q, True) if code >= 0 else (None, False)
