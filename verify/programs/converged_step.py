"""Converged step."""

import numpy as np

PLUMBOB = {
    "system": {"external_forces": True, "tension_only": True},
    "step": {"method": "converged", "start": "y", "damper": "length_rate"},
}
DAMPER = "length_rate"


def gradient_and_hessian(x, springs, rest, k, slack):
    n = len(x)
    g, H = np.zeros((n, 3)), np.zeros((n, 3, n, 3))
    for s in range(len(springs)):
        i, j = springs[s]
        d = x[j] - x[i]
        length = np.linalg.norm(d)
        if length == 0.0 or (slack[s] and length < rest[s]):
            continue
        u = d / length
        push = k[s] * (length - rest[s]) * u
        g[i] -= push
        g[j] += push
        across = max(0.0, 1.0 - rest[s] / length)
        block = k[s] * (np.outer(u, u) + across * (np.eye(3) - np.outer(u, u)))
        H[i, :, i] += block
        H[j, :, j] += block
        H[i, :, j] -= block
        H[j, :, i] -= block
    return g, H.reshape(3 * n, 3 * n)


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings, pinned, gravity,
                     positions, velocities, h, external_forces=0.0, tension_only=None):
    n = len(masses)
    M = np.diag(np.repeat(masses, 3))
    is_free = np.ones(3 * n, bool)
    is_free[3 * pinned[:, None] + np.arange(3)] = False
    free = np.flatnonzero(is_free)
    loads = masses[:, None] * gravity + external_forces
    slack = np.zeros(len(springs), bool) if tension_only is None else tension_only
    springs = np.concatenate([springs, springs])  # the second half for the dampers
    lengths = np.linalg.norm(np.diff(positions[springs[: len(springs) // 2]], axis=1)[:, 0], axis=1)
    rest = np.concatenate([rest_lengths, lengths])
    k = np.concatenate([stiffnesses, dampings / h if DAMPER == "length_rate" else 0.0 * dampings])
    slack = np.concatenate([slack, np.zeros(len(slack), bool)])
    y = positions + h * velocities
    target = y + h**2 * loads / masses[:, None]

    x = positions.copy()
    for _ in range(100):
        g, H = gradient_and_hessian(x, springs, rest, k, slack)
        offset = x - target
        gradient = masses[:, None] * offset + h**2 * g
        A = M + h**2 * H
        move = np.zeros(3 * n)
        move[free] = -np.linalg.solve(A[np.ix_(free, free)], gradient.ravel()[free])
        x = x + move.reshape(n, 3)
        if np.abs(move).max() <= 1e-13 * (1.0 + np.abs(x).max()):
            break
    v = (x - positions) / h
    return {"positions": x, "velocities": v}
