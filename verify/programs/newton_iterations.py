"""Newton iterations."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "newton", "start": "x_n", "iterations": 5, "damper": "none"}}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    M = np.diag(np.repeat(masses, 3))
    free = np.setdiff1d(np.arange(len(masses)), pinned)
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    y = positions + h * velocities
    x = positions.copy()
    for _ in range(5):
        f, K = springs_at(x, springs, rest_lengths, stiffnesses)
        f += masses[:, None] * gravity
        gradient = (masses[:, None] * (x - y) - h**2 * f).ravel()[rows]
        A = (M + h**2 * K)[np.ix_(rows, rows)]
        move = -np.linalg.solve(A, gradient)
        x[free] += move.reshape(-1, 3)
    return {"positions": x, "velocities": (x - positions) / h}
