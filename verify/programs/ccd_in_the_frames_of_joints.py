"""CCD in the frames of joints."""

import numpy as np

from .parts.kinematics import bend, between, kinematics
from .parts.rotations import conjugate, multiply, rotate


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(x[effector] - target) > tolerance:
        tip, joint = offsets[effector], parents[effector]  # in the frame of the joint
        while joint >= 0:
            p = parents[joint]
            back = conjugate(R[p]) if p >= 0 else np.array([1.0, 0.0, 0.0, 0.0])
            arm = rotate(q[joint], tip)  # in the frame of the parent
            goal = rotate(back, target - x[joint])
            turn = between(arm, goal)
            q[joint] = multiply(turn, q[joint])
            q[joint] = q[joint] / np.linalg.norm(q[joint])
            tip = offsets[joint] + rotate(q[joint], tip)
            joint = p
        x, R = kinematics(parents, offsets, q)
        sweeps += 1
    return {"local_rotations": q, "positions": x, "iterations": sweeps}
