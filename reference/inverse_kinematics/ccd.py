"""Cyclic coordinate descent (Wang & Chen 1991)."""

import math

from ..articulation import BALL, FREE, HINGE, SLIDE
from ..motion_subspace import axis_of, frame_of
from ..quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    dot,
    multiply,
    put_quaternion,
    quaternion_at,
    renormalised,
    rotate,
    scale,
    subtract,
    turn_about,
    vector_at,
)
from .box_step import freedom_scale, inner, linearise_task, squared
from .chain import place_joints
from .joint_updates import ball_at, move_by, put_ball, shift_free, turn_ball
from .mechanism import (
    cost,
    effector_position,
    effector_rotation,
    position_error,
    put_effector,
    rotation_error,
    rotation_weight,
    update_forward_kinematics,
)
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
    effector = vector_at(chain.positions, n)
    for k in range(n - 1, -1, -1):
        joint = vector_at(chain.positions, k)
        turn, effector = ccd_turn(joint, effector, target)
        put_quaternion(chain.turns, k, turn)
    above = IDENTITY
    for k in range(n):
        above = renormalised(multiply(above, quaternion_at(chain.turns, k)))
        R = quaternion_at(chain.rotations, k)
        put_quaternion(chain.rotations, k, renormalised(multiply(above, R)))
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


def ccd_update(mechanism, goal, data, room):
    """Move each joint, from the effectors to the root, to bring all effectors below it nearest.

    A joint turns what is below it as one body: Wahba's problem, for a hinge about its axis. A hinge
    or slide stops at its limit on the way; a ball whose limits leave only worse stays.
    """
    joints = mechanism.joints
    for j in range(len(joints) - 1, -1, -1):
        if mechanism.joints["followed"][j]:
            descend(mechanism, goal, data, room, j)
        elif joints["leader"][j] == j:
            move_joint(mechanism, goal, data, room, j)
    update_forward_kinematics(mechanism, data)


def move_joint(mechanism, goal, data, room, j):
    """Give one joint its best coordinates; the effectors follow, the joints below do not yet."""
    joints, q, kind = mechanism.joints, data.q, mechanism.joints["kind"][j]
    R = quaternion_at(data.rotations, j)
    if kind == SLIDE:
        axis = axis_of(joints, j, R)
        way = move_by(joints, q, j, dot(axis, mean_way(mechanism, goal, data, j)))
        shift_tips(mechanism, data, j, scale(way, axis))
        return
    M = arms_to_targets(mechanism, goal, data, j)
    if kind == HINGE:
        axis = axis_of(joints, j, R)
        turn = turn_about(axis, move_by(joints, q, j, best_angle(M, axis)))
    else:
        turn = better_turn(mechanism, goal, data, room, j, M)
    turn_tips(mechanism, data, j, turn)
    if kind == FREE:
        way = mean_way(mechanism, goal, data, j)
        shift_tips(mechanism, data, j, way)
        shift_free(joints, q, j, rotate(conjugate(frame_of(joints, j, data.rotations)), way))


def arms_to_targets(mechanism, goal, data, j):
    """Return Wahba's M of the arms from joint j to the effectors below and of their rotations."""
    M, x = NOTHING, vector_at(data.positions, j)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            weight = goal["weight"][e]
            arm = subtract(effector_position(mechanism, data, e), x)
            M = add_outer(M, weight, subtract(vector_at(goal["position"], e), x), arm)
            if mechanism.effectors["oriented"][e]:
                wanted = rotation_error(mechanism, goal, data, e)
                M = add_turn(M, weight * rotation_weight(mechanism), wanted)
    return M


def mean_way(mechanism, goal, data, j):
    """Return the weighted mean of the ways from the effectors below joint j to their targets."""
    total, way = 0.0, (0.0, 0.0, 0.0)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            total += goal["weight"][e]
            way = add(way, scale(goal["weight"][e], position_error(mechanism, goal, data, e)))
    return scale(1.0 / total, way) if total > 0.0 else way


def better_turn(mechanism, goal, data, room, j, M):
    """Turn a ball, or the ball of a free joint, as is best within its limits; return the turn."""
    joints, R = mechanism.joints, quaternion_at(data.rotations, j)
    turn = best_turn(mechanism, goal, data, room, j, M)
    before = ball_at(joints, data.q, j)
    moved = turn_ball(joints, data.q, j, frame_of(joints, j, data.rotations), multiply(turn, R))
    allowed = renormalised(multiply(moved, conjugate(R)))
    if joints["kind"][j] == BALL and turn_value(M, allowed) < turn_value(M, IDENTITY):
        put_ball(joints, data.q, j, before)
        return IDENTITY
    return allowed


def best_turn(mechanism, goal, data, room, j, M):
    """Return the best turn of joint j without limits, for one position the shortest one."""
    e = only_position(mechanism, j)
    if e < 0:
        return best_rotation(M, room.eigen[0], room.eigen[1])
    x = vector_at(data.positions, j)
    arm = subtract(effector_position(mechanism, data, e), x)
    return between(arm, subtract(vector_at(goal["position"], e), x))


def only_position(mechanism, j):
    """Return the effector below joint j if it is the only one and its rotation free, else -1."""
    only = -1
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            if only >= 0 or mechanism.effectors["oriented"][e]:
                return -1
            only = e
    return only


def turn_tips(mechanism, data, j, turn):
    """Turn the effectors below joint j about it."""
    x = vector_at(data.positions, j)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            arm = subtract(effector_position(mechanism, data, e), x)
            R = multiply(turn, effector_rotation(mechanism, data, e))
            put_effector(mechanism, data, e, add(x, rotate(turn, arm)), R)


def shift_tips(mechanism, data, j, way):
    """Shift the effectors below joint j."""
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            moved = add(effector_position(mechanism, data, e), way)
            put_effector(mechanism, data, e, moved, effector_rotation(mechanism, data, e))


def descend(mechanism, goal, data, room, j):
    """Move a joint that others follow down the gradient, half as far until that is no worse."""
    q, at, k = data.q, mechanism.joints["coordinate"][j], mechanism.joints["freedom"][j]
    update_forward_kinematics(mechanism, data)
    linearise_task(mechanism, goal, data, room.system)
    slope = inner(room.system.J[k], room.system.e)
    square = squared(room.system.J[k])
    before, start = cost(mechanism, goal, data), q[at]
    scale_of_step = freedom_scale(mechanism, j)
    step = scale_of_step * slope / square if square > 0.0 else 0.0
    for _ in range(HALVINGS):
        move_by(mechanism.joints, q, j, step)
        update_forward_kinematics(mechanism, data)
        if cost(mechanism, goal, data) <= before:
            return
        q[at] = start
        step *= 0.5
    update_forward_kinematics(mechanism, data)
