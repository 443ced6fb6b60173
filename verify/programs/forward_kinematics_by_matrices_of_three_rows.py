"""Forward kinematics by matrices of three rows."""

import numpy as np

from .parts.quaternion_by_the_first_of_the_largest import quaternion


def skew(v):
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def matrix(q):
    w, K = q[0], skew(q[1:])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K


def forward_kinematics(parents, offsets, local_rotations):
    x, R = offsets.copy(), [matrix(q) for q in local_rotations]
    for j in range(1, len(parents)):
        p = parents[j]
        x[j] = x[p] + R[p] @ offsets[j]
        R[j] = R[p] @ R[j]
    return {"positions": x, "rotations": np.array([quaternion(m) for m in R])}
