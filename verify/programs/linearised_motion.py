"""Linearised motion."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "linearised", "start": "x_n", "damper": "none"}}


def mass_spring_motion(masses, springs, rest_lengths, stiffnesses, dampings,
                       pinned, gravity, positions, velocities, h, steps):
    m, x, v, frames = np.repeat(masses, 3), positions, velocities, []
    free = np.setdiff1d(np.arange(len(m)), 3 * pinned[:, None] + np.arange(3))
    for _ in range(steps):
        f = springs_at(x, springs, rest_lengths, stiffnesses)[0] + masses[:, None] * gravity
        K = springs_at(x, springs, rest_lengths, stiffnesses)[1]
        A, b = np.diag(m) + h**2 * K, h * (f.ravel() - h * K @ v.ravel())
        dv = np.zeros(len(m))
        dv[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
        v = v + dv.reshape(-1, 3)
        v[pinned] = 0.0
        x = x + h * v
        frames.append((x, v))
    return {"positions": np.array([x for x, _ in frames]),
            "velocities": np.array([v for _, v in frames])}
