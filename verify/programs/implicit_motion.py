"""Implicit motion."""

import numpy as np

from .parts.implicit_step import converged, lengths_at

PLUMBOB = {"step": {"method": "converged", "damper": "length_rate", "pins": "eliminated"}}


def mass_spring_motion(masses, springs, rest_lengths, stiffnesses, dampings,
                       pinned, gravity, positions, velocities, h, steps):
    x, v, frames = positions, velocities, []
    slackable = np.zeros(len(springs), bool)
    for _ in range(steps):
        weights = masses[:, None] * gravity
        lengths_n = lengths_at(x, springs)
        y = x + h * v
        before = x
        x = converged(y, masses, springs, rest_lengths, stiffnesses, dampings, slackable, pinned, weights, h, lengths_n)
        v = (x - before) / h
        frames.append((x, v))
    return {"positions": np.array([x for x, _ in frames]),
            "velocities": np.array([v for _, v in frames])}
