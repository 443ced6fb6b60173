"""The Jacobian of a tool."""

import numpy as np


def matrix(quaternion):
    w, x, y, z = quaternion
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K


def rotation(axis, angle):
    """Return a rotation matrix by Rodrigues' formula."""
    x, y, z = axis
    c, s = np.cos(angle), np.sin(angle)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return c * np.eye(3) + s * K + (1.0 - c) * np.outer(axis, axis)


def tool_jacobian(q, slides, effector, parents, **robot):
    """Return the tool's Jacobian in the world, (6, joint), its position and its rotation matrix."""
    x, R, axes = np.zeros((len(q), 3)), np.zeros((len(q), 3, 3)), np.zeros((len(q), 3))
    for j in range(len(q)):
        p = parents[j]
        x_parent, R_parent = (x[p], R[p]) if p >= 0 else (np.zeros(3), np.eye(3))
        frame = matrix(robot["orientations"][j])
        axis, origin = robot["axes"][j], robot["origins"][j]
        R_joint = np.eye(3) if slides[j] else rotation(axis, q[j])
        R[j] = R_parent @ frame @ R_joint
        axes[j] = R_parent @ frame @ axis
        x[j] = x_parent + R_parent @ origin
        if slides[j]:
            x[j] = x[j] + q[j] * (R_parent @ frame @ axis)
    tool = x[effector] + R[effector] @ robot["tool_position"]
    tool_rotation = R[effector] @ matrix(robot["tool_rotation"])
    J, j = np.zeros((6, len(q))), effector
    while j >= 0:
        if slides[j]:
            J[:3, j] = axes[j]
        else:
            J[:3, j] = np.cross(axes[j], tool - x[j])
            J[3:, j] = axes[j]
        j = parents[j]
    return J, tool, tool_rotation
