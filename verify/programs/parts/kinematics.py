"""Poses of skeletons."""

import numpy as np

from .rotations import conjugate, multiply, rotate


def kinematics(parents, offsets, q):
    x, R = offsets.copy(), q.copy()
    for j in range(1, len(parents)):
        p = parents[j]
        R[j] = multiply(R[p], q[j])
        x[j] = x[p] + rotate(R[p], offsets[j])
    return x, R


def between(a, b):
    """Return the smallest rotation from the direction of a to that of b."""
    a, b = np.linalg.norm(b) * a, np.linalg.norm(a) * b
    d = np.array([np.linalg.norm(a) * np.linalg.norm(b) + a @ b, *np.cross(a, b)])
    length = np.linalg.norm(d)
    if length <= 1e-14 * (1.0 + a @ a):  # opposite, or of length zero
        return np.array([1.0, 0.0, 0.0, 0.0])
    return d / length


def path_to(parents, effector):
    """Return the joints from the effector to the root."""
    path = [effector]
    while parents[path[-1]] >= 0:
        path.append(parents[path[-1]])
    return path


def bend(parents, offsets, q, target, effector):
    """Bend a chain a little if it is straight and points at its target or away from it."""
    x, _ = kinematics(parents, offsets, q)
    path = path_to(parents, effector)
    to = target - x[path[-1]]
    if not to.any():
        to = x[effector] - x[path[-1]]
    reach = np.linalg.norm(offsets[path[:-1]], axis=1).sum()
    if np.linalg.norm(to) >= reach or not to.any():
        return
    to = to / np.linalg.norm(to)
    if np.linalg.norm(np.cross(to, x[path] - x[path[-1]]), axis=1).max() > 1e-9 * reach:
        return
    axis = np.cross(to, np.eye(3)[np.argmin(np.abs(to))])
    d = np.array([np.cos(0.1), *(np.sin(0.1) * axis / np.linalg.norm(axis))])
    for joint in path[1:]:
        _, R = kinematics(parents, offsets, q)
        q[joint] = turned(parents, R, joint, d, q[joint])


def turned(parents, R, joint, d, q):
    """Return the local rotation q of a joint after the world rotation d."""
    if parents[joint] >= 0:
        P = R[parents[joint]]
        d = multiply(multiply(conjugate(P), d), P)
    q = multiply(d, q)
    return q / np.linalg.norm(q)
