"""Changes of one joint's coordinates within its limits."""

from ..articulation import AT, AXIS, CONE, FREE, KIND, LOWER, UPPER, clamp_ball
from ..quaternion import conjugate, load_vector, multiply, normalised


def move_by(joints, q, j, wanted):
    """Move a hinge or slide as far as its limits allow; return how far."""
    at = joints.integers[j, AT]
    before = q[at]
    q[at] = min(max(before + wanted, joints.numbers[j, LOWER]), joints.numbers[j, UPPER])
    return q[at] - before


def ball_at(joints, q, j):
    """Return the quaternion of a ball or free joint."""
    at = joints.integers[j, AT] + (3 if joints.integers[j, KIND] == FREE else 0)
    return q[at], q[at + 1], q[at + 2], q[at + 3]


def put_ball(joints, q, j, Q):
    """Write the quaternion of a ball or free joint."""
    at = joints.integers[j, AT] + (3 if joints.integers[j, KIND] == FREE else 0)
    q[at], q[at + 1], q[at + 2], q[at + 3] = Q


def turn_ball(joints, q, j, frame, R):
    """Turn a ball or free joint to the global rotation R as far as its limits allow.

    Returns the global rotation it then has; `frame` is its global rotation at rest.
    """
    Q = normalised(multiply(conjugate(frame), R))
    if joints.integers[j, KIND] != FREE:
        lower, upper = joints.numbers[j, LOWER], joints.numbers[j, UPPER]
        Q = clamp_ball(
            Q, load_vector(joints.numbers, j, AXIS), lower, upper, joints.numbers[j, CONE]
        )
    put_ball(joints, q, j, Q)
    return multiply(frame, Q)


def shift_free(joints, q, j, way):
    """Shift a free joint in its own frame at rest."""
    at = joints.integers[j, AT]
    q[at], q[at + 1], q[at + 2] = q[at] + way[0], q[at + 1] + way[1], q[at + 2] + way[2]
