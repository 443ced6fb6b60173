"""Newton's method with a line search."""

import numpy as np

from .parts.springs import springs_at

PLUMBOB = {"step": {"method": "converged", "start": "x_n", "damper": "none"}}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    M = np.diag(np.repeat(masses, 3))
    free = np.setdiff1d(np.arange(len(masses)), pinned)
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    y = positions + h * velocities

    def energy(x):
        value = 0.5 * np.sum(masses[:, None] * (x - y) ** 2) / h**2
        value -= np.sum(masses[:, None] * gravity * x)
        for s in range(len(springs)):
            length = np.linalg.norm(x[springs[s][0]] - x[springs[s][1]])
            value += 0.5 * stiffnesses[s] * (length - rest_lengths[s]) ** 2
        return h**2 * value

    def derivatives(x):
        f, K = springs_at(x, springs, rest_lengths, stiffnesses)
        f += masses[:, None] * gravity
        gradient = (masses[:, None] * (x - y) - h**2 * f).ravel()[rows]
        hessian = (M + h**2 * K)[np.ix_(rows, rows)]
        if np.linalg.eigvalsh(hessian).min() <= 0.0:  # as if compressed springs were at rest
            lengths = np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)
            rest = np.minimum(rest_lengths, lengths)
            _, K = springs_at(x, springs, rest, stiffnesses)
            hessian = (M + h**2 * K)[np.ix_(rows, rows)]
        return gradient, hessian

    x = positions.copy()
    for _ in range(60):
        gradient, hessian = derivatives(x)
        move = np.zeros((len(masses), 3))
        move[free] = -np.linalg.solve(hessian, gradient).reshape(-1, 3)
        slope = gradient @ move[free].ravel()
        if np.abs(move).max() <= 1e-13:
            break
        rate, value = 1.0, energy(x)
        while energy(x + rate * move) > value + 1e-4 * rate * slope + 1e-13 * abs(value):
            rate *= 0.5
            if rate < 1e-12:
                return {"positions": x, "velocities": (x - positions) / h}
        x = x + rate * move
    return {"positions": x, "velocities": (x - positions) / h}
