"""Right inverse kinematics in sixteen forms, honest choices all; FORM says which."""

import os

import numpy as np

FORM = os.environ.get("FORM", "ccd")
FLOAT = np.float32 if "single" in FORM else np.float64
PLUMBOB = {"methods": ["fabrik" if "fabrik" in FORM else "ccd"]}
if "single" in FORM:
    PLUMBOB["precision"] = "single"
if "mine" in FORM:
    PLUMBOB["methods"] = ["mine"]
if "chain" in FORM:
    PLUMBOB |= {"chains_only": True, "effector": "last", "rotations": False}
if "fixed" in FORM:
    PLUMBOB["fixed"] = {"max_iterations": 40, "tolerance": 1e-3}


def mul(a, b):
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector], FLOAT)


def act(q, v):
    return (v + 2 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v)).astype(FLOAT)


def conj(q):
    return q * np.array([1, -1, -1, -1], FLOAT)


def unit(v):
    return v / np.linalg.norm(v)


def arc(a, b):
    """Return the shortest rotation from a to b: by half vectors, or by axis and angle."""
    a, b = unit(a), unit(b)
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis)
    if "angle" in FORM or "damped" in FORM:
        if sine < 1e-9:
            return np.array([1, 0, 0, 0], FLOAT)
        angle = np.arctan2(sine, a @ b)
        if "damped" in FORM:
            angle = min(angle, 0.4)
        return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis / sine)], FLOAT)
    q = np.array([1 + a @ b, *axis], FLOAT)
    return unit(q) if np.linalg.norm(q) > 1e-7 else np.array([1, 0, 0, 0], FLOAT)


def pose(parents, offsets, local):
    x, r = offsets.astype(FLOAT), local.astype(FLOAT)
    for j in range(1, len(parents)):
        x[j] = x[parents[j]] + act(r[parents[j]], x[j])
        r[j] = mul(r[parents[j]], r[j])
    return x, r


def aim(skeleton, local, joint, tip, goal):
    """Turn a joint so that the tip points to the goal, in the world or in the joint's frame."""
    parents, _ = skeleton
    x, r = pose(*skeleton, local)
    if "inside" in FORM:
        now, then = act(conj(r[joint]), x[tip] - x[joint]), act(conj(r[joint]), goal - x[joint])
        local[joint] = unit(mul(local[joint], arc(now, then)))
        return
    world = mul(arc(x[tip] - x[joint], goal - x[joint]), r[joint])
    local[joint] = unit(mul(conj(r[parents[joint]]), world) if parents[joint] >= 0 else world)


def distance(skeleton, local, tip, goal):
    return np.linalg.norm(pose(*skeleton, local)[0][tip] - goal)


def sweep_ccd(skeleton, local, path, goal, tolerance):
    tip, joints = path[-1], path[-2::-1]
    if "rootfirst" in FORM:
        joints = path[:-1]
    for joint in joints:
        aim(skeleton, local, joint, tip, goal)
        if "early" in FORM and distance(skeleton, local, tip, goal) <= tolerance:
            return


def points_fabrik(points, goal, tolerance, limit):
    base, lengths = points[0].copy(), np.linalg.norm(np.diff(points, axis=0), axis=1)
    if "straight" in FORM and np.linalg.norm(goal - base) > lengths.sum():
        return base + np.vstack([np.zeros(3), np.outer(np.cumsum(lengths), unit(goal - base))])
    for _ in range(limit):
        if "before" in FORM and np.linalg.norm(points[-1] - goal) <= tolerance:
            break
        points[-1] = goal
        for i in range(len(lengths) - 1, -1, -1):
            points[i] = points[i + 1] + lengths[i] * unit(points[i] - points[i + 1])
        points[0] = base
        for i, length in enumerate(lengths):
            points[i + 1] = points[i] + length * unit(points[i + 1] - points[i])
        if np.linalg.norm(points[-1] - goal) <= tolerance:
            break
    return points


def inverse_kinematics(
    parents, offsets, local_rotations, target, effector, tolerance, max_iterations
):
    skeleton, local = (parents, offsets), local_rotations.astype(FLOAT)
    goal, path = target.astype(FLOAT), [int(effector)]
    while parents[path[0]] >= 0:
        path.insert(0, int(parents[path[0]]))
    if "constant" in FORM or "fixed" in FORM:
        tolerance, max_iterations = 1e-3, 40
    if "fabrik" in FORM:
        points = points_fabrik(pose(*skeleton, local)[0][path], goal, tolerance, max_iterations)
        if "chain" in FORM:
            return {"positions": points}
        for i, joint in enumerate(path[:-1]):
            if "reset" in FORM:  # twists are not kept: the shortest arcs from the plain pose
                local[joint] = [1, 0, 0, 0]
            x, _ = pose(*skeleton, local)
            aim(skeleton, local, joint, path[i + 1], x[joint] + points[i + 1] - points[i])
        return {"local_rotations": local}
    for _ in range(max_iterations):
        sweep_ccd(skeleton, local, path, goal, tolerance)
        if distance(skeleton, local, effector, goal) <= tolerance:
            break
    return {"local_rotations": local}
