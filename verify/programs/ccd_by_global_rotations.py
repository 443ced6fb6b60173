"""CCD by global rotations."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import conjugate, multiply, rotate


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    chain = path_to(parents, effector)[::-1]  # the root first
    points, rotations, sweeps = x[chain], R[chain], 0
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        for k in range(len(chain) - 2, -1, -1):
            d = between(points[-1] - points[k], target - points[k])
            for m in range(k + 1, len(chain)):
                points[m] = points[k] + rotate(d, points[m] - points[k])
            for m in range(k, len(chain)):
                rotations[m] = multiply(d, rotations[m])
        sweeps += 1
    for k in range(len(chain) - 1):
        local = rotations[k]
        if k > 0:
            local = multiply(conjugate(rotations[k - 1]), local)
        q[chain[k]] = local / np.linalg.norm(local)
    x, R = kinematics(parents, offsets, q)
    return {"local_rotations": q, "positions": x, "iterations": sweeps}
