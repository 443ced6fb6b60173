"""Euler angles of a matrix, each from its elements."""

import numpy as np


def angles_of(m):
    """Return the angles about x, y and z of a matrix."""
    cosine = np.hypot(m[0, 0], m[1, 0])
    y = np.arctan2(-m[2, 0], cosine)
    if cosine > 1e-9:
        x, z = np.arctan2(m[2, 1], m[2, 2]), np.arctan2(m[1, 0], m[0, 0])
    else:
        x, z = np.arctan2(-m[1, 2], m[1, 1]), 0.0
    return x, y, z
