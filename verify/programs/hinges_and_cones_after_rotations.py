"""Hinges and cones after rotations."""

import numpy as np

from .parts.hinges import about, within
from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import conjugate, multiply, rotate

PLUMBOB = {"limits": True}


def aim(axis, cone, a, b):
    """Return the rotation of a to b, of a hinge that about its axis."""
    if cone > 0.0:
        return between(a, b)
    sine = np.cross(a, b) @ axis
    cosine = a @ b - (a @ axis) * (b @ axis)
    return about(axis, np.arctan2(sine, cosine))


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations,
        axes=None, cones=None, lower=None, upper=None):
    q = local_rotations.copy()
    if max_iterations > 1 and axes is None:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            a, b, p = x[effector] - x[joint], target - x[joint], parents[joint]
            if p >= 0:
                back = conjugate(R[p])  # into the frame of the parent
                a, b = rotate(back, a), rotate(back, b)
            d = between(a, b) if axes is None else aim(axes[joint], cones[joint], a, b)
            q[joint] = multiply(d, q[joint])
            q[joint] = q[joint] / np.linalg.norm(q[joint])
            if axes is not None:
                q[joint] = within(q[joint], axes[joint], cones[joint], lower[joint], upper[joint])
            x, R = kinematics(parents, offsets, q)
        sweeps += 1
    return {"local_rotations": q, "iterations": sweeps}
