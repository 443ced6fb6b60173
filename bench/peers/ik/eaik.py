"""EAIK: all solutions at once by subproblems, for arms with suitable axes.

Some of its solutions are least-squares answers to insoluble targets, marked `is_LS`; they are left
out, and so are solutions beyond the limits, after whole revolutions are tried. It needs no start.
Its time is that of `calculate_IK`: the choice among all solutions is its user's.
"""

from functools import partial
from typing import Any

import numpy as np
from eaik.pybindings import EAIK

from ...problems.robots import UnableError, links
from .protocol import Ask, BenchRobot, FloatArray, PoseRequest, Solve, Tolerance
from .solutions import first_within

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

    def read(solutions: Any) -> tuple[FloatArray | None, bool]:
        return first_within(robot, solutions.Q[~np.array(solutions.is_LS, dtype=bool)])

    def ask(request: PoseRequest) -> Solve:
        return Solve(partial(engine.calculate_IK, request.matrix), read)

    return ask


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
