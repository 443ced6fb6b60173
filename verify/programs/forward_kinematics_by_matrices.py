"""Forward kinematics by matrices."""

import numpy as np

from .parts.quaternion_of_a_matrix import quaternion


def translation(t):
    m = np.eye(4)
    m[:3, 3] = t
    return m


def rotation(q):
    """Return the 4x4 matrix of a quaternion."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 0.0],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 0.0],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ])


def product(a, b):
    return a @ b


def forward_kinematics(parents, offsets, local_rotations):
    world = [np.eye(4) for _ in parents]
    for j in range(len(parents)):
        p = parents[j]
        local = product(translation(offsets[j]), rotation(local_rotations[j]))
        if p < 0:
            world[j] = local
        else:
            world[j] = product(world[p], local)
    positions = np.array([m[:3, 3] for m in world])
    return {"positions": positions, "rotations": np.array([quaternion(m) for m in world])}
