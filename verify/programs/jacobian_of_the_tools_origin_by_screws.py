"""Jacobian of the tool's origin by screws."""

import numpy as np

from .parts.screws import hat, screws_of, spatial_jacobian


def robot_jacobian(q, **robot):
    path, screws, home = screws_of(**robot)
    J, T = spatial_jacobian(q, path, screws)
    tool = T @ home
    w, v = J[:3], J[3:]
    p = tool[:3, 3]
    return {"jacobian": np.concatenate([v - hat(p) @ w, w])}
