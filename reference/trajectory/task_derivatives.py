"""Errors of the effectors, with their first and second derivatives by the freedoms of the joints.

An error is the vector from an effector to its target [m] and, where rotations matter, the rotation
vector between them times a lever [m], times the square root of the effector's weight. Motions a
above b on the path to an effector, of angular velocities w_a and w_b, change its position by the
second derivative w_a x v_b, v_b its velocity by motion b; and its rotation vector by 1/2 w_a x w_b
where the error is zero (the second term of the Baker-Campbell-Hausdorff series). For two rotations
of one ball the mean of both orders counts.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import BALL, FREE, FREEDOM, FREEDOMS, HINGE, KIND, MULTIPLIER, SLIDE
from ..inverse_kinematics.mechanism import (
    LEVER,
    ORIENTED,
    ROW,
    WEIGHT,
    Posture,
    axis_of,
    frame_of,
    moves,
    new_posture,
    place,
    position_error,
    tip,
    wrong_turn,
)
from ..quaternion import (
    add,
    cross,
    dot,
    load_quaternion,
    load_vector,
    logarithm,
    rotate,
    scale,
    store_vector,
    subtract,
)

ZERO = (0.0, 0.0, 0.0)


class Motions(NamedTuple):
    """The elementary motions of all joints, from the root on: each a rotation or a translation.

    Attributes:
        owners: the joint and the freedom of each, (motion, 2).
        angular: angular velocities by a unit of the freedom, in the world, (motion, 3).
        linear: linear velocities of the joint [m], (motion, 3).
        moments: vectors whose product with the angular velocity of a motion above is m times the
            effector's second derivative by both, (motion, 3).
    """

    owners: IndexArray
    angular: FloatArray
    linear: FloatArray
    moments: FloatArray


class Workspace(NamedTuple):
    """The pose of one frame, and the motions of its joints."""

    pose: Posture
    motions: Motions


def new_workspace(mechanism):
    """Return a workspace to be filled."""
    count = 0
    for j in range(len(mechanism.joints.integers)):
        count += FREEDOMS[mechanism.joints.integers[j, KIND]]
    owners = np.empty((count, 2), dtype=np.int64)
    motions = Motions(owners, np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)))
    return Workspace(new_posture(mechanism), motions)


def fill_errors_and_jacobians(problem, q, e, J):
    """Fill errors e [m], (frame, equation), and J = -de/dq, (frame, equation, freedom)."""
    mechanism = problem.mechanism
    work = new_workspace(mechanism)
    for f in range(len(q)):
        set_frame(mechanism, q[f], work)
        fill_errors(mechanism, problem.targets[f], work, e[f])
        fill_motions(mechanism, problem.units, work)
        fill_jacobian(mechanism, problem.targets[f], work, J[f])


def subtract_second_derivatives(problem, q, m, diagonal):
    """Subtract m, (frame, equation), times the second derivatives of the effectors."""
    mechanism = problem.mechanism
    work = new_workspace(mechanism)
    for f in range(len(q)):
        set_frame(mechanism, q[f], work)
        fill_motions(mechanism, problem.units, work)
        for e in range(len(mechanism.effectors)):
            fill_moments(mechanism, problem.targets[f], work, m[f], e)
            subtract_effector(mechanism, work, e, diagonal[f])


def set_frame(mechanism, q, work):
    """Compute the forward kinematics of one frame."""
    for c in range(len(q)):
        work.pose.q[c] = q[c]
    place(mechanism, work.pose)


def fill_errors(mechanism, target, work, errors):
    """Fill the errors of a frame: displacements [m], and rotation vectors times the lever [m]."""
    for e in range(len(mechanism.effectors)):
        row, root = mechanism.effectors[e, ROW], np.sqrt(target[e, WEIGHT])
        error = scale(root, position_error(mechanism, target, work.pose, e))
        errors[row], errors[row + 1], errors[row + 2] = error
        if mechanism.effectors[e, ORIENTED]:
            lever = root * LEVER * mechanism.reach
            error = scale(lever, logarithm(wrong_turn(mechanism, target, work.pose, e)))
            errors[row + 3], errors[row + 4], errors[row + 5] = error


def fill_motions(mechanism, units, work):
    """Fill the motions of a frame, but for their moments."""
    joints, motions, at = mechanism.joints, work.motions, 0
    for j in range(len(joints.integers)):
        R, k = load_quaternion(work.pose.rotations, j), joints.integers[j, FREEDOM]
        kind, factor = joints.integers[j, KIND], joints.numbers[j, MULTIPLIER]
        if kind == HINGE:
            at = put_motion(motions, at, j, k, scale(factor, axis_of(joints, j, R)), ZERO)
        elif kind == SLIDE:
            linear = scale(units[k] * factor, axis_of(joints, j, R))
            at = put_motion(motions, at, j, k, ZERO, linear)
        elif kind == BALL:
            at = put_rotations(motions, at, j, k, R)
        elif kind == FREE:
            at = put_translations(motions, at, j, k, frame_of(joints, j, work.pose), units[k])
            at = put_rotations(motions, at, j, k + 3, R)


def put_rotations(motions, at, j, k, R):
    """Write rotations about the axes of a frame from an entry on; return the next entry."""
    at = put_motion(motions, at, j, k, rotate(R, (1.0, 0.0, 0.0)), ZERO)
    at = put_motion(motions, at, j, k + 1, rotate(R, (0.0, 1.0, 0.0)), ZERO)
    return put_motion(motions, at, j, k + 2, rotate(R, (0.0, 0.0, 1.0)), ZERO)


def put_translations(motions, at, j, k, R, unit):
    """Write translations along the axes of a frame from an entry on; return the next entry."""
    at = put_motion(motions, at, j, k, ZERO, rotate(R, (unit, 0.0, 0.0)))
    at = put_motion(motions, at, j, k + 1, ZERO, rotate(R, (0.0, unit, 0.0)))
    return put_motion(motions, at, j, k + 2, ZERO, rotate(R, (0.0, 0.0, unit)))


def put_motion(motions, at, j, k, angular, linear):
    """Write a motion of joint j and freedom k into an entry; return the next one."""
    motions.owners[at, 0], motions.owners[at, 1] = j, k
    store_vector(motions.angular, at, angular)
    store_vector(motions.linear, at, linear)
    return at + 1


def fill_jacobian(mechanism, target, work, J):
    """Fill the derivatives of the effectors by the freedoms, (equation, freedom)."""
    J[:] = 0.0
    owners = work.motions.owners
    for e in range(len(mechanism.effectors)):
        row, root = mechanism.effectors[e, ROW], np.sqrt(target[e, WEIGHT])
        for b in range(len(owners)):
            if moves(mechanism, owners[b, 0], e):
                add_to_column(J, row, owners[b, 1], scale(root, velocity(mechanism, work, e, b)))
                if mechanism.effectors[e, ORIENTED]:
                    lever = root * LEVER * mechanism.reach
                    angular = scale(lever, load_vector(work.motions.angular, b))
                    add_to_column(J, row + 3, owners[b, 1], angular)


def velocity(mechanism, work, e, b):
    """Return the linear velocity of an effector by a motion."""
    x = load_vector(work.pose.positions, work.motions.owners[b, 0])
    arm = subtract(tip(mechanism, work.pose, e), x)
    return add(
        cross(load_vector(work.motions.angular, b), arm), load_vector(work.motions.linear, b)
    )


def fill_moments(mechanism, target, work, m, e):
    """Fill the moments of all motions for an effector."""
    row, root = mechanism.effectors[e, ROW], np.sqrt(target[e, WEIGHT])
    force = scale(root, (m[row], m[row + 1], m[row + 2]))
    for b in range(len(work.motions.owners)):
        moment = cross(velocity(mechanism, work, e, b), force)
        if mechanism.effectors[e, ORIENTED]:
            lever = 0.5 * root * LEVER * mechanism.reach
            torque = scale(lever, (m[row + 3], m[row + 4], m[row + 5]))
            moment = add(moment, cross(load_vector(work.motions.angular, b), torque))
        store_vector(work.motions.moments, b, moment)


def subtract_effector(mechanism, work, e, diagonal):
    """Subtract m times the second derivatives of an effector."""
    owners, angular, _, moments = work.motions
    for b in range(len(owners)):
        j, k = owners[b]
        if not moves(mechanism, j, e):
            continue
        for a in range(b + 1):
            above, i = owners[a]
            if moves(mechanism, above, e):
                second = dot(load_vector(angular, a), load_vector(moments, b))
                if above == j and is_rotation(work.motions, a):
                    second = 0.5 * (second + dot(load_vector(angular, b), load_vector(moments, a)))
                diagonal[i, k] -= second
                if a != b:
                    diagonal[k, i] -= second


def is_rotation(motions, a):
    """Return whether a motion is a rotation."""
    x, y, z = load_vector(motions.angular, a)
    return x != 0.0 or y != 0.0 or z != 0.0


def add_to_column(J, i, k, v):
    """Add a vector to three entries of a column from the i-th on."""
    J[i, k] += v[0]
    J[i + 1, k] += v[1]
    J[i + 2, k] += v[2]
