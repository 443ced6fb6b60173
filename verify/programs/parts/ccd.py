"""CCD."""

import numpy as np

from .kinematics import bend, between, kinematics, path_to, turned


def solve(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            d = between(x[effector] - x[joint], target - x[joint])
            q[joint] = turned(parents, R, joint, d, q[joint])
            x, R = kinematics(parents, offsets, q)
        sweeps += 1
    return q
