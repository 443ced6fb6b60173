"""Jacobians of a tree of joints, and steps of its coordinates along velocities.

A velocity v, (..., freedom), holds joint after joint the rate of a hinge [rad/s] or a slide [m/s].
A ball has the angular velocity in its own, moved frame. A free joint has the rate of its position
coordinates, then the angular velocity in its own frame. So a step rotates a quaternion from the
right: Q exp(v). A mimic joint has no velocity of its own: it adds to its leader's column.

Coordinates q have the shape (..., coordinate), of a Skeleton (..., joint, 4); leading axes
broadcast. Functions raise a ValueError if an argument has another shape, is not finite, or holds a
quaternion not unit, and for an unknown joint.

The kernel `motion` gives the motion subspace of a joint (Featherstone 2008) in the world's axes. A
freedom rotates the joints below about an axis through the joint's origin, or translates the joints.
"""

import numpy as np
from numpy.typing import ArrayLike

from . import arguments
from .arguments import FloatArray, IndexArray
from .articulation import (
    BALL,
    FIXED,
    FREE,
    FREEDOMS,
    HINGE,
    SLIDE,
    Articulation,
    articulated_pose,
    balls,
    one_batch,
    unit_start,
)
from .backend.compiled import Kernel
from .model import Model, checked_model, effector_of
from .quaternion import (
    add,
    conjugate,
    cross,
    exponential,
    load_quaternion,
    load_quaternion_from,
    load_vector,
    logarithm,
    multiply,
    rotate,
    scale,
    store_quaternion_to,
    subtract,
)
from .skeleton import Skeleton

ZERO = (0.0, 0.0, 0.0)


def jacobian(articulation: Model, q: ArrayLike, effector: int | str | None = None) -> FloatArray:
    """Return the derivative of a joint's motion by the velocity, (..., 6, freedom).

    Three rows of linear velocity [m], three of angular velocity [rad], of the joint's frame at its
    origin, along the axes of the world. The effector is a joint by name or index; by default as for
    `solve_ik`.
    """
    joint = effector_of(checked_model(articulation, "articulation"), effector)
    return _jacobians(articulation, q, np.array([joint]))[..., 0, :, :]


def jacobians(articulation: Model, q: ArrayLike, joints: ArrayLike | None = None) -> FloatArray:
    """Return the Jacobians of all joints, or of `joints` only, (..., joint, 6, freedom)."""
    count = checked_model(articulation, "articulation").joint_count
    if joints is None:
        return _jacobians(articulation, q, np.arange(count))
    effectors = arguments.indices("joints", joints, "joint", minimum=0, below=count)
    return _jacobians(articulation, q, effectors)


def _jacobians(articulation: Model, q: ArrayLike, effectors: IndexArray) -> FloatArray:
    model, coordinates = _rows("q", articulation, q)
    J = np.zeros((*coordinates.shape[:-1], len(effectors), 6, model.freedom_count))
    if not _fill(model.joints, effectors, one_batch(coordinates), one_batch(J, 3)):
        # raise, or the lengths were within rounding of the tolerance
        return _jacobians(model, model.checked("q", coordinates), effectors)
    return J


