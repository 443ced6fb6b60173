"""FABRIK on the points of a path; the joints are turned afterwards, from the root outwards."""

import numpy as np


def compose(a, b):
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate(([scalar], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])))


def apply(q, v):
    return v + 2 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v)


def shortest_arc(a, b):
    q = np.concatenate(([np.linalg.norm(a) * np.linalg.norm(b) + a @ b], np.cross(a, b)))
    length = np.linalg.norm(q)
    return q / length if length > 1e-12 else np.array([1.0, 0.0, 0.0, 0.0])


def pose(parents, offsets, local):
    points, turns = np.zeros_like(offsets), np.zeros_like(local)
    for joint, parent in enumerate(parents):
        if parent < 0:
            points[joint], turns[joint] = offsets[joint], local[joint]
        else:
            points[joint] = points[parent] + apply(turns[parent], offsets[joint])
            turns[joint] = compose(turns[parent], local[joint])
    return points, turns


def reach(points, target, tolerance, max_iterations):
    """Move the points of a chain until the last one is at the target."""
    base, lengths = points[0].copy(), np.linalg.norm(np.diff(points, axis=0), axis=1)
    for _ in range(max_iterations):
        points[-1] = target
        for i in reversed(range(len(lengths))):
            line = points[i] - points[i + 1]
            points[i] = points[i + 1] + line * lengths[i] / np.linalg.norm(line)
        points[0] = base
        for i, length in enumerate(lengths):
            line = points[i + 1] - points[i]
            points[i + 1] = points[i] + line * length / np.linalg.norm(line)
        if np.linalg.norm(points[-1] - target) <= tolerance:
            break
    return points


def fabrik(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    path = [effector]
    while parents[path[0]] >= 0:
        path.insert(0, int(parents[path[0]]))
    local = local_rotations.copy()
    points, _ = pose(parents, offsets, local)
    goals = reach(points[path], target, tolerance, max_iterations)
    for here, there, start, end in zip(path[:-1], path[1:], goals[:-1], goals[1:], strict=True):
        points, turns = pose(parents, offsets, local)
        turn = shortest_arc(points[there] - points[here], end - start)
        wanted = compose(turn, turns[here])
        if here != path[0]:
            wanted = compose(turns[parents[here]] * [1, -1, -1, -1], wanted)
        local[here] = wanted / np.linalg.norm(wanted)
    return local, pose(parents, offsets, local)[0]
