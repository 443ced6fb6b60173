"""Forces by components."""

import numpy as np


def mass_spring_forces(
    masses, springs, rest_lengths, stiffnesses, dampings, gravity, positions, velocities
):
    n = len(masses)
    fx, fy, fz = np.zeros(n), np.zeros(n), np.zeros(n)
    for i in range(n):
        fx[i] += masses[i] * gravity[0]
        fy[i] += masses[i] * gravity[1]
        fz[i] += masses[i] * gravity[2]
    for s in range(len(springs)):
        i, j = springs[s][0], springs[s][1]
        dx = positions[j][0] - positions[i][0]
        dy = positions[j][1] - positions[i][1]
        dz = positions[j][2] - positions[i][2]
        length = np.sqrt(dx**2 + dy**2 + dz**2)
        if length == 0.0:
            continue
        nx, ny, nz = dx / length, dy / length, dz / length
        vx = velocities[j][0] - velocities[i][0]
        vy = velocities[j][1] - velocities[i][1]
        vz = velocities[j][2] - velocities[i][2]
        rate = vx * nx + vy * ny + vz * nz
        pull = stiffnesses[s] * (length - rest_lengths[s]) + dampings[s] * rate
        px, py, pz = pull * nx, pull * ny, pull * nz
        fx[i] += px
        fy[i] += py
        fz[i] += pz
        fx[j] -= px
        fy[j] -= py
        fz[j] -= pz
    return np.stack([fx, fy, fz], axis=1)
