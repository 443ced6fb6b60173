"""A robot in Pinocchio, and its coordinates there: the quaternions of balls end with w."""

import tempfile
from pathlib import Path

import pinocchio

from plumbob.reference.arguments import FloatArray

from ...experiments.robots.problem import Robot


def pinocchio_model(robot: Robot) -> pinocchio.Model:
    """Return the robot in Pinocchio, its joints in the robot's order.

    Raises:
        ValueError: if Pinocchio orders them otherwise.
    """
    model = pinocchio.buildModelFromXML(robot.text) if robot.is_chain else _from_mjcf(robot.text)
    if tuple(model.names)[1:] != robot.joints:
        raise ValueError(f"Pinocchio orders the joints as {', '.join(model.names)}")
    return model


def _from_mjcf(text: str) -> pinocchio.Model:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.xml"
        file.write_text(text, encoding="utf-8")
        return pinocchio.buildModelFromMJCF(str(file))


def to_pinocchio(robot: Robot, q: FloatArray) -> FloatArray:
    """Return coordinates with w behind x, y, z."""
    there = q.copy()
    for at in robot.balls:
        there[at : at + 4] = q[[at + 1, at + 2, at + 3, at]]
    return there


def from_pinocchio(robot: Robot, q: FloatArray) -> FloatArray:
    """Return coordinates with w before x, y, z."""
    here = q.copy()
    for at in robot.balls:
        here[at : at + 4] = q[[at + 3, at, at + 1, at + 2]]
    return here
