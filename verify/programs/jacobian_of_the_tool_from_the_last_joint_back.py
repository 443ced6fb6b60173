"""Jacobian of the tool from the last joint back."""

import numpy as np

from .parts.screws import adjoint, exponential, inverse, matrix, pose


def robot_jacobian(q, parents, effector, origins, orientations, axes, slides, tool_position,
                   tool_rotation, **robot):
    J, j = np.zeros((6, len(q))), effector
    T = pose(matrix(tool_rotation), tool_position)  # of the tool, in the frame of joint j
    while j >= 0:
        screw = np.zeros(6)
        screw[3 * slides[j] : 3 * slides[j] + 3] = axes[j]
        J[:, j] = adjoint(inverse(T)) @ screw
        link = pose(matrix(orientations[j]), origins[j])
        T = link @ exponential(screw, q[j]) @ T
        j = parents[j]
    return {"jacobian": J}
