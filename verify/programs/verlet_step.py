"""Verlet step."""

import numpy as np

PLUMBOB = {"step": {"method": "symplectic", "order": "velocities_first", "damper": "explicit"}}
DAMPER = "explicit"


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    previous = positions - h * velocities
    w = 1.0 / masses
    w[pinned] = 0.0
    a = np.zeros((len(masses), 3))
    for i in range(len(masses)):
        a[i] += gravity
    for s in range(len(springs)):
        i, j = springs[s][0], springs[s][1]
        d = positions[j] - positions[i]
        length = np.linalg.norm(d)
        if length == 0.0:
            continue
        u = d / length
        spring = stiffnesses[s] * (length - rest_lengths[s]) * u
        a[i] += w[i] * spring
        a[j] -= w[j] * spring
        if DAMPER != "none":
            speed = (velocities[j] - velocities[i]) @ u
            damper = dampings[s] * speed * u
            a[i] += w[i] * damper
            a[j] -= w[j] * damper
    x = positions.copy()
    for i in range(len(masses)):
        if w[i] > 0.0:
            x[i] = 2.0 * positions[i] - previous[i] + h**2 * a[i]
    return {"positions": x, "velocities": (x - positions) / h}
