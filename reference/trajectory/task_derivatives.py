"""Effectors on their path: their errors, and their first and second derivatives.

An error is the way from an effector to its goal [m] and, where rotations matter, the rotation
vector between them times a lever [m], times the root of the effector's weight. Of two turns in a
row, a above b, the second derivative of an effector's position is a x (b x arm); of its rotation
vector it is 1/2 a x b where the error is zero (Baker, Campbell and Hausdorff). Of two turns of one
ball the mean of both orders counts.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import BALL, FREE, FREEDOM, HINGE, KIND, MULTIPLIER, SLIDE
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
    logarithm,
    put_vector,
    quaternion_at,
    rotate,
    scale,
    subtract,
    vector_at,
)

STILL = (0.0, 0.0, 0.0)


class Motions(NamedTuple):
    """All that joints do, one after the other, each a turn about or a way along an axis.

    Attributes:
        owners: the joint and the freedom of each, (motion, 2).
        turns: angular velocities in the world, by a unit of the freedom, (motion, 3).
        ways: linear velocities [m], (motion, 3).
        bends: a . bend is m times the effector's second derivative by this motion and one above it
            that turns by a, (motion, 3).
    """

    owners: IndexArray
    turns: FloatArray
    ways: FloatArray
    bends: FloatArray


class Room(NamedTuple):
    """Room to work in: a posture, and what its joints do."""

    posture: Posture
    motions: Motions


def new_room(mechanism):
    """Return room for a mechanism."""
    joints, count = mechanism.joints, 0
    for j in range(len(joints.integers)):
        kind = joints.integers[j, KIND]
        count += 6 if kind == FREE else 3 if kind == BALL else 1
    owners = np.empty((count, 2), dtype=np.int64)
    motions = Motions(owners, np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3)))
    return Room(new_posture(mechanism), motions)


def fill_path(mechanism, worth, goals, q, e, J):
    """Fill errors [m], (frame, equation), and derivatives, (frame, equation, freedom)."""
    room = new_room(mechanism)
    for f in range(len(q)):
        pose_frame(mechanism, q[f], room)
        fill_errors(mechanism, goals[f], room, e[f])
        fill_motions(mechanism, worth, room)
        fill_derivatives(mechanism, goals[f], room, J[f])


def subtract_second(mechanism, worth, goals, q, m, within):
    """Subtract m, (frame, equation), times the second derivatives of the effectors."""
    room = new_room(mechanism)
    for f in range(len(q)):
        pose_frame(mechanism, q[f], room)
        fill_motions(mechanism, worth, room)
        for e in range(len(mechanism.effectors)):
            fill_bends(mechanism, goals[f], room, m[f], e)
            subtract_bends(mechanism, room, e, within[f])


def pose_frame(mechanism, q, room):
    """Place the posture by the coordinates of a frame."""
    for c in range(len(q)):
        room.posture.q[c] = q[c]
    place(mechanism, room.posture)


def fill_errors(mechanism, goal, room, errors):
    """Fill the errors of a frame: ways [m], and turns times the lever [m]."""
    for e in range(len(mechanism.effectors)):
        row, root = mechanism.effectors[e, ROW], np.sqrt(goal[e, WEIGHT])
        way = scale(root, position_error(mechanism, goal, room.posture, e))
        errors[row], errors[row + 1], errors[row + 2] = way
        if mechanism.effectors[e, ORIENTED]:
            lever = root * LEVER * mechanism.reach
            turn = scale(lever, logarithm(wrong_turn(mechanism, goal, room.posture, e)))
            errors[row + 3], errors[row + 4], errors[row + 5] = turn


def fill_motions(mechanism, worth, room):
    """Fill the motions of a placed posture, from the root on."""
    joints, motions, at = mechanism.joints, room.motions, 0
    for j in range(len(joints.integers)):
        R, k = quaternion_at(room.posture.rotations, j), joints.integers[j, FREEDOM]
        kind, factor = joints.integers[j, KIND], joints.numbers[j, MULTIPLIER]
        if kind == HINGE:
            at = put_motion(motions, at, j, k, scale(factor, axis_of(joints, j, R)), STILL)
        elif kind == SLIDE:
            way = scale(worth[k] * factor, axis_of(joints, j, R))
            at = put_motion(motions, at, j, k, STILL, way)
        elif kind == BALL:
            at = put_turns(motions, at, j, k, R)
        elif kind == FREE:
            at = put_ways(motions, at, j, k, frame_of(joints, j, room.posture), worth[k])
            at = put_turns(motions, at, j, k + 3, R)


def put_turns(motions, at, j, k, R):
    """Write turns about the axes of a frame from an entry on; return the next entry."""
    at = put_motion(motions, at, j, k, rotate(R, (1.0, 0.0, 0.0)), STILL)
    at = put_motion(motions, at, j, k + 1, rotate(R, (0.0, 1.0, 0.0)), STILL)
    return put_motion(motions, at, j, k + 2, rotate(R, (0.0, 0.0, 1.0)), STILL)


def put_ways(motions, at, j, k, R, worth):
    """Write ways along the axes of a frame from an entry on; return the next entry."""
    at = put_motion(motions, at, j, k, STILL, rotate(R, (worth, 0.0, 0.0)))
    at = put_motion(motions, at, j, k + 1, STILL, rotate(R, (0.0, worth, 0.0)))
    return put_motion(motions, at, j, k + 2, STILL, rotate(R, (0.0, 0.0, worth)))


def put_motion(motions, at, j, k, turn, way):
    """Write a motion of joint j and freedom k into an entry; return the next one."""
    motions.owners[at, 0], motions.owners[at, 1] = j, k
    put_vector(motions.turns, at, turn)
    put_vector(motions.ways, at, way)
    return at + 1


def fill_derivatives(mechanism, goal, room, J):
    """Fill what a unit of each freedom does to the effectors, (equation, freedom)."""
    J[:] = 0.0
    owners = room.motions.owners
    for e in range(len(mechanism.effectors)):
        row, root = mechanism.effectors[e, ROW], np.sqrt(goal[e, WEIGHT])
        for b in range(len(owners)):
            if moves(mechanism, owners[b, 0], e):
                add_to_column(J, row, owners[b, 1], scale(root, move(mechanism, room, e, b)))
                if mechanism.effectors[e, ORIENTED]:
                    turn = scale(root * LEVER * mechanism.reach, vector_at(room.motions.turns, b))
                    add_to_column(J, row + 3, owners[b, 1], turn)


def move(mechanism, room, e, b):
    """Return the linear velocity of an effector by a motion."""
    x = vector_at(room.posture.positions, room.motions.owners[b, 0])
    arm = subtract(tip(mechanism, room.posture, e), x)
    return add(cross(vector_at(room.motions.turns, b), arm), vector_at(room.motions.ways, b))


def fill_bends(mechanism, goal, room, m, e):
    """Fill the bends of the motions that move an effector."""
    owners, turns, _, bends = room.motions
    row, root = mechanism.effectors[e, ROW], np.sqrt(goal[e, WEIGHT])
    pull = scale(root, (m[row], m[row + 1], m[row + 2]))
    for b in range(len(owners)):
        bend = cross(move(mechanism, room, e, b), pull)
        if mechanism.effectors[e, ORIENTED]:
            lever = 0.5 * root * LEVER * mechanism.reach
            twist = scale(lever, (m[row + 3], m[row + 4], m[row + 5]))
            bend = add(bend, cross(vector_at(turns, b), twist))
        put_vector(bends, b, bend)


def subtract_bends(mechanism, room, e, within):
    """Subtract m times the second derivatives of an effector."""
    owners, turns, _, bends = room.motions
    for b in range(len(owners)):
        j, k = owners[b]
        if not moves(mechanism, j, e):
            continue
        for a in range(b + 1):
            above, i = owners[a]
            if moves(mechanism, above, e):
                second = dot(vector_at(turns, a), vector_at(bends, b))
                if above == j and is_turn(room.motions, a):
                    second = 0.5 * (second + dot(vector_at(turns, b), vector_at(bends, a)))
                within[i, k] -= second
                if a != b:
                    within[k, i] -= second


def is_turn(motions, a):
    """Return whether a motion is a turn."""
    x, y, z = vector_at(motions.turns, a)
    return x != 0.0 or y != 0.0 or z != 0.0


def add_to_column(J, i, k, v):
    """Add a vector to three entries of a column from the i-th on."""
    J[i, k] += v[0]
    J[i + 1, k] += v[1]
    J[i + 2, k] += v[2]
