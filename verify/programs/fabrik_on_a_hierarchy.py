"""FABRIK by the lengths of links, on a hierarchy of bodies that keeps the global rotation of each."""

import numpy as np

from .parts.hierarchy import joints_below, local_rotations_of
from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import multiply, rotate


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    path = path_to(parents, effector)[::-1]
    points, n = x[path], len(path)
    lengths = [np.linalg.norm(points[i + 1] - points[i]) for i in range(n - 1)]
    root, sweeps = points[0].copy(), 0
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        points[-1] = target
        for i in range(n - 2, -1, -1):
            d = points[i] - points[i + 1]
            d = d if d.any() else np.array([1.0, 0.0, 0.0])
            points[i] = points[i + 1] + d / np.linalg.norm(d) * lengths[i]
        points[0] = root
        for i in range(1, n):
            d = points[i] - points[i - 1]
            d = d if d.any() else np.array([1.0, 0.0, 0.0])
            points[i] = points[i - 1] + d / np.linalg.norm(d) * lengths[i - 1]
        sweeps += 1
    for k in range(n - 1 if sweeps else 0):
        joint, child = path[k], path[k + 1]
        d = between(rotate(R[joint], offsets[child]), points[k + 1] - points[k])
        R[joint] = multiply(d, R[joint])
        R[joint] = R[joint] / np.linalg.norm(R[joint])
        for m in joints_below(parents, joint):
            R[m] = multiply(d, R[m])
    q = local_rotations_of(parents, R)
    return {"local_rotations": q, "iterations": sweeps}
