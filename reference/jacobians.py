"""Jacobians of a tree of joints, and the steps on its coordinates that they are derivatives by.

A velocity v, (..., freedom), holds for each joint in turn what its kind may do: the rate of a
hinge [rad/s] or a slide [m/s]; of a ball the angular velocity in its own, moved frame; of a free
joint the rate of its position coordinates, then the angular velocity in its own frame. So a step
turns a quaternion from the right: Q exp(v). A mimic joint has no velocity of its own: it adds to
its leader's column.
"""

import numpy as np
from numpy.typing import ArrayLike

from . import arguments
from .arguments import FloatArray
from .articulation import (
    AT,
    AXIS,
    BALL,
    FIXED,
    FREE,
    FREEDOM,
    KIND,
    LEADER,
    MULTIPLIER,
    PARENT,
    SLIDE,
    Articulation,
    articulated_pose,
    one_batch,
)
from .backend.compiled import Kernel
from .model import Model, checked_model, effector_of
from .quaternion import (
    conjugate,
    cross,
    exponential,
    load_quaternion,
    load_vector,
    logarithm,
    multiply,
    rotate,
    scale,
    subtract,
)
from .skeleton import Skeleton


def jacobian(articulation: Model, q: ArrayLike, effector: int | str | None = None) -> FloatArray:
    """Return the derivative of a joint's motion by the velocity, (..., 6, freedom).

    Three rows of linear velocity [m], three of angular velocity [rad], both of the joint's frame,
    taken at its origin, along the axes of the world.

    Args:
        articulation: the tree; a Skeleton is an articulation of balls, a Robot has its own.
        q: coordinates, (..., coordinate); of a Skeleton local rotations, (..., joint, 4).
        effector: the joint, by name or index; by default as for `solve_ik`.

    Raises:
        ValueError: if q has another shape, is not finite, or holds no unit quaternion where one
            is expected, if there is no such joint, or none is named of several tips.
    """
    model, given = _coordinates("q", articulation, q)
    one = np.array([effector_of(checked_model(articulation), effector)])
    return _jacobians(model, one, given)[..., 0, :, :]


def jacobians(articulation: Model, q: ArrayLike) -> FloatArray:
    """Return the Jacobians of all joints, (..., joint, 6, freedom), as `jacobian` does of one.

    Raises:
        ValueError: as for `jacobian`.
    """
    model, given = _coordinates("q", articulation, q)
    return _jacobians(model, np.arange(model.joint_count), given)


def integrate(articulation: Model, q: ArrayLike, v: ArrayLike) -> FloatArray:
    """Return the coordinates reached from q by moving with the velocity v for one second.

    Args:
        articulation: the tree.
        q: coordinates, as for `jacobian`.
        v: velocities, (..., freedom); leading axes broadcast with those of q.

    Returns:
        Coordinates shaped like those given, limits not regarded.

    Raises:
        ValueError: as for `jacobian`, or if v has another shape or is not finite.
    """
    model, start = _coordinates("q", articulation, q)
    step = arguments.coordinates("v", v, "...", model.freedom_count)
    start, step = _spread("v", start, step)
    moved = start.copy()
    _integrate(model.arrays, one_batch(step), one_batch(moved))
    return moved.reshape(*moved.shape[:-1], -1, 4) if isinstance(articulation, Skeleton) else moved


def difference(articulation: Model, q1: ArrayLike, q0: ArrayLike) -> FloatArray:
    """Return the velocity that leads from q0 to q1 in one second, (..., freedom).

    It is the inverse of `integrate`: rotations go the shorter way round, at most pi.

    Raises:
        ValueError: as for `jacobian`, or if the leading axes do not broadcast.
    """
    model, start = _coordinates("q0", articulation, q0)
    _, end = _coordinates("q1", articulation, q1)
    start, end = _spread("q1", start, end)
    v = np.empty((*start.shape[:-1], model.freedom_count))
    _difference(model.arrays, one_batch(end), one_batch(start), one_batch(v))
    return v


def fill_jacobian(joints, effector, q, positions, rotations, J):
    """Fill the Jacobian (6, freedom) of a joint, given every joint's pose; J must hold zeros."""
    x, j = load_vector(positions, effector), effector
    while j >= 0:
        arm = subtract(x, load_vector(positions, j))
        add_joint(joints, j, q, load_quaternion(rotations, j), arm, J)
        j = joints.integers[j, PARENT]


def add_joint(joints, j, q, R, arm, J):
    """Add what joint j of global rotation R does to a point at an arm [m] from its origin.

    A joint does not turn its own axis: R takes the axis of a hinge or slide to the world, moved
    or not.
    """
    kind, first = joints.integers[j, KIND], joints.integers[j, FREEDOM]
    if kind == FIXED:
        return
    if kind == BALL:
        add_turns(R, arm, J, first)
    elif kind == FREE:
        at = joints.integers[j, AT] + 3
        unmoved = multiply(R, conjugate((q[at], q[at + 1], q[at + 2], q[at + 3])))
        add_shift(rotate(unmoved, (1.0, 0.0, 0.0)), J, first)
        add_shift(rotate(unmoved, (0.0, 1.0, 0.0)), J, first + 1)
        add_shift(rotate(unmoved, (0.0, 0.0, 1.0)), J, first + 2)
        add_turns(R, arm, J, first + 3)
    else:
        axis = scale(joints.numbers[j, MULTIPLIER], rotate(R, load_vector(joints.numbers, j, AXIS)))
        if kind == SLIDE:
            add_shift(axis, J, first)
        else:
            add_turn(axis, arm, J, first)


