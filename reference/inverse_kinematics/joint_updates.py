"""Changes of one joint's coordinates within its limits."""

from ..articulation import FREE, ball_coordinate, clamp_ball
from ..quaternion import (
    conjugate,
    load_quaternion_from,
    load_vector,
    multiply,
    normalised,
    store_quaternion_to,
)


def move_by(joints, q, j, wanted):
    """Move a hinge or slide as far as its limits allow; return how far."""
    at = joints["coordinate"][j]
    before = q[at]
    q[at] = min(max(before + wanted, joints["lower"][j]), joints["upper"][j])
    return q[at] - before


def load_ball(joints, q, j):
    """Return the quaternion of a ball or free joint."""
    return load_quaternion_from(q, ball_coordinate(joints, j))


def store_ball(joints, q, j, Q):
    """Write the quaternion of a ball or free joint."""
    store_quaternion_to(q, ball_coordinate(joints, j), Q)


def rotate_to(joints, q, j, frame, R):
    """Rotate a ball or free joint to R in the world as far as its limits allow.

    Returns the rotation it then has; `frame` is that where its coordinates are zero.
    """
    Q = normalised(multiply(conjugate(frame), R))
    if joints["kind"][j] != FREE:
        axis, cone = load_vector(joints["axis"], j), joints["cone"][j]
        Q = clamp_ball(Q, axis, joints["lower"][j], joints["upper"][j], cone)
    store_ball(joints, q, j, Q)
    return multiply(frame, Q)


def translate_free(joints, q, j, v):
    """Translate a free joint by a vector in its own frame at zero."""
    at = joints["coordinate"][j]
    q[at], q[at + 1], q[at + 2] = q[at] + v[0], q[at + 1] + v[1], q[at + 2] + v[2]
