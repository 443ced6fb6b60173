"""Velocity by singular values."""

import numpy as np

from .parts.mechanism import tool_jacobian


def robot_velocity(q, linear_velocity, angular_velocity, **robot):
    J, tool, tool_rotation = tool_jacobian(q, **robot)
    U, s, V = np.linalg.svd(J, full_matrices=False)
    kept = s > 1e-8 * s[0]
    U, s, V = U[:, kept], s[kept], V[kept]
    inverse = (V.T / s) @ U.T
    return {"velocities": inverse @ np.concatenate([linear_velocity, angular_velocity])}
