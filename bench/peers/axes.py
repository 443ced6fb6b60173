"""A chain's axes, and the choice among all solutions, for solvers that read no robot files."""

import numpy as np

from ..problems.robots import LIMIT_TOLERANCE, links
from .protocol import BenchRobot, FloatArray

REVOLUTION = 2.0 * np.pi  # [rad]


def first_within(robot: BenchRobot, solutions: FloatArray) -> tuple[FloatArray | None, bool]:
    """Return the first solution, (solution, joint), within the limits, and whether there is any."""
    valid = all_within(robot, solutions)
    return (valid[0], True) if len(valid) else (None, False)


def all_within(robot: BenchRobot, solutions: FloatArray) -> FloatArray:
    """Return the solutions, (solution, joint), within the limits.

    Whole revolutions bring angles above their lower limits.
    """
    lowest, highest = robot.lower - LIMIT_TOLERANCE, robot.upper + LIMIT_TOLERANCE
    angles = solutions - REVOLUTION * np.floor((solutions - lowest) / REVOLUTION)
    is_valid = (angles <= highest).all(axis=-1)
    return np.clip(angles[is_valid], robot.lower, robot.upper)


def axes_at_zero(robot: BenchRobot) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return axes (joint, 3), offsets between axes (joint + 1, 3), and the effector's rotation.

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
