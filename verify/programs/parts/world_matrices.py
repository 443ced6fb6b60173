"""Poses by rotation matrices."""

import numpy as np


def product(a, b):
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return np.array([w, x, y, z])


def matrix(q):
    w, x, y, z = q
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * K + 2.0 * K @ K


def world(parents, offsets, q):
    """Return the positions and the rotation matrices of the joints in the world."""
    x, W = offsets.copy(), [matrix(r) for r in q]
    for j in range(1, len(parents)):
        p = parents[j]
        x[j] = x[p] + W[p] @ offsets[j]
        W[j] = W[p] @ W[j]
    return x, W
