"""CCD in own frames."""

import numpy as np

from .parts.kinematics import bend, between, path_to
from .parts.world_matrices import product, world


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, W = world(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            a = W[joint].T @ (x[effector] - x[joint])  # in the frame of the joint itself
            b = W[joint].T @ (target - x[joint])
            q[joint] = product(q[joint], between(a, b))
            q[joint] = q[joint] / np.linalg.norm(q[joint])
            x, W = world(parents, offsets, q)
        sweeps += 1
    return {"local_rotations": q, "iterations": sweeps}
