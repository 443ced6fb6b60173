"""The kinematics of a tool, by quaternions."""

import numpy as np

from .rotations import conjugate, multiply, rotate


def kinematics(robot, q):
    """Return the positions and axes of all joints, and the position and rotation of the tool."""
    parents, slides = robot["parents"], robot["slides"]
    x, axes, R = np.zeros((len(q), 3)), np.zeros((len(q), 3)), np.zeros((len(q), 4))
    for j in range(len(q)):
        p = parents[j]
        base = (x[p], R[p]) if p >= 0 else (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        x[j] = base[0] + rotate(base[1], robot["origins"][j])
        R[j] = multiply(base[1], robot["orientations"][j])
        axis = robot["axes"][j]
        axes[j] = rotate(R[j], axis)
        if slides[j]:
            x[j] = x[j] + q[j] * axes[j]
        else:
            R[j] = multiply(R[j], np.array([np.cos(q[j] / 2), *(np.sin(q[j] / 2) * axis)]))
    j = robot["effector"]
    position = x[j] + rotate(R[j], robot["tool_position"])
    return x, axes, position, multiply(R[j], robot["tool_rotation"])


def error_of(tool, target_position, target_rotation):
    """Return the displacement to the target [m] and the rotation vector to it [rad]."""
    position, rotation = tool
    d = multiply(target_rotation, conjugate(rotation))
    d = d if d[0] >= 0.0 else -d
    sine = np.linalg.norm(d[1:])
    vector = 2.0 * np.arctan2(sine, d[0]) / sine * d[1:] if sine > 0.0 else 2.0 * d[1:]
    return np.concatenate([target_position - position, vector])


def jacobian(robot, x, axes, position):
    """Return the velocities of the tool, linear and angular, by joint (6, joint)."""
    J, j = np.zeros((6, len(x))), robot["effector"]
    while j >= 0:
        if robot["slides"][j]:
            J[:3, j] = axes[j]
        else:
            J[:, j] = [*np.cross(axes[j], position - x[j]), *axes[j]]
        j = robot["parents"][j]
    return J
