"""The equation of a step to a tool's target, J dq = e, by screws (Lynch & Park 2017, 6.2)."""

import numpy as np

from .parts.screws import adjoint, hat, inverse, matrix, pose, screws_of, spatial_jacobian


def logarithm(T):
    """Return the twist that leads to a pose in unit time, its angular part first."""
    R, p = T[:3, :3], T[:3, 3]
    sines = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine = np.linalg.norm(sines)
    angle = np.arctan2(sine, 0.5 * (np.trace(R) - 1.0))
    if sine == 0.0:
        return np.concatenate([sines, p])
    K = hat(sines / sine)
    half = 0.5 * angle
    G = np.eye(3) - half * K + (1.0 - half / np.tan(half)) * K @ K
    return np.concatenate([angle / sine * sines, G @ p])


def tool_step(q, target_position, target_rotation, **robot):
    path, screws, home = screws_of(**robot)
    J, T = spatial_jacobian(q, path, screws)
    tool = T @ home
    target = pose(matrix(target_rotation), target_position)
    e = logarithm(inverse(tool) @ target)
    return adjoint(inverse(tool)) @ J, e
