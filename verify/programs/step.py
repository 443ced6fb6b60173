"""Symplectic step."""

import numpy as np

PLUMBOB = {
    "system": {"tension_only": True},
    "step": {"method": "symplectic", "damper": "explicit"},
}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h, tension_only=None):
    forces = masses[:, None] * gravity
    for s in range(len(springs)):
        i, j = springs[s]
        k, c, rest = stiffnesses[s], dampings[s], rest_lengths[s]
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length if length > 0.0 else np.zeros(3)
        rate = (velocities[i] - velocities[j]) @ u
        if tension_only is not None and tension_only[s] and length < rest:
            k = 0.0
        pull = (k * (length - rest) + c * rate) * u
        forces[i] -= pull
        forces[j] += pull
    v = velocities + h * forces / masses[:, None]
    v[pinned] = 0.0
    return {"positions": positions + h * v, "velocities": v}