def add_turns(R, arm, J, column):
    """Add the turns about the three axes of a frame R."""
    add_turn(rotate(R, (1.0, 0.0, 0.0)), arm, J, column)
    add_turn(rotate(R, (0.0, 1.0, 0.0)), arm, J, column + 1)
    add_turn(rotate(R, (0.0, 0.0, 1.0)), arm, J, column + 2)


def add_turn(axis, arm, J, column):
    """Add a turn about an axis: the linear velocity axis x arm, and the angular one."""
    add_shift(cross(axis, arm), J, column)
    x, y, z = axis
    J[3, column] += x
    J[4, column] += y
    J[5, column] += z


def add_shift(way, J, column):
    """Add a shift along a way."""
    x, y, z = way
    J[0, column] += x
    J[1, column] += y
    J[2, column] += z


def move_joint(joints, j, v, q):
    """Move the coordinates of one joint by its velocity, for one second."""
    kind, at, first = joints.integers[j, KIND], joints.integers[j, AT], joints.integers[j, FREEDOM]
    if kind == FIXED or joints.integers[j, LEADER] != j:
        return
    if kind == BALL:
        turn_right(q, at, (v[first], v[first + 1], v[first + 2]))
    elif kind == FREE:
        for k in range(3):
            q[at + k] += v[first + k]
        turn_right(q, at + 3, (v[first + 3], v[first + 4], v[first + 5]))
    else:
        q[at] += v[first]


def turn_right(q, at, turn):
    """Turn the quaternion at a place in q, in its own frame, by a rotation vector."""
    Q = (q[at], q[at + 1], q[at + 2], q[at + 3])
    w, x, y, z = multiply(Q, exponential(turn))
    q[at], q[at + 1], q[at + 2], q[at + 3] = w, x, y, z


def joint_difference(joints, j, q1, q0, v):
    """Fill the velocity that takes one joint from q0 to q1."""
    kind, at, first = joints.integers[j, KIND], joints.integers[j, AT], joints.integers[j, FREEDOM]
    if kind == FIXED or joints.integers[j, LEADER] != j:
        return
    if kind == BALL:
        v[first], v[first + 1], v[first + 2] = turn_between(q1, q0, at)
    elif kind == FREE:
        for k in range(3):
            v[first + k] = q1[at + k] - q0[at + k]
        v[first + 3], v[first + 4], v[first + 5] = turn_between(q1, q0, at + 3)
    else:
        v[first] = q1[at] - q0[at]


def turn_between(q1, q0, at):
    """Return log(Q0* Q1), the turn of Q0 in its own frame that gives Q1, both at a place in q."""
    Q0 = (q0[at], q0[at + 1], q0[at + 2], q0[at + 3])
    return logarithm(multiply(conjugate(Q0), (q1[at], q1[at + 1], q1[at + 2], q1[at + 3])))


def _jacobians_batch(joints, effectors, q, J):
    count = len(joints.integers)
    positions, rotations = np.empty((count, 3)), np.empty((count, 4))
    for i in range(len(q)):
        articulated_pose(joints, q[i], positions, rotations)
        for k in range(len(effectors)):
            fill_jacobian(joints, effectors[k], q[i], positions, rotations, J[i, k])


def _integrate_batch(joints, v, q):
    for i in range(len(q)):
        for j in range(len(joints.integers)):
            move_joint(joints, j, v[i], q[i])


def _difference_batch(joints, q1, q0, v):
    for i in range(len(v)):
        for j in range(len(joints.integers)):
            joint_difference(joints, j, q1[i], q0[i], v[i])


_fill = Kernel(_jacobians_batch, label="jacobian")
_integrate = Kernel(_integrate_batch)
_difference = Kernel(_difference_batch)


def _jacobians(model: Articulation, effectors: np.ndarray, q: FloatArray) -> FloatArray:
    J = np.zeros((*q.shape[:-1], len(effectors), 6, model.freedom_count))
    _fill(model.arrays, effectors, one_batch(q), one_batch(J, 3))
    return J


def _coordinates(name: str, given: Model, q: ArrayLike) -> tuple[Articulation, FloatArray]:
    """Return the articulation, and its coordinates checked, (..., coordinate)."""
    model = checked_model(given, "articulation")
    if isinstance(model, Articulation):
        return model, model.checked(name, q)
    balls = Articulation(model)
    local = arguments.floats(name, q, "...", model.joint_count, 4)
    return balls, balls.checked(name, local.reshape(*local.shape[:-2], balls.coordinate_count))


def _spread(name: str, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both with the same leading axes; `name` is the second's, for the error."""
    batch = arguments.broadcast(name, a.shape[:-1], b.shape[:-1])
    return arguments.spread(a, (*batch, a.shape[-1])), arguments.spread(b, (*batch, b.shape[-1]))
