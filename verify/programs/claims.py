"""CCD with all claims of an answer."""

import numpy as np

from .parts.kinematics import bend, between, kinematics, path_to, turned

PLUMBOB = {"methods": ["ccd"]}


def inverse_kinematics(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations
):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    x, R = kinematics(parents, offsets, q)
    distance = np.linalg.norm(x[effector] - target)
    sweeps = 0
    while sweeps < max_iterations and distance > tolerance:
        for joint in path_to(parents, effector)[1:]:
            d = between(x[effector] - x[joint], target - x[joint])
            q[joint] = turned(parents, R, joint, d, q[joint])
            x, R = kinematics(parents, offsets, q)
        distance = np.linalg.norm(x[effector] - target)
        sweeps += 1
    residual, converged = distance, distance <= tolerance
    return {"local_rotations": q, "positions": x, "residual": residual,
            "converged": bool(converged), "iterations": sweeps}
