"""Limited ccd."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to, turned
from .parts.rotations import multiply

PLUMBOB = {"limits": True}


def about(axis, angle):
    return np.array([np.cos(angle / 2.0), *(np.sin(angle / 2.0) * axis)])


def within(q, axis, cone, lower, upper):
    """Return a rotation with the tilt of an axis and the twist about it within limits."""
    twist = 2.0 * np.arctan2(q[1:] @ axis, q[0])
    twist = (twist + np.pi) % (2.0 * np.pi) - np.pi
    swing = multiply(q, about(axis, -twist))
    swing = swing if swing[0] >= 0.0 else -swing
    sine = np.linalg.norm(swing[1:])
    tilt = 2.0 * np.arctan2(sine, swing[0])
    if tilt > cone:
        swing = about(swing[1:] / sine, cone)
    return multiply(swing, about(axis, np.clip(twist, lower, upper)))


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations,
        axes=None, cones=None, lower=None, upper=None):
    q = local_rotations.copy()
    if max_iterations > 1 and axes is None:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            d = between(x[effector] - x[joint], target - x[joint])
            q[joint] = turned(parents, R, joint, d, q[joint])
            if axes is not None:
                q[joint] = within(q[joint], axes[joint], cones[joint], lower[joint], upper[joint])
            x, R = kinematics(parents, offsets, q)
        sweeps += 1
    return {"local_rotations": q, "iterations": sweeps}
