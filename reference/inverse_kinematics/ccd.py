"""Cyclic coordinate descent (Wang & Chen 1991)."""

import math

from ..articulation import AT, BALL, FREE, FREEDOM, HINGE, KIND, LEADER, SLIDE
from ..quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    dot,
    load_quaternion,
    load_vector,
    multiply,
    renormalised,
    rotate,
    scale,
    store_quaternion,
    subtract,
    turn_about,
)
from .chain import place_joints
from .joint_updates import ball_at, move_by, put_ball, shift_free, turn_ball
from .mechanism import (
    ORIENTED,
    POSITION,
    WEIGHT,
    axis_of,
    frame_of,
    is_followed,
    misfit,
    moves,
    place,
    position_error,
    put_tip,
    tip,
    tip_rotation,
    turn_weight,
    wrong_turn,
)
from .stacked import freedom_worth, inner, linearise_all, squared
from .wahba import NOTHING, add_outer, add_turn, best_angle, best_rotation, turn_value

# A step of a joint that others follow is halved at most so often.
HALVINGS = 20


def ccd_sweep(chain, target):
    """Turn each joint, from the effector's parent to the root, to point the effector at the target.

    A turn moves what lies below the joint. The joints still to come lie above and stay, so that of
    all that moves only the effector is needed on the way up; the turns are then applied from the
    root down, each to its joint and to all below it.
    """
    n = len(chain.lengths)
    effector = load_vector(chain.positions, n)
    for k in range(n - 1, -1, -1):
        joint = load_vector(chain.positions, k)
        turn, effector = ccd_turn(joint, effector, target)
        store_quaternion(chain.turns, k, turn)
    above = IDENTITY
    for k in range(n):
        above = renormalised(multiply(above, load_quaternion(chain.turns, k)))
        R = load_quaternion(chain.rotations, k)
        store_quaternion(chain.rotations, k, renormalised(multiply(above, R)))
    place_joints(chain)


def ccd_turn(joint, effector, target):
    """Return the shortest turn about a joint that brings the effector nearest, and where it goes.

    The effector moves on a sphere about the joint, and the point nearest to the target lies on the
    ray from the joint to the target: the distance cannot grow.
    """
    arm, way = subtract(effector, joint), subtract(target, joint)
    square = dot(way, way)
    if square == 0.0:
        return IDENTITY, effector
    return between(arm, way), add(joint, scale(math.sqrt(dot(arm, arm) / square), way))


def ccd_update(mechanism, goal, posture, room):
    """Move each joint, from the effectors to the root, to bring all effectors below it nearest.

    A joint turns what is below it as one body: Wahba's problem, for a hinge about its axis. A hinge
    or slide stops at its limit on the way; a ball whose limits leave only worse stays.
    """
    joints = mechanism.joints
    for j in range(len(joints.integers) - 1, -1, -1):
        if is_followed(mechanism, j):
            descend(mechanism, goal, posture, room, j)
        elif joints.integers[j, LEADER] == j:
            move_joint(mechanism, goal, posture, room, j)
    place(mechanism, posture)


def move_joint(mechanism, goal, posture, room, j):
    """Give one joint its best coordinates; the effectors follow, the joints below do not yet."""
    joints, q, kind = mechanism.joints, posture.q, mechanism.joints.integers[j, KIND]
    R = load_quaternion(posture.rotations, j)
    if kind == SLIDE:
        axis = axis_of(joints, j, R)
        way = move_by(joints, q, j, dot(axis, mean_way(mechanism, goal, posture, j)))
        shift_tips(mechanism, posture, j, scale(way, axis))
        return
    M = arms_to_targets(mechanism, goal, posture, j)
    if kind == HINGE:
        axis = axis_of(joints, j, R)
        turn = turn_about(axis, move_by(joints, q, j, best_angle(M, axis)))
    else:
        turn = better_turn(mechanism, goal, posture, room, j, M)
    turn_tips(mechanism, posture, j, turn)
    if kind == FREE:
        way = mean_way(mechanism, goal, posture, j)
        shift_tips(mechanism, posture, j, way)
        shift_free(joints, q, j, rotate(conjugate(frame_of(joints, j, posture)), way))


