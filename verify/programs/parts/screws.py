"""Jacobians by screws."""

import numpy as np


def matrix(quaternion):
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def hat(w):
    x, y, z = w
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def pose(R, p):
    return np.vstack([np.column_stack([R, p]), [0, 0, 0, 1]])


def inverse(T):
    R, p = T[:3, :3], T[:3, 3]
    return pose(R.T, -R.T @ p)


def adjoint(T):
    """Return the matrix that takes twists, their angular parts first, to another frame."""
    R, p = T[:3, :3], T[:3, 3]
    A = np.zeros((6, 6))
    A[:3, :3] = R
    A[3:, :3] = hat(p) @ R
    A[3:, 3:] = R
    return A


def terms(first, second, K):
    return first * K + second * K @ K


def exponential(screw, angle):
    w, v = screw[:3], screw[3:]
    if not w.any():
        return pose(np.eye(3), angle * v)
    K, s, c = hat(w), np.sin(angle), np.cos(angle)
    R = np.eye(3) + terms(s, 1 - c, K)
    G = angle * np.eye(3) + terms(1 - c, angle - s, K)
    return pose(R, G @ v)


def screws_of(parents, origins, orientations, axes, slides, effector, tool_position,
              tool_rotation, **robot):
    """Return the joints from the base to the tool, their screws at q = 0, and the tool's pose."""
    path, j = [], effector
    while j >= 0:
        path.insert(0, j)
        j = parents[j]
    R, p, screws = np.eye(3), np.zeros(3), np.zeros((len(axes), 6))
    for j in path:
        R_parent, p_parent = R, p
        R = R_parent @ matrix(orientations[j])
        p = p_parent + R_parent @ origins[j]
        w = R @ axes[j]
        angular = np.zeros(3) if slides[j] else w
        linear = w if slides[j] else -np.cross(w, p)
        screws[j] = [*angular, *linear]
    R_tool = R @ matrix(tool_rotation)
    p_tool = p + R @ tool_position
    return path, screws, pose(R_tool, p_tool)


def spatial_jacobian(q, path, screws):
    """Return the spatial Jacobian, angular part first, and the product of the exponentials."""
    J, T = np.zeros((6, len(q))), np.eye(4)
    for j in path:
        J[:, j] = adjoint(T) @ screws[j]
        T = T @ exponential(screws[j], q[j])
    return J, T
