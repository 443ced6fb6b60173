"""CCD by matrices."""

import numpy as np
from scipy.spatial.transform import Rotation

from .parts.kinematics import bend, kinematics, path_to


def matrix(q):
    w, x, y, z = q
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K


def rotation(axis, angle):
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    local, W = [matrix(r) for r in q], [matrix(r) for r in R]
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            a = x[effector] - x[joint]
            b = target - x[joint]
            axis = np.cross(a, b)
            sine = np.linalg.norm(axis)
            if sine <= 1e-14 * (1.0 + a @ a):
                continue
            turn = rotation(axis / sine, np.arctan2(sine, a @ b))
            below = {joint}
            for k in range(joint, len(parents)):
                if k in below or parents[k] in below:
                    below.add(k)
                    x[k] = x[joint] + turn @ (x[k] - x[joint])
                    W[k] = turn @ W[k]
            p = parents[joint]
            local[joint] = W[p].T @ W[joint] if p >= 0 else W[joint]
        sweeps += 1
    q = Rotation.from_matrix(np.array(local)).as_quat(scalar_first=True)
    return {"local_rotations": q, "positions": x, "iterations": sweeps}
