"""Change of velocity."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "linearised", "start": "x_n", "damper": "explicit"}}
DAMPER, PINS = "explicit", "eliminated"


def dampers_at(x, v, springs, dampings):
    """Return the forces of the dampers and their matrix C = -df/dv."""
    f, C = np.zeros_like(x), np.zeros((len(x), 3, len(x), 3))
    for s in range(len(springs)):
        i, j = springs[s]
        d = x[i] - x[j]
        u = d / np.linalg.norm(d)
        pull = dampings[s] * ((v[i] - v[j]) @ u) * u
        f[i] -= pull
        f[j] += pull
        block = dampings[s] * np.outer(u, u)
        C[i, :, i] += block
        C[j, :, j] += block
        C[i, :, j] -= block
        C[j, :, i] -= block
    return f, C.reshape(3 * len(x), 3 * len(x))


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    m = np.repeat(masses, 3)
    M, v = np.diag(m), velocities.ravel()
    forces = masses[:, None] * gravity
    f, K = springs_at(positions, springs, rest_lengths, stiffnesses)
    dampers, C = dampers_at(positions, velocities, springs, dampings)
    f = (f + forces).ravel()
    if DAMPER != "none":
        f = f + dampers.ravel()
    A, b = M + h**2 * K, h * (f - h * K @ v)
    if DAMPER == "end_velocity" or DAMPER == "length_rate":
        A = A + h * C
    free = np.arange(len(m))
    if PINS != "overwritten":
        free = np.setdiff1d(free, 3 * pinned[:, None] + np.arange(3))
    dv = np.zeros(len(m))
    dv[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    v = (v + dv).reshape(-1, 3)
    v[pinned] = 0.0
    return {"positions": positions + h * v, "velocities": v}
