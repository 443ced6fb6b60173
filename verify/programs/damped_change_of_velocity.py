"""Damped change of velocity."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "linearised", "start": "x_n", "damper": "end_velocity"}}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    m = np.repeat(masses, 3)
    M, v = np.diag(m), velocities.ravel()
    f, K = springs_at(positions, springs, rest_lengths, stiffnesses)
    C = np.zeros_like(M)
    for s in range(len(springs)):
        d = np.zeros((len(masses), 3))
        d[springs[s]] = np.diff(positions[springs[s]], axis=0) * [[-1.0], [1.0]]
        u = d.ravel() / np.linalg.norm(d[springs[s][0]])
        C += dampings[s] * np.outer(u, u)
    f = (f + masses[:, None] * gravity).ravel() - C @ v
    A, b = M + h * C + h**2 * K, h * (f - h * K @ v)
    free = np.setdiff1d(np.arange(len(m)), 3 * pinned[:, None] + np.arange(3))
    dv = np.zeros(len(m))
    dv[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    v = (v + dv).reshape(-1, 3)
    v[pinned] = 0.0
    return {"positions": positions + h * v, "velocities": v}
