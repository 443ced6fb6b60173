"""Changes of one joint's coordinates within its limits."""

from ..articulation import FREE, clamp_ball
from ..quaternion import conjugate, multiply, normalised, vector_at


def move_by(joints, q, j, wanted):
    """Move a hinge or slide as far as its limits allow; return how far."""
    at = joints["coordinate"][j]
    before = q[at]
    q[at] = min(max(before + wanted, joints["lower"][j]), joints["upper"][j])
    return q[at] - before


def ball_at(joints, q, j):
    """Return the quaternion of a ball or free joint."""
    at = joints["coordinate"][j] + (3 if joints["kind"][j] == FREE else 0)
    return q[at], q[at + 1], q[at + 2], q[at + 3]


def put_ball(joints, q, j, Q):
    """Write the quaternion of a ball or free joint."""
    at = joints["coordinate"][j] + (3 if joints["kind"][j] == FREE else 0)
    q[at], q[at + 1], q[at + 2], q[at + 3] = Q


def turn_ball(joints, q, j, frame, R):
    """Turn a ball or free joint to the global rotation R as far as its limits allow.

    Returns the global rotation it then has; `frame` is its global rotation at rest.
    """
    Q = normalised(multiply(conjugate(frame), R))
    if joints["kind"][j] != FREE:
        lower, upper = joints["lower"][j], joints["upper"][j]
        Q = clamp_ball(Q, vector_at(joints["axis"], j), lower, upper, joints["cone"][j])
    put_ball(joints, q, j, Q)
    return multiply(frame, Q)


def shift_free(joints, q, j, way):
    """Shift a free joint in its own frame at rest."""
    at = joints["coordinate"][j]
    q[at], q[at + 1], q[at + 2] = q[at] + way[0], q[at + 1] + way[1], q[at + 2] + way[2]
