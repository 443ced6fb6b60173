"""Forces and stiffness of springs."""

import numpy as np


def springs_at(x, springs, rest_lengths, stiffnesses):
    """Return the springs' forces and their stiffness matrix K = -df/dx."""
    count = len(x)
    f, K = np.zeros((count, 3)), np.zeros((count, 3, count, 3))
    for s in range(len(springs)):
        i, j = springs[s]
        k, rest = stiffnesses[s], rest_lengths[s]
        d = x[i] - x[j]
        length = np.linalg.norm(d)
        u = d / length
        f[i] -= k * (length - rest) * u
        f[j] += k * (length - rest) * u
        along = np.outer(u, u)
        across = (1.0 - rest / length) * (np.eye(3) - along)
        block = k * (along + across)
        K[i, :, i] += block
        K[j, :, j] += block
        K[i, :, j] -= block
        K[j, :, i] -= block
    return f, K.reshape(3 * count, 3 * count)
