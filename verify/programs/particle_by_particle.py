"""Particle by particle."""

import numpy as np

PLUMBOB = {"step": {"method": "symplectic", "damper": "explicit"}}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h):
    x, v = positions.copy(), velocities.copy()

    def force_on(particle):
        force = masses[particle] * gravity
        for s in range(len(springs)):
            if particle in springs[s]:
                other = springs[s].sum() - particle
                d = x[particle] - x[other]
                length = np.linalg.norm(d)
                u = d / length
                rate = (v[particle] - v[other]) @ u
                pull = stiffnesses[s] * (length - rest_lengths[s]) + dampings[s] * rate
                force = force - pull * u
        return force

    forces = [force_on(i) for i in range(len(masses))]
    for i in np.setdiff1d(np.arange(len(masses)), pinned):
        v[i] += h * forces[i] / masses[i]
        x[i] += h * v[i]
    return {"positions": x, "velocities": v}
