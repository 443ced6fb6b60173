"""The choice among all solutions of a target, which some analytic solvers leave to their user."""

import numpy as np

from ...problems.robots import LIMIT_TOLERANCE
from .protocol import BenchRobot, FloatArray

REVOLUTION = 2.0 * np.pi


def first_within(robot: BenchRobot, solutions: FloatArray) -> tuple[FloatArray | None, bool]:
    """Return the first solution, (solution, joint), within the limits, and whether there is one."""
    angles = within(robot, solutions)
    is_valid = ((angles >= robot.lower) & (angles <= robot.upper)).all(axis=-1)
    if not is_valid.any():
        return None, False
    return angles[is_valid.argmax()], True


def within(robot: BenchRobot, q: FloatArray) -> FloatArray:
    """Return angles brought within the limits by whole revolutions where that can be done."""
    q = q + REVOLUTION * np.ceil((robot.lower - LIMIT_TOLERANCE - q) / REVOLUTION).clip(0.0)
    q = q - REVOLUTION * np.ceil((q - robot.upper - LIMIT_TOLERANCE) / REVOLUTION).clip(0.0)
    nearest = np.clip(q, robot.lower, robot.upper)
    return np.where(np.abs(q - nearest) <= LIMIT_TOLERANCE, nearest, q)
