"""FABRIK."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to, turned
from .parts.rotations import rotate


def pull(fixed, moved, length):
    """Return a point at a distance from a fixed one, on the line to a moved one."""
    line = moved - fixed if (moved != fixed).any() else np.array([1.0, 0.0, 0.0])
    return fixed + length / np.linalg.norm(line) * line


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    path = path_to(parents, effector)[::-1]
    lengths = np.linalg.norm(offsets[path], axis=1)  # from its parent to each joint
    last, sweeps = len(path) - 1, 0
    points = kinematics(parents, offsets, q)[0][path]
    root = points[0].copy()
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        points[last] = target
        for k in range(last - 1, -1, -1):
            points[k] = pull(points[k + 1], points[k], lengths[k + 1])
        points[0] = root
        for k in range(last):
            points[k + 1] = pull(points[k], points[k + 1], lengths[k + 1])
        sweeps += 1
    for k in range(last if sweeps else 0):
        joint, child = path[k], path[k + 1]
        _, R = kinematics(parents, offsets, q)
        d = between(rotate(R[joint], offsets[child]), points[k + 1] - points[k])
        q[joint] = turned(parents, R, joint, d, q[joint])
    return {"local_rotations": q, "iterations": sweeps}
