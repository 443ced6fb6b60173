"""CCD by axis and angle."""

import numpy as np

from .parts.kinematics import bend, kinematics
from .parts.rotations import conjugate, multiply, rotate


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        joint = parents[effector]
        while joint >= 0:
            back = conjugate(R[joint])  # into the frame of the joint
            a = rotate(back, x[effector] - x[joint])
            b = rotate(back, target - x[joint])
            axis = np.cross(a, b)
            sine, cosine = np.linalg.norm(axis), a @ b
            if sine > 1e-14 * (1.0 + a @ a):
                axis = axis / sine
                angle = np.arctan2(sine, cosine)
                half = angle / 2
                turn = np.array([np.cos(half), *(np.sin(half) * axis)])
                q[joint] = multiply(q[joint], turn)
                q[joint] = q[joint] / np.linalg.norm(q[joint])
            x, R = kinematics(parents, offsets, q)
            joint = parents[joint]
        sweeps += 1
    return {"local_rotations": q, "positions": x, "iterations": sweeps}