def arms_to_targets(mechanism, goal, posture, j):
    """Return Wahba's M of the arms from joint j to the effectors below and of their rotations."""
    M, x = NOTHING, load_vector(posture.positions, j)
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            weight = goal[e, WEIGHT]
            arm = subtract(tip(mechanism, posture, e), x)
            M = add_outer(M, weight, subtract(load_vector(goal, e, POSITION), x), arm)
            if mechanism.effectors[e, ORIENTED]:
                wanted = wrong_turn(mechanism, goal, posture, e)
                M = add_turn(M, weight * turn_weight(mechanism), wanted)
    return M


def mean_way(mechanism, goal, posture, j):
    """Return the weighted mean of the ways from the effectors below joint j to their targets."""
    total, way = 0.0, (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            total += goal[e, WEIGHT]
            way = add(way, scale(goal[e, WEIGHT], position_error(mechanism, goal, posture, e)))
    return scale(1.0 / total, way) if total > 0.0 else way


def better_turn(mechanism, goal, posture, room, j, M):
    """Turn a ball, or the ball of a free joint, as is best within its limits; return the turn."""
    joints, R = mechanism.joints, load_quaternion(posture.rotations, j)
    turn = best_turn(mechanism, goal, posture, room, j, M)
    before = ball_at(joints, posture.q, j)
    moved = turn_ball(joints, posture.q, j, frame_of(joints, j, posture), multiply(turn, R))
    allowed = renormalised(multiply(moved, conjugate(R)))
    if joints.integers[j, KIND] == BALL and turn_value(M, allowed) < turn_value(M, IDENTITY):
        put_ball(joints, posture.q, j, before)
        return IDENTITY
    return allowed


def best_turn(mechanism, goal, posture, room, j, M):
    """Return the best turn of joint j without limits, for one position the shortest one."""
    e = only_position(mechanism, j)
    if e < 0:
        return best_rotation(M, room.eigen[0], room.eigen[1])
    x = load_vector(posture.positions, j)
    arm = subtract(tip(mechanism, posture, e), x)
    return between(arm, subtract(load_vector(goal, e, POSITION), x))


def only_position(mechanism, j):
    """Return the effector below joint j if it is the only one and its rotation free, else -1."""
    only = -1
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            if only >= 0 or mechanism.effectors[e, ORIENTED]:
                return -1
            only = e
    return only


def turn_tips(mechanism, posture, j, turn):
    """Turn the effectors below joint j about it."""
    x = load_vector(posture.positions, j)
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            arm = subtract(tip(mechanism, posture, e), x)
            R = multiply(turn, tip_rotation(mechanism, posture, e))
            put_tip(mechanism, posture, e, add(x, rotate(turn, arm)), R)


def shift_tips(mechanism, posture, j, way):
    """Shift the effectors below joint j."""
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            moved = add(tip(mechanism, posture, e), way)
            put_tip(mechanism, posture, e, moved, tip_rotation(mechanism, posture, e))


def descend(mechanism, goal, posture, room, j):
    """Move a joint that others follow down the gradient, half as far until that is no worse."""
    q, at, k = posture.q, mechanism.joints.integers[j, AT], mechanism.joints.integers[j, FREEDOM]
    place(mechanism, posture)
    linearise_all(mechanism, goal, posture, room.stack)
    slope = inner(room.stack.J[k], room.stack.e)
    square = squared(room.stack.J[k])
    before, start = misfit(mechanism, goal, posture), q[at]
    worth = freedom_worth(mechanism, j)
    step = worth * slope / square if square > 0.0 else 0.0
    for _ in range(HALVINGS):
        move_by(mechanism.joints, q, j, step)
        place(mechanism, posture)
        if misfit(mechanism, goal, posture) <= before:
            return
        q[at] = start
        step *= 0.5
    place(mechanism, posture)
