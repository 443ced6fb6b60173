"""Euler angles of a matrix, each from the angles before."""

import numpy as np


def angles_of(m):
    """Return the angles about x, y and z of a matrix, each after those found before."""
    z = np.arctan2(m[1, 0], m[0, 0])
    c, s = np.cos(z), np.sin(z)
    y = np.arctan2(-m[2, 0], c * m[0, 0] + s * m[1, 0])
    x = np.arctan2(s * m[0, 2] - c * m[1, 2], c * m[1, 1] - s * m[0, 1])
    return x, y, z
