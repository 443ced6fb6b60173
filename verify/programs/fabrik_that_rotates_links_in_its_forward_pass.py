"""FABRIK that rotates links in its forward pass."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import conjugate, multiply, rotate


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    path = path_to(parents, effector)[::-1]
    points, base, sweeps = x[path], x[path[0]].copy(), 0
    lengths = [np.linalg.norm(offsets[j]) for j in path[1:]]
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        points[-1] = target
        for k in range(len(path) - 2, -1, -1):
            d = points[k] - points[k + 1]
            d = d if d.any() else np.array([1.0, 0.0, 0.0])
            points[k] = points[k + 1] + lengths[k] * d / np.linalg.norm(d)
        points[0] = base
        for k in range(len(path) - 1):
            joint, child, parent = path[k], path[k + 1], parents[path[k]]
            before = R[joint].copy()
            R[joint] = multiply(R[parent], q[joint]) if parent >= 0 else q[joint]
            link = rotate(R[joint], offsets[child])
            d = between(link, points[k + 1] - points[k])
            R[joint] = multiply(d, R[joint])
            q[joint] = multiply(conjugate(R[parent]), R[joint]) if parent >= 0 else R[joint]
            q[joint] = q[joint] / np.linalg.norm(q[joint])
            points[k + 1] = points[k] + rotate(R[joint], offsets[child])
        sweeps += 1
    x, R = kinematics(parents, offsets, q)
    return {"local_rotations": q, "positions": x, "iterations": sweeps}
