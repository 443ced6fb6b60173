"""Forces of arrays."""

import numpy as np


def mass_spring_forces(
    masses, springs, rest_lengths, stiffnesses, dampings, gravity, positions, velocities
):
    i, j = springs.T
    d = positions[i] - positions[j]
    lengths = np.linalg.norm(d, axis=1)
    u = d / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    rates = np.sum((velocities[i] - velocities[j]) * u, axis=1)
    pulls = (stiffnesses * (lengths - rest_lengths) + dampings * rates)[:, None] * u
    forces = masses[:, None] * gravity
    np.subtract.at(forces, i, pulls)
    np.add.at(forces, j, pulls)
    return forces
