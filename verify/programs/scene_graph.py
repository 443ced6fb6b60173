"""CCD and FABRIK on a scene graph that marks stale joints."""

import numpy as np

from .parts.kinematics import bend, between, path_to
from .parts.rotations import conjugate, multiply, rotate


def place(tree, joint):
    """Place a joint, and those above it, where they are out of date."""
    parents, offsets, q, x, R, stale = tree
    if not stale[joint]:
        return
    p = parents[joint]
    if p < 0:
        x[joint], R[joint] = offsets[joint], q[joint]
    else:
        place(tree, p)
        R[joint] = multiply(R[p], q[joint])
        x[joint] = x[p] + rotate(R[p], offsets[joint])
    stale[joint] = False


def children_of(parents, joint):
    return [k for k in range(len(parents)) if parents[k] == joint]


def position(tree, joint):
    place(tree, joint)
    return tree[3][joint]


def turn(tree, joint, a, b):
    """Turn a joint, in its own frame, by the rotation from a to b in the world."""
    parents, offsets, q, x, R, stale = tree
    place(tree, joint)
    back = conjugate(R[joint])
    a, b = rotate(back, a), rotate(back, b)
    d = between(a, b)
    q[joint] = multiply(q[joint], d)
    q[joint] = q[joint] / np.linalg.norm(q[joint])
    stale[joint] = True
    descendants = children_of(parents, joint)
    for k in descendants:
        stale[k] = True
        descendants += children_of(parents, k)


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    tree = (parents, offsets, q, offsets.copy(), q.copy(), [True for _ in parents])
    sweeps = 0
    while sweeps < max_iterations and np.linalg.norm(position(tree, effector) - target) > tolerance:
        for joint in path_to(parents, effector)[1:]:
            here = position(tree, joint)
            a = position(tree, effector) - here
            turn(tree, joint, a, target - here)
        sweeps += 1
    positions = np.array([position(tree, joint) for joint in range(len(parents))])
    return {"local_rotations": q, "positions": positions, "iterations": sweeps}


def pull(fixed, moved, length):
    """Return a point at a distance from a fixed one, on the line to a moved one."""
    distance = np.linalg.norm(moved - fixed)
    return fixed + length / distance * (moved - fixed)


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    q = local_rotations.copy()
    if max_iterations > 1:
        bend(parents, offsets, q, target, effector)
    tree = (parents, offsets, q, offsets.copy(), q.copy(), [True for _ in parents])
    path = path_to(parents, effector)[::-1]
    last, sweeps = len(path) - 1, 0
    lengths = np.zeros(last)
    for k in range(last):
        lengths[k] = np.linalg.norm(offsets[path[k + 1]])
    reach = np.sum(lengths)
    while sweeps < max_iterations and np.linalg.norm(position(tree, effector) - target) > tolerance:
        points = [position(tree, joint).copy() for joint in path]
        root = points[0].copy()
        if np.linalg.norm(target - root) > reach:
            for k in range(last):
                points[k + 1][:] = pull(points[k], target, lengths[k])
        else:
            points[last][:] = target
            for k in range(last - 1, -1, -1):
                points[k][:] = pull(points[k + 1], points[k], lengths[k])
            points[0][:] = root
            for k in range(last):
                points[k + 1][:] = pull(points[k], points[k + 1], lengths[k])
        for k in range(last):
            joint, child = path[k], path[k + 1]
            here = position(tree, joint)
            a = position(tree, child) - here
            turn(tree, joint, a, points[k + 1] - here)
        sweeps += 1
    positions = np.array([position(tree, joint) for joint in range(len(parents))])
    return {"local_rotations": q, "positions": positions, "iterations": sweeps}
