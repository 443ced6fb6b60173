"""Forces term by term."""

import numpy as np


def mass_spring_forces(
    masses, springs, rest_lengths, stiffnesses, dampings, gravity, positions, velocities
):
    forces = np.zeros((len(masses), 3))
    for i in range(len(masses)):
        forces[i] += masses[i] * gravity
    for s in range(len(springs)):
        i, j = springs[s][0], springs[s][1]
        d = positions[j] - positions[i]
        length = np.linalg.norm(d)
        if length == 0.0:
            continue
        u = d / length
        stretch = length - rest_lengths[s]
        spring = stiffnesses[s] * stretch * u
        forces[i] += spring
        forces[j] -= spring
        speed = velocities[j] - velocities[i]
        damper = dampings[s] * (speed @ u) * u
        forces[i] += damper
        forces[j] -= damper
    return forces
