"""The equation of a step to a tool's target, J dq = e, by matrices."""

import numpy as np

from .parts.mechanism import matrix, tool_jacobian


def rotation_vector(R):
    """Return the axis of a rotation matrix times its angle [rad]."""
    sines = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.linalg.norm(sines)
    cosine = 0.5 * (np.trace(R) - 1.0)
    angle = np.arctan2(sine, cosine)
    return angle / sine * sines if sine > 0.0 else sines


def tool_step(q, target_position, target_rotation, **robot):
    J, tool, R = tool_jacobian(q, **robot)
    R_target = matrix(target_rotation)
    e = np.concatenate([target_position - tool, rotation_vector(R_target @ R.T)])
    return J, e
