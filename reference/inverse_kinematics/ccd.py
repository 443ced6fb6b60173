"""Cyclic coordinate descent (Wang & Chen 1991).

A sweep gives each joint, from the effector to the root, the angle that brings the effector nearest:
`ccd_sweep` on a chain of unlimited balls, `ccd_update` on mechanisms. A joint with followers goes
down the gradient. The solver `anderson_ccd` combines the last sweeps (`anderson.py`).

- *Damping*: there is none.
- *End*: `restarts.py` repeats sweeps until the target is within the tolerances, the error no longer
  changes, or the iterations allowed are made. Of a target out of reach the nearest point counts.
- *Limits*: `move_by` stops a hinge or slide at its own, `rotate_within_limits` a ball; combined
  sweeps are clamped.
- *Beyond reach* sweeps go on as within reach, and straighten a chain slowly. To 1e-4 of the reach
  ten balls take 88 where the gap is the reach, and 1,340 for a fiftieth of that, 58 with
  acceleration. Near the straight pose CCD is the method of Gauss and Seidel on a Hessian of
  r_i r_k + g r_ik: r_i is the arm of joint i, r_ik the shorter of two arms, and g the gap. The
  first term has rank one, so all directions but one rest on the gap.
- *Compiled* are the kernels at the end, with all that they call: numba compiles the same
  functions that the interpreter can run.
"""

import math

from ..articulation import BALL, FREE, HINGE, SLIDE, clamp_joint
from ..jacobians import ZERO, axis_of, frame_of
from ..quaternion import (
    IDENTITY,
    add,
    between,
    conjugate,
    dot,
    load_quaternion,
    load_vector,
    multiply,
    normalised,
    renormalised,
    rotate,
    rotation_about,
    scale,
    store_quaternion,
    subtract,
)
from .anderson import DEPTH, forget, mix
from .bounded_step import descend
from .chain import effector_error, rotate_links, update_positions
from .fabrik import reach_forward
from .mechanism import (
    cost,
    effector_position,
    effector_rotation,
    load_ball,
    move_by,
    position_error,
    rotate_to,
    rotation_error,
    rotation_weight,
    store_ball,
    store_effector,
    translate_free,
    update_forward_kinematics,
)
from .restarts import copy_row
from .solve_mechanism import kernels_of
from .wahba import ZERO_MATRIX, add_outer, add_rotation, alignment, best_angle, best_rotation


def ccd_sweep(chain, target):
    """Point each joint, from the effector's parent to the root, to bring the effector nearest.

    A joint moves only the joints below, so on the way up only the effector is followed. The
    rotations are then applied from the root down, each to its joint and all below.
    """
    n = len(chain.lengths)
    effector = load_vector(chain.positions, n)
    for k in range(n - 1, -1, -1):
        joint = load_vector(chain.positions, k)
        Q, effector = pointing(joint, effector, target)
        store_quaternion(chain.deltas, k, Q)
    above = IDENTITY
    for k in range(n):
        above = renormalised(multiply(above, load_quaternion(chain.deltas, k)))
        R = load_quaternion(chain.rotations, k)
        store_quaternion(chain.rotations, k, renormalised(multiply(above, R)))
    update_positions(chain)


def anderson_ccd_sweep(chain, target):
    """Make a sweep, and mix its joint positions with the results of earlier sweeps."""
    x, mixing = chain.row[: 3 * len(chain.positions)], chain.mixing
    copy_row(x, mixing.start)
    ccd_sweep(chain, target)
    error = effector_error(chain, target)
    if mix(mixing, x):
        reach_forward(chain)
        if effector_error(chain, target) < error:
            rotate_links(chain)
        else:
            copy_row(mixing.end, x)
            forget(mixing)


def pointing(joint, effector, target):
    """Return the shortest rotation about a joint to bring the effector nearest to the target.

    The effector moves on a sphere about the joint. The point nearest to the target lies on the ray
    from the joint to the target: the distance cannot grow. Returns this point as well.
    """
    arm, direction = subtract(effector, joint), subtract(target, joint)
    square = dot(direction, direction)
    if square == 0.0:
        return IDENTITY, effector
    length = math.sqrt(dot(arm, arm) / square)
    return between(arm, direction), add(joint, scale(length, direction))


def ccd_update(state, target):
    """Move each joint, from the effectors to the root, to bring all effectors below nearest.

    A joint rotates everything below as a body: Wahba's problem, for a hinge about its axis. A hinge
    or slide stops at its limit; a ball stays if its limits leave only worse rotations.
    """
    mechanism, data, work = state.mechanism, state.data, state.workspace
    joints = mechanism.joints
    for j in range(len(joints) - 1, -1, -1):
        if joints["followed"][j]:
            descend(mechanism, target, data, work, j)
        elif joints["leader"][j] == j:
            update_joint(mechanism, target, data, work, j)
    update_forward_kinematics(mechanism, data)


