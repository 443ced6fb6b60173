"""Inverse kinematics of robots, Levenberg-Marquardt."""

import numpy as np

from .parts.tool import error_of, jacobian, kinematics


def robot_inverse_kinematics(start, lower, upper, target_position, target_rotation,
                             tolerance, tolerance_rotation, max_iterations, **robot):
    q, damping = start.copy(), 1e-3
    error = error_of(kinematics(robot, q)[2:], target_position, target_rotation)
    for _ in range(max_iterations):
        if (np.linalg.norm(error[:3]) <= tolerance
                and np.linalg.norm(error[3:]) <= tolerance_rotation):
            break
        x, axes, position, rotation = kinematics(robot, q)
        J = jacobian(robot, x, axes, position)
        downhill = J.T @ error
        J[:, ((q <= lower) & (downhill < 0.0)) | ((q >= upper) & (downhill > 0.0))] = 0.0
        step = np.linalg.solve(J.T @ J + damping * np.eye(len(q)), J.T @ error)
        trial = np.clip(q + step, lower, upper)
        trial_error = error_of(kinematics(robot, trial)[2:], target_position, target_rotation)
        if np.linalg.norm(trial_error) < np.linalg.norm(error):
            q, error, damping = trial, trial_error, max(damping / 4.0, 1e-12)
        else:
            damping = 4.0 * damping
    return {"q": q}
