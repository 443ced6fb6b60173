"""EAIK: all solutions at once by subproblems, for arms with suitable axes.

Some of its solutions are least-squares answers to insoluble targets, marked `is_LS`, and are left
out. So are solutions beyond the limits, after whole revolutions are tried. EAIK needs no start. Its
time is the time of `calculate_IK`: the choice among all solutions is its user's.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...problems.robots import UnableError
from ..axes import axes_at_zero, first_within
from ..peer import RESTARTS, Peer, Run
from ..protocol import BenchRobot, FloatArray, PoseRequest, Solve, SolveFactory, Tolerance

PEER = Peer(
    "EAIK",
    __name__,
    "eaik",
    "BSD-3-Clause",
    "closed forms by subproblem decomposition",
    "poses of six hinges or fewer, analytically; timed without the choice of a solution",
    (Run(RESTARTS, note="all solutions, no start"),),
    use="all solutions of six hinges",
)

MAXIMUM_HINGES = 6  # of its closed forms


def prepare(robot: BenchRobot, tolerance: Tolerance) -> SolveFactory:
    """Return the solver, set up for a robot; there is no tolerance.

    Raises:
        UnableError: if EAIK knows no decomposition of this robot.
    """
    return _solve_factory(robot, lambda solutions: first_within(robot, solutions))


def prepare_all(robot: BenchRobot) -> SolveFactory:
    """Return the solver of all solutions, set up for a robot; see `prepare`."""
    return _solve_factory(robot, lambda solutions: (solutions, None))


def _solve_factory(robot: BenchRobot, choose: Callable[[FloatArray], Any]) -> SolveFactory:
    engine = _engine_of(robot)

    def read(solutions: Any) -> Any:
        return choose(solutions.Q[~np.array(solutions.is_LS, dtype=bool)])

    def make_solve(request: PoseRequest) -> Solve:
        return Solve(partial(engine.calculate_IK, request.matrix), read)

    return make_solve


def _engine_of(robot: BenchRobot) -> Any:
    from eaik.pybindings import EAIK

    robot.require_chain()
    axes, offsets, rotation = axes_at_zero(robot)
    if len(axes) > MAXIMUM_HINGES:
        raise UnableError(f"takes {MAXIMUM_HINGES} hinges at the most")
    engine = EAIK.Robot(axes.T, offsets.T, rotation, [], True)
    if not engine.has_known_decomposition():
        raise UnableError("knows no decomposition of this arm")
    return engine
