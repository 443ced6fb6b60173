"""Local-global step by a factor."""

import numpy as np

PLUMBOB = {
    "step": {"method": "local_global", "start": "y", "iterations": 10, "damper": "length_rate"},
}
DAMPER, ITERATIONS = "length_rate", 10


def factor(A):
    """Return the lower triangle of the Cholesky factor of a matrix."""
    n = len(A)
    C = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            rest = A[i, j] - C[i, :j] @ C[j, :j]
            C[i, j] = np.sqrt(rest) if i == j else rest / C[j, j]
    return C


def solve(C, b):
    """Return the solution of C C^T x = b."""
    n = len(C)
    x = b.copy()
    for i in range(n):
        x[i] = (x[i] - C[i, :i] @ x[:i]) / C[i, i]
    for i in range(n - 1, -1, -1):
        x[i] = (x[i] - C[i + 1 :, i] @ x[i + 1 :]) / C[i, i]
    return x


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    n = len(masses)
    free = [i for i in range(n) if i not in pinned]
    row = {i: free.index(i) for i in free}
    A = np.zeros((len(free), len(free)))
    fixed = np.zeros((len(free), 3))  # the part of the pinned particles
    forces = masses[:, None] * gravity
    k, rest = stiffnesses.copy(), rest_lengths.copy()
    for i in free:
        A[row[i], row[i]] += masses[i]
    for s in range(len(springs)):
        i, j = springs[s]
        d = positions[j] - positions[i]
        length = np.linalg.norm(d)
        if DAMPER == "length_rate":
            c = dampings[s] / h
            k[s] = stiffnesses[s] + c
            rest[s] = (stiffnesses[s] * rest_lengths[s] + c * length) / k[s] if k[s] > 0.0 else 0.0
        if DAMPER == "explicit":
            u = d / length
            pull = dampings[s] * (u @ (velocities[j] - velocities[i])) * u
            forces[i] += pull
            forces[j] -= pull
        w = h**2 * k[s]
        if i in row:
            A[row[i], row[i]] += w
        if j in row:
            A[row[j], row[j]] += w
        if i in row and j in row:
            A[row[i], row[j]] -= w
            A[row[j], row[i]] -= w
        elif i in row:
            fixed[row[i]] += w * positions[j]
        elif j in row:
            fixed[row[j]] += w * positions[i]
    C = factor(A)
    y = positions + h * velocities
    x = y.copy()
    x[pinned] = positions[pinned]
    for _ in range(ITERATIONS):
        b = masses[:, None] * y + h**2 * forces
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[j] - x[i]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            push = h**2 * k[s] * rest[s] * u
            b[i] -= push
            b[j] += push
        x[free] = solve(C, b[free] + fixed)
    v = (x - positions) / h
    v[pinned] = 0.0
    return {"positions": x, "velocities": v}
