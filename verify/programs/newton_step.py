"""Newton step."""

import numpy as np

PLUMBOB = {
    "system": {"external_forces": True},
    "step": {"method": "newton", "damper": "explicit", "pins": "eliminated"},
}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h, external_forces=0.0):
    count, inertia = len(masses), masses
    free = np.setdiff1d(np.arange(count), pinned)
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    weights = masses[:, None] * gravity
    forces = weights + external_forces
    for s in range(len(springs)):
        i, j = springs[s]
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length if length > 0.0 else np.zeros(3)
        damper = dampings[s] * ((velocities[i] - velocities[j]) @ u) * u
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
            pull = h**2 * k * (length - rest) * u
            gradient[i] += pull
            gradient[j] -= pull
            along = np.outer(u, u)
            across = max(0.0, 1.0 - rest / length) * (np.eye(3) - along) if length > 0.0 else 0.0
            block = h**2 * k * (along + across)
            hessian[i, :, i] += block
            hessian[j, :, j] += block
            hessian[i, :, j] -= block
            hessian[j, :, i] -= block
        return gradient.ravel()[rows], hessian.reshape(3 * count, 3 * count)[np.ix_(rows, rows)]

    x = positions.copy()
    for _ in range(500):
        gradient, hessian = gradient_and_hessian(x)
        move = np.zeros(3 * count)
        move[rows] = np.linalg.solve(hessian, -gradient)
        x = x + move.reshape(count, 3)
        if np.abs(move).max() <= 1e-13 * np.abs(x).max():
            break
    return {"positions": x, "velocities": (x - positions) / h}
