"""Local-global step."""

import numpy as np

PLUMBOB = {
    "step": {"method": "local_global", "start": "y", "iterations": 10, "damper": "explicit"},
}
START, ITERATIONS, DAMPER = "y", 10, "explicit"


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    free = np.setdiff1d(np.arange(len(masses)), pinned)
    forces = masses[:, None] * gravity
    M, L = np.diag(masses), np.zeros((len(masses), len(masses)))
    stretched = stiffnesses * rest_lengths
    for s in range(len(springs)):
        i, j = springs[s]
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length if length > 0.0 else np.zeros(3)
        damper = dampings[s] * ((velocities[i] - velocities[j]) @ u) * u
        if DAMPER == "explicit":
            forces[i] -= damper
            forces[j] += damper
        k = stiffnesses[s]
        if DAMPER == "length_rate" or DAMPER == "end_velocity":
            k += dampings[s] / h
            stretched[s] += dampings[s] / h * length
        L[i, i] += k
        L[j, j] += k
        L[i, j] -= k
        L[j, i] -= k
    A = M + h**2 * L
    y = positions + h * velocities
    x = positions.copy()
    if START != "x_n":
        x[free] = y[free]
    if START == "s_n":
        x[free] += h**2 * forces[free] / masses[free, None]
    for _ in range(ITERATIONS):
        b = M @ y + h**2 * forces
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            b[i] += h**2 * stretched[s] * u
            b[j] -= h**2 * stretched[s] * u
        b -= A[:, pinned] @ x[pinned]
        x[free] = np.linalg.solve(A[np.ix_(free, free)], b[free])
    return {"positions": x, "velocities": (x - positions) / h}
