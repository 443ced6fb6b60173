"""What a unit of each degree of freedom does: the columns that every Jacobian is made of.

A freedom rotates what lies below its joint about an axis through the joint's origin, or translates
it: the motion subspace of the joint (Featherstone 2008), in the axes of the world.
"""

from .articulation import FREE, HINGE, SLIDE
from .quaternion import add, cross, load_quaternion, load_vector, multiply, rotate, scale

ZERO = (0.0, 0.0, 0.0)


def axis_of(joints, j, R):
    """Return a joint's axis in the world, R its rotation there."""
    return rotate(R, load_vector(joints["axis"], j))


def frame_of(joints, j, rotations):
    """Return the rotation in the world that a joint has where its coordinates are zero."""
    frame = load_quaternion(joints["frame"], j)
    if joints["parent"][j] < 0:
        return frame
    return multiply(load_quaternion(rotations, joints["parent"][j]), frame)


def motion(joints, j, i, rotations, length):
    """Return the angular velocity [rad] and the linear one [m] by the i-th freedom of joint j.

    A mimic joint's freedom is its leader's; a free joint's translations come first. `rotations` are
    those of all joints in the world, and a unit of a translation is `length` [m].
    """
    kind, R = joints["kind"][j], load_quaternion(rotations, j)
    if kind in (HINGE, SLIDE):
        unit = length if joints["kind"][joints["leader"][j]] == SLIDE else 1.0
        axis = scale(joints["multiplier"][j] * unit, axis_of(joints, j, R))
        return (axis, ZERO) if kind == HINGE else (ZERO, axis)
    if kind == FREE and i < 3:
        return ZERO, rotate(frame_of(joints, j, rotations), unit_vector(i, length))
    return rotate(R, unit_vector(i % 3, 1.0)), ZERO


def unit_vector(i, length):
    """Return a vector along the i-th axis."""
    return length * (i == 0), length * (i == 1), length * (i == 2)


def velocity_at(angular, linear, arm):
    """Return the linear velocity of a point at an arm [m] from the joint's origin."""
    return add(cross(angular, arm), linear)


def accumulate(row, i, v):
    """Add a vector to three entries of a row or column of a Jacobian, from the i-th on."""
    row[i] += v[0]
    row[i + 1] += v[1]
    row[i + 2] += v[2]
