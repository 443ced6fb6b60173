"""Inverse kinematics of robots, Levenberg-Marquardt."""

import numpy as np

from .parts.rotations import conjugate, multiply, rotate


def kinematics(robot, q):
    """Return the positions and axes of all joints, and the position and rotation of the tool."""
    parents, slides = robot["parents"], robot["slides"]
    x, axes, R = np.zeros((len(q), 3)), np.zeros((len(q), 3)), np.zeros((len(q), 4))
    for j in range(len(q)):
        p = parents[j]
        base = (x[p], R[p]) if p >= 0 else (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        x[j] = base[0] + rotate(base[1], robot["origins"][j])
        R[j] = multiply(base[1], robot["orientations"][j])
        axis = robot["axes"][j]
        axes[j] = rotate(R[j], axis)
        if slides[j]:
            x[j] = x[j] + q[j] * axes[j]
        else:
            R[j] = multiply(R[j], np.array([np.cos(q[j] / 2), *(np.sin(q[j] / 2) * axis)]))
    j = robot["effector"]
    position = x[j] + rotate(R[j], robot["tool_position"])
    return x, axes, position, multiply(R[j], robot["tool_rotation"])


def error_of(tool, target_position, target_rotation):
    """Return the displacement to the target [m] and the rotation vector to it [rad]."""
    position, rotation = tool
    d = multiply(target_rotation, conjugate(rotation))
    d = d if d[0] >= 0.0 else -d
    sine = np.linalg.norm(d[1:])
    vector = 2.0 * np.arctan2(sine, d[0]) / sine * d[1:] if sine > 0.0 else 2.0 * d[1:]
    return np.concatenate([target_position - position, vector])


def jacobian(robot, q):
    """Return the velocities of the tool, linear and angular, by joint (6, joint)."""
    x, axes, position, _ = kinematics(robot, q)
    J, j = np.zeros((6, len(q))), robot["effector"]
    while j >= 0:
        if robot["slides"][j]:
            J[:3, j] = axes[j]
        else:
            J[:, j] = [*np.cross(axes[j], position - x[j]), *axes[j]]
        j = robot["parents"][j]
    return J


def robot_inverse_kinematics(start, lower, upper, target_position, target_rotation,
                             tolerance, tolerance_rotation, max_iterations, **robot):
    q, damping = start.copy(), 1e-3
    error = error_of(kinematics(robot, q)[2:], target_position, target_rotation)
    for _ in range(max_iterations):
        if (np.linalg.norm(error[:3]) <= tolerance
                and np.linalg.norm(error[3:]) <= tolerance_rotation):
            break
        J = jacobian(robot, q)
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
