"""Hinges and cones."""

import numpy as np

from .parts.hinges import about, nearest, twist_of, within, wrapped
from .parts.kinematics import bend, between, kinematics, path_to
from .parts.rotations import conjugate, multiply, rotate

PLUMBOB = {"limits": True}


def hinge_angle(q, axis, lower, upper, a, b):
    """Return the angle of a hinge that brings a nearest to the direction of b."""
    sine = np.cross(a, b) @ axis
    cosine = a @ b - (a @ axis) * (b @ axis)
    angle = twist_of(q, axis) + np.arctan2(sine, cosine)
    return nearest(wrapped(angle), lower, upper)


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
            if axes is not None and cones[joint] == 0.0:
                angle = hinge_angle(q[joint], axes[joint], lower[joint], upper[joint], a, b)
                q[joint] = about(axes[joint], angle)
            else:
                q[joint] = multiply(between(a, b), q[joint])
                q[joint] = q[joint] / np.linalg.norm(q[joint])
                if axes is not None:
                    q[joint] = within(q[joint], axes[joint], cones[joint], lower[joint], upper[joint])
            x, R = kinematics(parents, offsets, q)
        sweeps += 1
    return {"local_rotations": q, "iterations": sweeps}
