"""FABRIK by directions at rest."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import conjugate, multiply, rotate


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, _ = kinematics(parents, offsets, q)
    path = path_to(parents, effector)[::-1]
    p = x[path]
    root, n, sweeps = p[0].copy(), len(path), 0
    d = [np.linalg.norm(p[i + 1] - p[i]) for i in range(n - 1)]
    while sweeps < max_iterations and np.linalg.norm(p[-1] - target) > tolerance:
        p[n - 1] = target
        for i in range(n - 2, -1, -1):
            r = np.linalg.norm(p[i + 1] - p[i])
            share = d[i] / max(r, 1e-300)
            p[i] = (1.0 - share) * p[i + 1] + share * p[i]
        p[0] = root
        for i in range(n - 1):
            r = np.linalg.norm(p[i + 1] - p[i])
            share = d[i] / max(r, 1e-300)
            p[i + 1] = (1.0 - share) * p[i] + share * p[i + 1]
        sweeps += 1
    if sweeps:
        P = np.array([1.0, 0.0, 0.0, 0.0])
        for i in range(n - 1):
            joint, child = path[i], path[i + 1]
            direction = rotate(conjugate(P), p[i + 1] - p[i])
            q[joint] = between(offsets[child], direction)
            P = multiply(P, q[joint])
    return {"local_rotations": q, "iterations": sweeps}
