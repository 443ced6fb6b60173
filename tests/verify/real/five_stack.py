"""Forward kinematics by a stack of homogeneous matrices; MISTAKE is 0 (right) or 1 to 5."""

import os

import numpy as np

MISTAKE = int(os.environ.get("MISTAKE", "0"))


def rotation_part(q):
    """Return the matrix of a quaternion; 1: a sign, 2: the quaternion read as x, y, z, w."""
    w, x, y, z = q if MISTAKE != 2 else (q[3], q[0], q[1], q[2])
    m = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    if MISTAKE == 1:
        m[1, 2] = 2 * (y * z + x * w)
    return m


def to_quaternion(m):
    """Return the quaternion of a matrix; 3: its components lose their signs."""
    squares = np.array([
        1 + m[0, 0] + m[1, 1] + m[2, 2],
        1 + m[0, 0] - m[1, 1] - m[2, 2],
        1 - m[0, 0] + m[1, 1] - m[2, 2],
        1 - m[0, 0] - m[1, 1] + m[2, 2],
    ])  # fmt: skip
    if MISTAKE == 3:
        return np.sqrt(np.maximum(squares, 0)) / 2
    rows = np.array([
        [squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], squares[1], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], squares[2], m[1, 2] + m[2, 1]],
        [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[3]],
    ])  # fmt: skip
    q = rows[np.argmax(squares)]
    return q / np.linalg.norm(q)


def draw(joint, tree, stack, results):
    """Push a joint's matrix, draw its children, pop; 4: leaves forget to pop."""
    children, local = tree
    stack.append(stack[-1] @ local[joint])
    results[joint] = stack[-1]
    for child in children[joint]:
        draw(child, tree, stack, results)
    if MISTAKE != 4 or children[joint]:
        stack.pop()


def forward_kinematics(parents, offsets, local_rotations):
    """Return positions and rotations; 5: the root is drawn at the origin."""
    children = [[] for _ in parents]
    local = []
    for joint, parent in enumerate(parents):
        if parent >= 0:
            children[parent].append(joint)
        matrix = np.eye(4)
        matrix[:3, :3] = rotation_part(local_rotations[joint])
        if MISTAKE != 5 or parent >= 0:
            matrix[:3, 3] = offsets[joint]
        local.append(matrix)
    results = {}
    draw(0, (children, local), [np.eye(4)], results)
    matrices = [results[j] for j in range(len(parents))]
    return [m[:3, 3] for m in matrices], [to_quaternion(m[:3, :3]) for m in matrices]
