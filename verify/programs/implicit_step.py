"""Implicit step."""

import numpy as np

from .parts.implicit_step import converged, lengths_at

PLUMBOB = {
    "system": {"tension_only": True},
    "step": {"method": "converged", "damper": "length_rate", "pins": "eliminated"},
}


def mass_spring_step(masses, springs, rest_lengths, stiffnesses, dampings,
                     pinned, gravity, positions, velocities, h, tension_only=None):
    slackable = np.zeros(len(springs), bool) if tension_only is None else tension_only
    weights = masses[:, None] * gravity
    lengths_n = lengths_at(positions, springs)
    y = positions + h * velocities
    x = converged(y, masses, springs, rest_lengths, stiffnesses, dampings, slackable, pinned, weights, h, lengths_n)
    return {"positions": x, "velocities": (x - positions) / h}
