"""Robot track."""

import math

import numpy as np


def multiply(a, b):
    p, q, r, s = a
    w, x, y, z = b
    return (p * w - q * x - r * y - s * z, p * x + q * w + r * z - s * y,
            p * y - q * z + r * w + s * x, p * z + q * y - r * x + s * w)


def conjugate(q):
    return q[0], -q[1], -q[2], -q[3]


def rotate(q, v):
    return multiply(multiply(q, (0.0, *v)), conjugate(q))[1:]


def kinematics(robot, q):
    """Return the position and rotation of the tool, and its Jacobian (6, joint)."""
    x, R = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    origins, axes = [], []
    for j in range(len(q)):
        x = [a + b for a, b in zip(x, rotate(R, robot["origins"][j].tolist()))]
        R = multiply(R, robot["orientations"][j].tolist())
        axis = robot["axes"][j].tolist()
        origins.append(x)
        axes.append(rotate(R, axis))
        if robot["slides"][j]:
            x = [a + q[j] * b for a, b in zip(x, axes[j])]
            continue
        sine = math.sin(q[j] / 2)
        R = multiply(R, (math.cos(q[j] / 2), *(sine * a for a in axis)))
    x = [a + b for a, b in zip(x, rotate(R, robot["tool_position"].tolist()))]
    R, axes = multiply(R, robot["tool_rotation"].tolist()), np.array(axes)
    J = np.concatenate([np.cross(axes, np.array(x) - origins), axes], axis=1).T
    slides = robot["slides"]
    J[:3, slides], J[3:, slides] = axes[slides].T, 0.0
    return np.array(x), R, J


def matrix(R):
    return np.array([rotate(R, e) for e in np.eye(3).tolist()]).T


def error_of(position, rotation, target_position, target_rotation):
    """Return the displacement to the target [m] and the rotation vector to it [rad]."""
    d = multiply(target_rotation.tolist(), conjugate(rotation))
    d = d if d[0] >= 0.0 else tuple(-a for a in d)
    v = np.array(d[1:])
    sine = np.linalg.norm(v)
    v = 2.0 * math.atan2(sine, d[0]) / max(sine, 1e-12) * v
    return np.concatenate([target_position - position, v])


def robot_track(start, lower, upper, target_positions, target_rotations, h,
                tolerance, tolerance_rotation, max_iterations, **robot):
    q, frames = start.copy(), []
    for i in range(len(target_positions)):
        for _ in range(min(max_iterations, 20)):
            position, rotation, J = kinematics(robot, q.tolist())
            error = error_of(position, rotation, target_positions[i], target_rotations[i])
            if max(np.linalg.norm(error[:3]), np.linalg.norm(error[3:])) < 0.1 * tolerance_rotation:
                break
            damping = 1e-6 + 0.1 * min(error @ error, 1.0)
            step = J.T @ np.linalg.solve(J @ J.T + damping * np.eye(6), error)
            q = np.clip(q + step, lower, upper)
        frames.append(q)
    q = np.array(frames)
    return {"q": q, "velocities": np.diff(q, axis=0, prepend=start[None]) / h}
