"""Energy in loops."""

import numpy as np


def energy(masses, springs, rest_lengths, stiffnesses, gravity, positions, velocities):
    kinetic = elastic = gravitational = 0.0
    for i in range(len(masses)):
        speed = np.linalg.norm(velocities[i])
        kinetic += 0.5 * masses[i] * speed**2
        gravitational -= masses[i] * (gravity @ positions[i])
    for s in range(len(springs)):
        i, j = springs[s][0], springs[s][1]
        length = np.linalg.norm(positions[i] - positions[j])
        stretch = length - rest_lengths[s]
        elastic += 0.5 * stiffnesses[s] * stretch**2
    potential = elastic + gravitational
    total = kinetic + elastic + gravitational
    return {"total": total, "kinetic": kinetic, "potential": potential,
            "elastic": elastic, "gravitational": gravitational}
