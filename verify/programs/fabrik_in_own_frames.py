"""FABRIK in own frames."""

import numpy as np

from .parts.kinematics import bend, between, path_to
from .parts.world_matrices import product, world


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, W = world(parents, offsets, q)
    path = path_to(parents, effector)[::-1]
    points, sweeps = x[path], 0
    lengths = [np.linalg.norm(offsets[j]) for j in path[1:]]
    root = points[0].copy()
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        points[-1] = target
        for k in range(len(lengths) - 1, -1, -1):
            u = points[k] - points[k + 1]
            u = u if u.any() else np.array([1.0, 0.0, 0.0])
            points[k] = points[k + 1] + lengths[k] / np.linalg.norm(u) * u
        points[0] = root
        for k in range(len(lengths)):
            u = points[k + 1] - points[k]
            u = u if u.any() else np.array([1.0, 0.0, 0.0])
            points[k + 1] = points[k] + lengths[k] / np.linalg.norm(u) * u
        sweeps += 1
    for k in range(len(lengths) if sweeps else 0):
        joint, child = path[k], path[k + 1]
        goal = W[joint].T @ (points[k + 1] - x[joint])  # in the frame of the joint itself
        q[joint] = product(q[joint], between(offsets[child], goal))
        q[joint] = q[joint] / np.linalg.norm(q[joint])
        x, W = world(parents, offsets, q)
    return {"local_rotations": q, "iterations": sweeps}
