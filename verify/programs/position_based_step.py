"""Position-based step."""

import numpy as np

PLUMBOB = {"step": {"method": "position_based"}}
COMPLIANT, SWEEPS = False, 1


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    w = 1.0 / masses
    w[pinned] = 0.0
    v = velocities + h * gravity
    v[pinned] = 0.0
    x = positions + h * v
    multipliers = np.zeros(len(springs))
    for _ in range(SWEEPS):
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            compliance = 0.0
            if COMPLIANT:
                compliance = 1.0 / (max(stiffnesses[s], 1e-300) * h**2)
            total = w[i] + w[j] + compliance
            if length == 0.0 or total == 0.0:
                continue
            error = length - rest_lengths[s]
            change = -(error + compliance * multipliers[s]) / total
            multipliers[s] += change
            x[i] += w[i] * change * d / length
            x[j] -= w[j] * change * d / length
    return {"positions": x, "velocities": (x - positions) / h}
