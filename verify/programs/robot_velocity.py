"""Robot velocity."""

import numpy as np

from .parts.mechanism import tool_jacobian


def robot_velocity(q, linear_velocity, angular_velocity, **robot):
    J, tool, tool_rotation = tool_jacobian(q, **robot)
    twist = np.concatenate([linear_velocity, angular_velocity])
    return {"velocities": np.linalg.pinv(J, rcond=1e-6) @ twist}
