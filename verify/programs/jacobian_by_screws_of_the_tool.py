"""Jacobian by screws of the tool."""

import numpy as np

from .parts.screws import adjoint, exponential, inverse, screws_of


def robot_jacobian(q, **robot):
    path, screws, home = screws_of(**robot)
    B = screws @ adjoint(inverse(home)).T  # the screws in the tool's frame at q = 0
    J, back, tool = np.zeros((6, len(q))), np.eye(4), home.copy()
    for j in path[::-1]:
        J[:, j] = adjoint(back) @ B[j]
        back = back @ exponential(B[j], -q[j])
    for j in path:
        tool = tool @ exponential(B[j], q[j])
    R = tool[:3, :3]
    return {"jacobian": np.concatenate([R @ J[3:], R @ J[:3]])}
