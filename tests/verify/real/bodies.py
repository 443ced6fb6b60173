"""Bodies with global orientations; a CCD turns them about a pivot and carries what is below."""

import numpy as np
from numpy.linalg import norm


class Body:
    """One link of a ragdoll: where it rests, where it is, how it is turned in the world."""

    def __init__(self, parent, rest, orientation):
        self.parent, self.rest, self.position = parent, rest, rest.copy()
        self.orientation, self.below = orientation, []
        if parent is not None:
            lever = rest - parent.rest
            self.position = parent.position + parent.orientation @ lever
            ancestor = parent
            while ancestor is not None:
                ancestor.below.append(self)
                ancestor = ancestor.parent


def matrix(q):
    w, x, y, z = q
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def quaternion(m):
    q = np.zeros(4)
    squares = np.array([m.trace(), m[0, 0], m[1, 1], m[2, 2]])
    largest = int(np.argmax(squares))
    if largest == 0:
        q[:] = 1 + m.trace(), m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + 2 * m[i, i] - m.trace()
        q[1 + j], q[1 + k] = m[i, j] + m[j, i], m[i, k] + m[k, i]
    return q / norm(q)


def between(a, b):
    a, b = a / norm(a), b / norm(b)
    axis = np.cross(a, b)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1 + a @ b)


def build(parents, offsets, local_rotations):
    bodies = []
    for j, parent in enumerate(parents):
        above = bodies[parent] if parent >= 0 else None
        rest = offsets[j] + (above.rest if above else 0)
        local = matrix(local_rotations[j])
        bodies.append(Body(above, rest, above.orientation @ local if above else local))
    return bodies


def forward_kinematics(parents, offsets, local_rotations):
    bodies = build(parents, offsets, local_rotations)
    return [b.position for b in bodies], [quaternion(b.orientation) for b in bodies]


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    bodies = build(parents, offsets, local_rotations)
    tip = bodies[effector]
    for _ in range(max_iterations):
        pivot = tip.parent
        while pivot is not None:
            turn = between(tip.position - pivot.position, target - pivot.position)
            pivot.orientation = turn @ pivot.orientation
            for body in pivot.below:  # the orientations of these stay as they are
                body.position = pivot.position + turn @ (body.position - pivot.position)
            pivot = pivot.parent
        if norm(tip.position - target) <= tolerance:
            break
    local = [
        quaternion(b.parent.orientation.T @ b.orientation if b.parent else b.orientation)
        for b in bodies
    ]
    return {"local_rotations": local, "positions": [b.position for b in bodies]}
