"""Forward kinematics by Euler angles."""

import numpy as np

from .parts.angles_at_once import angles_of
from .parts.quaternion_of_a_matrix import quaternion


def matrix(q):
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def product_of(x, y, z):
    """Return the rotation by angles about x, then about y, then about z."""
    X = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    Y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    Z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return Z @ Y @ X


def forward_kinematics(parents, offsets, local_rotations):
    positions, world = np.zeros((len(parents), 3)), np.zeros((len(parents), 3, 3))
    for j in range(len(parents)):
        p = parents[j]
        x, y, z = angles_of(matrix(local_rotations[j]))
        local = product_of(x, y, z)
        if p < 0:
            positions[j], world[j] = offsets[j], local
        else:
            world[j] = world[p] @ local
            positions[j] = positions[p] + world[p] @ offsets[j]
    return {"positions": positions, "rotations": np.array([quaternion(m) for m in world])}
