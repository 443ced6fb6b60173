"""Symplectic motion."""

import numpy as np

PLUMBOB = {"step": {"method": "symplectic"}}


def mass_spring_motion(masses, springs, rest_lengths, stiffnesses, dampings,
                       pinned, gravity, positions, velocities, h, steps):
    x, v, frames = positions, velocities, []
    for _ in range(steps):
        forces = masses[:, None] * gravity
        for s in range(len(springs)):
            i, j = springs[s]
            d = x[i] - x[j]
            length = np.linalg.norm(d)
            u = d / length if length > 0.0 else np.zeros(3)
            rate = (v[i] - v[j]) @ u
            pull = (stiffnesses[s] * (length - rest_lengths[s]) + dampings[s] * rate) * u
            forces[i] -= pull
            forces[j] += pull
        v = v + h * forces / masses[:, None]
        v[pinned] = 0.0
        x = x + h * v
        frames.append((x, v))
    return {"positions": np.array([x for x, _ in frames]),
            "velocities": np.array([v for _, v in frames])}
