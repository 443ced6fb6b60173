"""EAIK: all solutions at once by subproblems, for arms with suitable axes.

Some of its solutions are least-squares answers to insoluble targets, marked `is_LS`; they are left
out, and so are solutions beyond the limits, after whole revolutions are tried. It needs no start.
Its time is that of `calculate_IK`: the choice among all solutions is its user's.
"""

from time import perf_counter

import numpy as np
from eaik.pybindings import EAIK

from ...problems.robots import LIMIT_TOLERANCE, UnableError, links
from ..protocol import OwnTime
from .protocol import Ask, BenchRobot, FloatArray, PoseRequest, Solve, SolverOutput, Tolerance

REVOLUTION = 2.0 * np.pi
MAXIMUM_HINGES = 6


def prepare(robot: BenchRobot, tolerance: Tolerance) -> Ask:
    """Return the solver, set up for a robot; it takes no tolerance.

    Raises:
        UnableError: if it knows no decomposition of this robot.
    """
    robot.require_chain()
    axes, offsets, rotation = axes_at_zero(robot)
    if len(axes) > MAXIMUM_HINGES:
        raise UnableError(f"takes {MAXIMUM_HINGES} hinges at the most")
    engine = EAIK.Robot(axes.T, offsets.T, rotation, [], True)
    if not engine.has_known_decomposition():
        raise UnableError("knows no decomposition of this arm")

    def ask(request: PoseRequest) -> Solve:
        target = request.matrix

        def solve() -> SolverOutput:
            begin = perf_counter()
            solutions = engine.calculate_IK(target)
            time = OwnTime(perf_counter() - begin)
            for q, is_approximate in zip(solutions.Q, solutions.is_LS, strict=True):
                q = within(robot, np.asarray(q))
                if not is_approximate and ((q >= robot.lower) & (q <= robot.upper)).all():
                    return SolverOutput(q, True, time)
            return SolverOutput(None, False, time)

        return solve

    return ask


def within(robot: BenchRobot, q: FloatArray) -> FloatArray:
    """Return angles brought within the limits by whole revolutions where that can be done."""
    q = q + REVOLUTION * np.ceil((robot.lower - LIMIT_TOLERANCE - q) / REVOLUTION).clip(0.0)
    q = q - REVOLUTION * np.ceil((q - robot.upper - LIMIT_TOLERANCE) / REVOLUTION).clip(0.0)
    nearest = np.clip(q, robot.lower, robot.upper)
    return np.where(np.abs(q - nearest) <= LIMIT_TOLERANCE, nearest, q)


def axes_at_zero(robot: BenchRobot) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axes (joint, 3), offsets between them (joint + 1, 3), and the effector's rotation.

    All are in the frame of the root, with every joint at zero.
    """
    T, axes, places = np.eye(4), [], [np.zeros(3)]
    for transform, axis in links(robot):
        T = T @ transform
        if axis is not None:
            axes.append(T[:3, :3] @ axis)
            places.append(T[:3, 3])
    places.append(T[:3, 3])
    return np.array(axes), np.diff(places, axis=0), T[:3, :3]
