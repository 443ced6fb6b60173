"""CCD on a hierarchy of bodies that keeps the global rotation of each."""

import numpy as np

from .parts.hierarchy import joints_below, local_rotations_of
from .parts.kinematics import bend, between, kinematics
from .parts.rotations import multiply, rotate


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        joint = parents[effector]
        while joint >= 0:
            d = between(x[effector] - x[joint], target - x[joint])
            R[joint] = multiply(d, R[joint])
            R[joint] = R[joint] / np.linalg.norm(R[joint])
            for k in joints_below(parents, joint):
                R[k] = multiply(d, R[k])
                x[k] = x[parents[k]] + rotate(R[parents[k]], offsets[k])
            joint = parents[joint]
        sweeps += 1
    q = local_rotations_of(parents, R)
    return {"local_rotations": q, "iterations": sweeps}
