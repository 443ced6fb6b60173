"""Runge and Kutta's step."""

import numpy as np

PLUMBOB = {"step": {"damper": "explicit"}}
DAMPER = "explicit"


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    def accelerations(x, v):
        forces = masses[:, None] * gravity
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            pull = stiffnesses[s] * (length - rest_lengths[s]) * u
            if DAMPER != "none":
                pull += dampings[s] * ((v[i] - v[j]) @ u) * u
            forces[i] -= pull
            forces[j] += pull
        a = forces / masses[:, None]
        a[pinned] = 0.0
        return a

    x, v = positions, velocities
    v1, a1 = v, accelerations(x, v)
    v2 = v + 0.5 * h * a1
    a2 = accelerations(x + 0.5 * h * v1, v2)
    v3 = v + 0.5 * h * a2
    a3 = accelerations(x + 0.5 * h * v2, v3)
    v4 = v + h * a3
    a4 = accelerations(x + h * v3, v4)
    x = x + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
    v = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    return {"positions": x, "velocities": v}