def anderson_ccd_update(state, target):
    """Make a sweep, and mix its coordinates with earlier sweeps, within the limits."""
    mechanism, data, mixing = state.mechanism, state.data, state.mixing
    joints, q = mechanism.joints, data.q
    copy_row(q, mixing.start)
    ccd_update(state, target)
    before = cost(mechanism, target, data)
    if mix(mixing, q):
        for j in range(len(joints)):
            if joints["leader"][j] == j:
                if joints["kind"][j] in (BALL, FREE):
                    store_ball(joints, q, j, normalised(load_ball(joints, q, j)))
                clamp_joint(joints, j, q)
        update_forward_kinematics(mechanism, data)
        if not cost(mechanism, target, data) < before:
            copy_row(mixing.end, q)
            update_forward_kinematics(mechanism, data)
            forget(mixing)


def update_joint(mechanism, target, data, work, j):
    """Give a joint its best coordinates; the effectors follow, the joints below do not yet."""
    joints, q, kind = mechanism.joints, data.q, mechanism.joints["kind"][j]
    axis = axis_of(joints, j, load_quaternion(data.rotations, j))
    if kind == SLIDE:
        distance = move_by(joints, q, j, dot(axis, mean_error(mechanism, target, data, j)))
        translate_effectors(mechanism, data, j, scale(distance, axis))
        return
    M = attitude_profile(mechanism, target, data, j)
    if kind == HINGE:
        Q = rotation_about(axis, move_by(joints, q, j, best_angle(M, axis)))
    else:
        Q = rotate_within_limits(mechanism, target, data, work, j, M)
    rotate_effectors(mechanism, data, j, Q)
    if kind == FREE:
        v = mean_error(mechanism, target, data, j)
        translate_effectors(mechanism, data, j, v)
        frame = frame_of(joints, j, data.rotations)
        translate_free(joints, q, j, rotate(conjugate(frame), v))


def attitude_profile(mechanism, target, data, j):
    """Return Wahba's M of the arms from joint j to the effectors below, and of their rotations."""
    M, x = ZERO_MATRIX, load_vector(data.positions, j)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            weight = target["weight"][e]
            arm = subtract(effector_position(mechanism, data, e), x)
            M = add_outer(M, weight, subtract(load_vector(target["position"], e), x), arm)
            if mechanism.effectors["oriented"][e]:
                error = rotation_error(mechanism, target, data, e)
                M = add_rotation(M, weight * rotation_weight(mechanism), error)
    return M


def mean_error(mechanism, target, data, j):
    """Return the weighted mean of the vectors from the effectors below joint j to their targets."""
    total, error = 0.0, ZERO
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            weight = target["weight"][e]
            total += weight
            error = add(error, scale(weight, position_error(mechanism, target, data, e)))
    return scale(1.0 / total, error) if total > 0.0 else error


def rotate_within_limits(mechanism, target, data, work, j, M):
    """Rotate a ball or free joint as is best within its limits; return the rotation made."""
    joints, R = mechanism.joints, load_quaternion(data.rotations, j)
    Q = unlimited_rotation(mechanism, target, data, work, j, M)
    before = load_ball(joints, data.q, j)
    moved = rotate_to(joints, data.q, j, frame_of(joints, j, data.rotations), multiply(Q, R))
    allowed = renormalised(multiply(moved, conjugate(R)))
    if joints["kind"][j] == BALL and alignment(M, allowed) < alignment(M, IDENTITY):
        store_ball(joints, data.q, j, before)
        return IDENTITY
    return allowed


def unlimited_rotation(mechanism, target, data, work, j, M):
    """Return the best rotation of joint j without limits, for a single position the shortest."""
    count, arm, direction = 0, ZERO, ZERO
    x = load_vector(data.positions, j)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            count += 2 if mechanism.effectors["oriented"][e] else 1
            arm = subtract(effector_position(mechanism, data, e), x)
            direction = subtract(load_vector(target["position"], e), x)
    return between(arm, direction) if count == 1 else best_rotation(M, work.eigen[0], work.eigen[1])


def rotate_effectors(mechanism, data, j, Q):
    """Rotate the effectors below joint j about the joint."""
    x = load_vector(data.positions, j)
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            arm = subtract(effector_position(mechanism, data, e), x)
            R = multiply(Q, effector_rotation(mechanism, data, e))
            store_effector(mechanism, data, e, add(x, rotate(Q, arm)), R)


def translate_effectors(mechanism, data, j, v):
    """Translate the effectors below joint j."""
    for e in range(len(mechanism.effectors)):
        if mechanism.moves[j, e]:
            moved = add(effector_position(mechanism, data, e), v)
            store_effector(mechanism, data, e, moved, effector_rotation(mechanism, data, e))


ON_CHAINS, ON_MECHANISMS = kernels_of("ccd", ccd_sweep, ccd_update)
ANDERSON_ON_CHAINS, ANDERSON_ON_MECHANISMS = kernels_of(
    "anderson_ccd", anderson_ccd_sweep, anderson_ccd_update, DEPTH
)
