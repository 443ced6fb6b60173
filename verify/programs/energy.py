"""Energy."""

import numpy as np


def energy(masses, springs, rest_lengths, stiffnesses, gravity, positions, velocities):
    kinetic = 0.5 * np.sum(masses[:, None] * velocities**2)
    gravitational = -np.sum(masses[:, None] * gravity * positions)
    d = positions[springs[:, 0]] - positions[springs[:, 1]]
    lengths = np.linalg.norm(d, axis=1)
    elastic = np.sum(0.5 * stiffnesses * (lengths - rest_lengths) ** 2)
    potential = elastic + gravitational
    return {"total": kinetic + potential, "kinetic": kinetic, "potential": potential,
            "elastic": elastic, "gravitational": gravitational}
