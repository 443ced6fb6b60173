"""Tracking by CCD."""

import numpy as np

from .parts.ccd import solve

PLUMBOB = {"methods": ["ccd"]}


def track(parents, offsets, local_rotations, curve, effector, tolerance, max_iterations):
    q, frames = local_rotations, []
    for target in curve:
        q = solve(parents, offsets, q, target, effector, tolerance, max_iterations)
        frames.append(q)
    return {"local_rotations": np.array(frames)}
