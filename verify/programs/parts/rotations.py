"""Rotations by quaternions."""

import numpy as np


def multiply(a, b):
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def conjugate(q):
    return q * [1.0, -1.0, -1.0, -1.0]


def rotate(q, v):
    return v + 2.0 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v)
