"""Implicit step."""

import numpy as np


def lengths_at(x, springs):
    return np.linalg.norm(x[springs[:, 0]] - x[springs[:, 1]], axis=1)


def converged(y, masses, springs, rest_lengths, stiffnesses, dampings, slackable, pinned, weights, h, lengths_n):
    """Return positions at the end of a step, from y; dampers are springs at rest at lengths_n."""
    count, x = len(masses), y.copy()
    free = np.setdiff1d(np.arange(count), pinned)
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    for _ in range(60):
        gradient = masses[:, None] * (x - y) - h**2 * weights
        hessian = np.zeros((count, 3, count, 3))
        for i in range(count):
            hessian[i, :, i] += masses[i] * np.eye(3)
        for s in range(len(springs)):
            i, j = springs[s]
            k, rest, damper = stiffnesses[s], rest_lengths[s], dampings[s] / h
            d = x[i] - x[j]
            length = max(np.linalg.norm(d), 1e-12)
            u = d / length
            if slackable[s] and length < rest:
                k = 0.0
            pull = k * (length - rest) + damper * (length - lengths_n[s])
            gradient[i] += h**2 * pull * u
            gradient[j] -= h**2 * pull * u
            along = np.outer(u, u)
            across = max(0.0, pull / length) * (np.eye(3) - along)
            block = h**2 * ((k + damper) * along + across)
            hessian[i, :, i] += block
            hessian[j, :, j] += block
            hessian[i, :, j] -= block
            hessian[j, :, i] -= block
        move = np.zeros(3 * count)
        matrix = hessian.reshape(3 * count, 3 * count)[np.ix_(rows, rows)]
        move[rows] = np.linalg.solve(matrix, -gradient.ravel()[rows])
        x = x + move.reshape(count, 3)
        if np.abs(move).max() <= 1e-13 * np.abs(x).max():
            break
    return x
