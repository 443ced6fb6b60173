"""Damped least squares, with a damping that falls with the error (Chan & Lawrence 1988)."""

import numpy as np

from .parts.kinematics import bend, kinematics, path_to
from .parts.rotations import multiply, rotate

PLUMBOB = {"methods": ["jacobian"]}
STEP, DAMPING = 1.0, 0.25  # fitted to the answers of other solvers


def exponential(w):
    angle = np.linalg.norm(w)
    return np.array([np.cos(angle / 2), *(0.5 * np.sinc(angle / (2 * np.pi)) * w)])


def inverse_kinematics(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations
):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    path = path_to(parents, effector)
    joints = path[:0:-1]  # the root first
    reach = np.linalg.norm(offsets[path[:-1]], axis=1).sum()
    for _ in range(max_iterations):
        error = target - x[effector]
        distance = np.linalg.norm(error)
        if distance <= tolerance:
            break
        J = np.zeros((3, 3 * len(joints)))
        for k, j in enumerate(joints):
            arm = x[effector] - x[j]
            for i, axis in enumerate(np.eye(3)):
                J[:, 3 * k + i] = np.cross(rotate(R[j], axis), arm)
        short = min(distance, 0.4 * reach)
        A = J @ J.T + DAMPING * reach * short * np.eye(3)
        step = STEP * J.T @ np.linalg.solve(A, short / distance * error)
        for j, w in zip(joints, step.reshape(-1, 3)):
            q[j] = multiply(q[j], exponential(w))
            q[j] = q[j] / np.linalg.norm(q[j])
        x, R = kinematics(parents, offsets, q)
    return {"local_rotations": q, "positions": x}
