"""Velocity by screws."""

import numpy as np

from .parts.screws import screws_of, spatial_jacobian


def pseudo_inverse(J):
    U, s, V = np.linalg.svd(J, full_matrices=False)
    kept = s > 1e-8 * s[0]
    U, s, V = U[:, kept], s[kept], V[kept]
    return (V.T / s) @ U.T


def robot_velocity(q, linear_velocity, angular_velocity, **robot):
    path, screws, home = screws_of(**robot)
    J, T = spatial_jacobian(q, path, screws)
    tool = T @ home
    w, v, p = angular_velocity, linear_velocity, tool[:3, 3]
    v_spatial = v - np.cross(w, p)
    return {"velocities": pseudo_inverse(J) @ np.concatenate([w, v_spatial])}
