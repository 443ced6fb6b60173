"""Symplectic step."""

import numpy as np

PLUMBOB = {
    "system": {"tension_only": True},
    "step": {"method": "symplectic", "order": "velocities_first", "damper": "explicit"},
}
METHOD, ORDER, DAMPER = "symplectic", "velocities_first", "explicit"


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h, tension_only=None):
    x = positions
    if ORDER == "positions_first":
        x = positions + h * velocities
        x[pinned] = positions[pinned]
    forces = masses[:, None] * gravity
    for s in range(len(springs)):
        i, j = springs[s]
        k, c, rest = stiffnesses[s], dampings[s], rest_lengths[s]
        if DAMPER == "none":
            c = 0.0
        d = x[i] - x[j]
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
    if ORDER == "positions_first":
        return {"positions": x, "velocities": v}
    moving = velocities if METHOD == "explicit" else v
    return {"positions": positions + h * moving, "velocities": v}
