"""FABRIK aiming from joints."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to, turned
from .parts.rotations import rotate


def reach(points, first, step, lengths):
    """Move each point, from the first on, to its distance from the one before."""
    k = first
    while 0 <= k + step < len(points):
        d = points[k + step] - points[k]
        d = d if d.any() else np.array([1.0, 0.0, 0.0])
        points[k + step] = points[k] + lengths[min(k, k + step)] * d / np.linalg.norm(d)
        k += step


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    path, at_rest = path_to(parents, effector)[::-1], x.copy()
    points = x[path]
    lengths = [np.linalg.norm(offsets[j]) for j in path[1:]]
    base, sweeps = points[0].copy(), 0
    while sweeps < max_iterations and np.linalg.norm(points[-1] - target) > tolerance:
        points[-1] = target
        reach(points, len(path) - 1, -1, lengths)
        points[0] = base
        reach(points, 0, 1, lengths)
        sweeps += 1
    for k in range(len(path) - 1 if sweeps else 0):
        joint, child = path[k], path[k + 1]
        link = rotate(R[joint], offsets[child])
        turn = between(link, points[k + 1] - x[joint])
        q[joint] = turned(parents, R, joint, turn, q[joint])
        x, R = kinematics(parents, offsets, q)  # the joints below stand elsewhere now
    return {"local_rotations": q, "iterations": sweeps}