def integrate(articulation: Model, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return q, in its own shape, moved by the velocity v for a second, regardless of limits."""
    model, start = _coordinates("q", articulation, q)
    step = arguments.coordinates("v", v, "...", model.freedom_count)
    start, step = arguments.together("v", start, step)
    moved = start.copy()
    _integrate(model.joints, one_batch(step), one_batch(moved))
    return moved.reshape(*moved.shape[:-1], -1, 4) if isinstance(articulation, Skeleton) else moved


def difference(articulation: Model, q1: ArrayLike, q0: ArrayLike) -> FloatArray:
    """Return the velocity from q0 to q1 in a second, (..., freedom).

    This inverts `integrate`: rotations go through the smaller angle, at most pi.
    """
    model, start = _coordinates("q0", articulation, q0)
    _, end = _coordinates("q1", articulation, q1)
    start, end = arguments.together("q1", start, end)
    v = np.empty((*start.shape[:-1], model.freedom_count))
    _difference(model.joints, one_batch(end), one_batch(start), one_batch(v))
    return v


def axis_of(joints, j, R):
    """Return a joint's axis in the world, given its rotation R there."""
    return rotate(R, load_vector(joints["axis"], j))


def frame_of(joints, j, rotations):
    """Return the rotation in the world of a joint at zero coordinates."""
    frame = load_quaternion(joints["frame"], j)
    if joints["parent"][j] < 0:
        return frame
    return multiply(load_quaternion(rotations, joints["parent"][j]), frame)


def motion(joints, j, i, rotations, length):
    """Return the angular [rad] and linear [m] velocity by the i-th freedom of joint j.

    A mimic joint's freedom is its leader's; a free joint's translations come first. `rotations` are
    all joints' in the world, and a unit of a translation is `length` [m].
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


def fill_jacobian(joints, effector, positions, rotations, J):
    """Fill the Jacobian (6, freedom) of a joint, given every joint's pose; J must hold zeros."""
    x, j = load_vector(positions, effector), effector
    while j >= 0:
        arm = subtract(x, load_vector(positions, j))
        for i in range(FREEDOMS[joints["kind"][j]]):
            angular, linear = motion(joints, j, i, rotations, 1.0)
            column = J[:, joints["freedom"][j] + i]
            accumulate(column, 0, velocity_at(angular, linear, arm))
            accumulate(column, 3, angular)
        j = joints["parent"][j]


def move_joint(joints, j, v, q):
    """Move the coordinates of a joint by its velocity, for a second."""
    kind, at, first = joints["kind"][j], joints["coordinate"][j], joints["freedom"][j]
    if kind == FIXED or joints["leader"][j] != j:
        return
    if kind == BALL:
        rotate_ball(q, at, (v[first], v[first + 1], v[first + 2]))
    elif kind == FREE:
        for k in range(3):
            q[at + k] += v[first + k]
        rotate_ball(q, at + 3, (v[first + 3], v[first + 4], v[first + 5]))
    else:
        q[at] += v[first]


def rotate_ball(q, at, v):
    """Rotate the quaternion at an index of q by a rotation vector in its own frame."""
    store_quaternion_to(q, at, multiply(load_quaternion_from(q, at), exponential(v)))


def joint_difference(joints, j, q1, q0, v):
    """Fill the velocity of a joint from q0 to q1."""
    kind, at, first = joints["kind"][j], joints["coordinate"][j], joints["freedom"][j]
    if kind == FIXED or joints["leader"][j] != j:
        return
    if kind == BALL:
        v[first], v[first + 1], v[first + 2] = rotation_between(q1, q0, at)
    elif kind == FREE:
        for k in range(3):
            v[first + k] = q1[at + k] - q0[at + k]
        v[first + 3], v[first + 4], v[first + 5] = rotation_between(q1, q0, at + 3)
    else:
        v[first] = q1[at] - q0[at]


def rotation_between(q1, q0, at):
    """Return log(Q0* Q1), the rotation vector in Q0's own frame from Q0 to Q1."""
    return logarithm(
        multiply(conjugate(load_quaternion_from(q0, at)), load_quaternion_from(q1, at))
    )


def _jacobians_batch(joints, effectors, q, J):
    count, unit = len(joints), np.empty(q.shape[1])
    positions, rotations = np.empty((count, 3)), np.empty((count, 4))
    for i in range(len(q)):
        if not unit_start(joints, q[i], unit):
            return False
        articulated_pose(joints, unit, positions, rotations)
        for k in range(len(effectors)):
            fill_jacobian(joints, effectors[k], positions, rotations, J[i, k])
    return True


def _integrate_batch(joints, v, q):
    for i in range(len(q)):
        for j in range(len(joints)):
            move_joint(joints, j, v[i], q[i])


def _difference_batch(joints, q1, q0, v):
    for i in range(len(v)):
        for j in range(len(joints)):
            joint_difference(joints, j, q1[i], q0[i], v[i])


_fill = Kernel(_jacobians_batch, label="jacobian")
_integrate = Kernel(_integrate_batch)
_difference = Kernel(_difference_batch)


def _coordinates(name: str, articulation: Model, q: ArrayLike) -> tuple[Articulation, FloatArray]:
    """Return the articulation, and its coordinates checked, (..., coordinate)."""
    model, rows = _rows(name, articulation, q)
    return model, model.checked(name, rows)


def _rows(name: str, articulation: Model, q: ArrayLike) -> tuple[Articulation, FloatArray]:
    """Return the articulation, and its coordinates, their numbers unchecked."""
    model = checked_model(articulation, "articulation")
    if isinstance(model, Articulation):
        return model, arguments.floats(name, q, "...", model.coordinate_count)
    local = arguments.floats(name, q, "...", model.joint_count, 4)
    return balls(model), local.reshape(*local.shape[:-2], 4 * model.joint_count)
