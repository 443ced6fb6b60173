"""Newton step."""

import numpy as np

PLUMBOB = {
    "system": {"external_forces": True},
    "step": {"method": "newton", "start": "x_n", "damper": "explicit"},
}
METHOD, START, ITERATIONS, DAMPER = "newton", "x_n", 60, "explicit"


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h, external_forces=0.0):
    count, inertia = len(masses), masses
    free = np.setdiff1d(np.arange(count), pinned)
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    forces = masses[:, None] * gravity
    forces = forces + external_forces
    first_lengths = np.zeros(len(springs))
    for s in range(len(springs)):
        i, j = springs[s]
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        first_lengths[s] = length
        u = d / length if length > 0.0 else np.zeros(3)
        damper = dampings[s] * ((velocities[i] - velocities[j]) @ u) * u
        if DAMPER == "explicit":
            forces[i] -= damper
            forces[j] += damper
    y = positions + h * velocities

    def gradient_and_hessian(x):
        gradient = inertia[:, None] * (x - y) - h**2 * forces
        hessian = np.zeros((count, 3, count, 3))
        for i in range(count):
            hessian[i, :, i] += inertia[i] * np.eye(3)
        for s in range(len(springs)):
            i, j = springs[s]
            k, rest = stiffnesses[s], rest_lengths[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            along = np.outer(u, u)
            across = 1.0 - rest / length if length > 0.0 else 0.0
            if METHOD != "linearised":
                across = max(0.0, across)
            pull = h**2 * k * (length - rest) * u
            block = h**2 * k * (along + across * (np.eye(3) - along))
            if DAMPER == "length_rate":
                pull = pull + h * dampings[s] * (length - first_lengths[s]) * u
                block = block + h * dampings[s] * along
            if DAMPER == "end_velocity":
                moved = (x[i] - positions[i]) - (x[j] - positions[j])
                pull = pull + h * dampings[s] * (moved @ u) * u
                block = block + h * dampings[s] * along
            gradient[i] += pull
            gradient[j] -= pull
            hessian[i, :, i] += block
            hessian[j, :, j] += block
            hessian[i, :, j] -= block
            hessian[j, :, i] -= block
        return gradient.ravel()[rows], hessian.reshape(3 * count, 3 * count)[np.ix_(rows, rows)]

    x = positions.copy()
    if START != "x_n":
        x[free] = y[free]
    if START == "s_n":
        x[free] += h**2 * forces[free] / masses[free, None]
    for _ in range(1 if METHOD == "linearised" else ITERATIONS):
        gradient, hessian = gradient_and_hessian(x)
        move = np.zeros(3 * count)
        move[rows] = np.linalg.solve(hessian, -gradient)
        x = x + move.reshape(count, 3)
        if np.abs(move).max() <= 1e-13 * np.abs(x).max():
            break
    return {"positions": x, "velocities": (x - positions) / h}
