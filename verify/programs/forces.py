"""Forces."""

import numpy as np


def mass_spring_forces(
    masses, springs, rest_lengths, stiffnesses, dampings, gravity, positions, velocities
):
    forces = masses[:, None] * gravity
    for s in range(len(springs)):
        i, j = springs[s]
        k, c, rest = stiffnesses[s], dampings[s], rest_lengths[s]
        d = positions[i] - positions[j]
        length = np.linalg.norm(d)
        u = d / length if length > 0.0 else np.zeros(3)
        rate = (velocities[i] - velocities[j]) @ u
        pull = (k * (length - rest) + c * rate) * u
        forces[i] -= pull
        forces[j] += pull
    return forces
