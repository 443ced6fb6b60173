"""Forward kinematics in two passes."""

import numpy as np

from .parts.rotations import multiply


def matrix(q):
    w, x, y, z = q
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K


def rotations_of(parents, local_rotations):
    R = local_rotations.copy()
    for j in range(len(parents)):
        p = parents[j]
        if p >= 0:
            R[j] = multiply(R[p], local_rotations[j])
    return R


def positions_of(parents, offsets, local_rotations):
    x, M = offsets.copy(), [matrix(q) for q in local_rotations]
    for j in range(len(parents)):
        p = parents[j]
        if p >= 0:
            x[j] = x[p] + M[p] @ offsets[j]
            M[j] = M[p] @ M[j]
    return x


def forward_kinematics(parents, offsets, local_rotations):
    R = rotations_of(parents, local_rotations)
    x = positions_of(parents, offsets, local_rotations)
    return {"positions": x, "rotations": R}
