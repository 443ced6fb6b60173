"""Rotations by quaternions, each way to multiply and to rotate: `programs.toml` chooses."""

import numpy as np


def conjugate(q):
    return np.array([q[0], -q[1], -q[2], -q[3]])


def cross(a, b):
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return np.array([x, y, z])


def product(a, b):
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return np.array([w, x, y, z])


def product_of_vectors(a, b):
    vector = a[0] * b[1:] + b[0] * a[1:] + cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def by_cross(q, v):
    return v + 2.0 * cross(q[1:], cross(q[1:], v) + q[0] * v)


def by_product(q, v):
    return multiply(multiply(q, np.array([0.0, *v])), conjugate(q))[1:]


def by_matrix(q, v):
    w, x, y, z = q
    m = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    return m @ v


def multiply(a, b):
    return product(a, b)


def rotate(q, v):
    return by_cross(q, v)
