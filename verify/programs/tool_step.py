"""The equation of a step to a tool's target, J dq = e, by quaternions."""

from .parts.tool import error_of, jacobian, kinematics


def tool_step(q, target_position, target_rotation, **robot):
    x, axes, position, rotation = kinematics(robot, q)
    e = error_of((position, rotation), target_position, target_rotation)
    J = jacobian(robot, x, axes, position)
    return J, e
