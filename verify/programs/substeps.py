"""Symplectic substeps."""

import numpy as np

PLUMBOB = {"step": {"method": "symplectic", "substeps": 5, "damper": "explicit"}}
SUBSTEPS = 5


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    substep = h / SUBSTEPS
    x, v = positions, velocities
    for _ in range(SUBSTEPS):
        forces = masses[:, None] * gravity
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            rate = (v[i] - v[j]) @ u
            pull = (stiffnesses[s] * (length - rest_lengths[s]) + dampings[s] * rate) * u
            forces[i] -= pull
            forces[j] += pull
        v = v + substep * forces / masses[:, None]
        v[pinned] = 0.0
        x = x + substep * v
    return {"positions": x, "velocities": v}
