"""Energy by components."""

import numpy as np


def energy(masses, springs, rest_lengths, stiffnesses, gravity, positions, velocities):
    kinetic = elastic = gravitational = 0.0
    for i in range(len(masses)):
        x, y, z = positions[i]
        vx, vy, vz = velocities[i]
        kinetic += 0.5 * masses[i] * (vx**2 + vy**2 + vz**2)
        gravitational -= masses[i] * (gravity[0] * x + gravity[1] * y + gravity[2] * z)
    for s in range(len(springs)):
        i, j = springs[s][0], springs[s][1]
        dx = positions[j][0] - positions[i][0]
        dy = positions[j][1] - positions[i][1]
        dz = positions[j][2] - positions[i][2]
        length = np.sqrt(dx**2 + dy**2 + dz**2)
        elastic += 0.5 * stiffnesses[s] * (length - rest_lengths[s]) ** 2
    potential = elastic + gravitational
    total = kinetic + potential
    return {"total": total, "kinetic": kinetic, "potential": potential,
            "elastic": elastic, "gravitational": gravitational}
