"""A robot in Pinocchio, and its coordinates there: the quaternions of balls end with w."""

import pinocchio

from .protocol import FloatArray, Robot, robot_file


def pinocchio_model(robot: Robot) -> pinocchio.Model:
    """Return the robot in Pinocchio, its joints in the robot's order.

    Raises:
        ValueError: if Pinocchio orders them otherwise.
    """
    if robot.is_chain:
        model = pinocchio.buildModelFromXML(robot.text)
    else:
        with robot_file(robot) as file:
            model = pinocchio.buildModelFromMJCF(file)
    if tuple(model.names)[1:] != robot.joints:
        raise ValueError(f"Pinocchio orders the joints as {', '.join(model.names)}")
    return model


def to_pinocchio(robot: Robot, q: FloatArray) -> FloatArray:
    """Return coordinates with w behind x, y, z."""
    return _permuted(robot, q, [1, 2, 3, 0])


def from_pinocchio(robot: Robot, q: FloatArray) -> FloatArray:
    """Return coordinates with w before x, y, z."""
    return _permuted(robot, q, [3, 0, 1, 2])


def _permuted(robot: Robot, q: FloatArray, order: list[int]) -> FloatArray:
    permuted = q.copy()
    for at in robot.balls:
        permuted[at : at + 4] = q[at : at + 4][order]
    return permuted
