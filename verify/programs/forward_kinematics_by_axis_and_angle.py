"""Forward kinematics by axis and angle."""

import numpy as np
from scipy.spatial.transform import Rotation


def matrix(q):
    """Return the rotation matrix of a quaternion by Rodrigues' formula."""
    w, v = q[0], q[1:]
    sine = np.linalg.norm(v)
    if sine == 0.0:
        return np.eye(3)
    half = np.arctan2(sine, w)
    angle = 2.0 * half
    x, y, z = v / np.sin(half)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def forward_kinematics(parents, offsets, local_rotations):
    positions = np.zeros(offsets.shape)
    world = [np.eye(3) for _ in parents]
    for j in range(len(parents)):
        p = parents[j]
        local = matrix(local_rotations[j])
        if p < 0:
            positions[j], world[j] = offsets[j], local
        else:
            world[j] = world[p] @ local
            positions[j] = positions[p] + world[p] @ offsets[j]
    rotations = Rotation.from_matrix(np.array(world)).as_quat(scalar_first=True)
    return {"positions": positions, "rotations": rotations}
