"""Damped least squares."""

import numpy as np

from .parts.kinematics import bend, kinematics, path_to
from .parts.rotations import multiply, rotate

PLUMBOB = {"methods": ["jacobian"]}


def matrix(q):
    return np.array([rotate(q, axis) for axis in np.eye(3)]).T


def exponential(w):
    angle = np.linalg.norm(w)
    return np.array([np.cos(angle / 2), *(0.5 * np.sinc(angle / (2 * np.pi)) * w)])


def nearest_goal(x, path, offsets, target):
    """Return the target, or the nearest point that the chain can reach."""
    lengths = np.linalg.norm(offsets[path[:-1]], axis=1)
    reach, root = lengths.sum(), x[path[-1]]
    distance = np.linalg.norm(target - root)
    nearest = np.clip(distance, max(0.0, 2.0 * lengths.max() - reach), reach)
    return root + (target - root) * (nearest / distance if distance > 0.0 else 0.0)


def inverse_kinematics(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations
):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    path = path_to(parents, effector)
    joints = path[:0:-1]  # the root first
    goal = nearest_goal(x, path, offsets, target)
    reach = np.linalg.norm(offsets[path[:-1]], axis=1).sum()
    error, damping = goal - x[effector], 0.01 * reach**2
    for _ in range(max_iterations):
        if np.linalg.norm(target - x[effector]) <= tolerance:
            break
        columns = []
        for j in joints:
            arm = x[effector] - x[j]
            for axis in matrix(R[j]).T:
                columns.append(np.cross(axis, arm))
        J = np.array(columns).T
        size = np.linalg.norm(error)
        pull = error * min(1.0, 0.5 * reach / size) if size > 0.0 else error
        A = J @ J.T + damping * np.eye(3)
        step = (J.T @ np.linalg.solve(A, pull)).reshape(-1, 3)
        step = step * min(1.0, 1.0 / max(np.linalg.norm(step, axis=1).max(), 1e-300))
        for j, w in zip(joints, step):
            q[j] = multiply(q[j], exponential(w))
            q[j] = q[j] / np.linalg.norm(q[j])
        x, R = kinematics(parents, offsets, q)
        before, error = error, goal - x[effector]
        if np.linalg.norm(error) < np.linalg.norm(before):
            damping = 0.3 * damping
        else:
            damping = 5.0 * damping
    return {"local_rotations": q, "positions": x}
