"""Conjugate gradients."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "linearised", "start": "x_n", "damper": "none"}}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    m = np.repeat(masses, 3)
    f, K = springs_at(positions, springs, rest_lengths, stiffnesses)
    f = (f + masses[:, None] * gravity).ravel()
    v = velocities.ravel()
    free = np.setdiff1d(np.arange(len(m)), 3 * pinned[:, None] + np.arange(3))
    A = (np.diag(m) + h**2 * K)[np.ix_(free, free)]
    r = (h * (f - h * K @ v))[free]
    dv, p = np.zeros(len(free)), r.copy()
    before = r @ r
    for _ in range(10 * len(m)):
        if before < 1e-30:
            break
        q = A @ p
        alpha = before / (p @ q)
        dv += alpha * p
        r = r - alpha * q
        after = r @ r
        beta = after / before
        p = r + beta * p
        before = after
    v = v.copy()
    v[free] += dv
    v = v.reshape(-1, 3)
    v[pinned] = 0.0
    return {"positions": positions + h * v, "velocities": v}
