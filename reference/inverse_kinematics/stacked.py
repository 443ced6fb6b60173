"""What the Jacobian methods share on mechanisms: all effectors' errors and Jacobians stacked.

Rows of e are the ways from effectors to targets [m], and, where rotations matter, the rotation
vectors times a lever [m], each times the root of its effector's weight. J' is kept row by row, a
row a degree of freedom. The damped step J' (J J' + damping 1)^-1 e needs a matrix of the size of e
only, however many joints there are.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..articulation import (
    AT,
    BALL,
    FREE,
    FREEDOM,
    HINGE,
    KIND,
    LEADER,
    LOWER,
    MULTIPLIER,
    SLIDE,
    UPPER,
    clamp_joint,
)
from ..quaternion import (
    cross,
    exponential,
    load_quaternion,
    load_vector,
    logarithm,
    multiply,
    normalised,
    rotate,
    scale,
    subtract,
)
from .jacobian import LEAST_DAMPING
from .mechanism import (
    LEVER,
    ORIENTED,
    ROW,
    WEIGHT,
    axis_of,
    frame_of,
    is_followed,
    moves,
    place,
    position_error,
    tip,
    wrong_turn,
)

WHOLE = 2.0 * math.pi


class Stack(NamedTuple):
    """Room for the linear system.

    Attributes:
        e: errors [m], (equation,).
        J: the Jacobian transposed, each row times what a unit of its freedom is worth, (freedom,
            equation).
        A: J J' + damping and then its Cholesky factor, (equation, equation).
        z: (A)^-1 e, (equation,).
        step: of the freedoms, over what a unit is worth, (freedom,).
        held: 1 where the upper limit stops a freedom, -1 where the lower does, (freedom,).
    """

    e: FloatArray
    J: FloatArray
    A: FloatArray
    z: FloatArray
    step: FloatArray
    held: FloatArray


def new_stack(mechanism):
    """Return room for the linear system of a mechanism."""
    m, n = mechanism.equations, mechanism.freedoms
    return Stack(
        np.empty(m), np.empty((n, m)), np.empty((m, m)), np.empty(m), np.empty(n), np.empty(n)
    )


def linearise_all(mechanism, goal, posture, stack):
    """Fill e and J at a posture."""
    lever = LEVER * mechanism.reach
    for e in range(len(mechanism.effectors)):
        row, root = mechanism.effectors[e, ROW], math.sqrt(goal[e, WEIGHT])
        put(stack.e, row, scale(root, position_error(mechanism, goal, posture, e)))
        if mechanism.effectors[e, ORIENTED]:
            put(
                stack.e,
                row + 3,
                scale(root * lever, logarithm(wrong_turn(mechanism, goal, posture, e))),
            )
    joints = mechanism.joints
    for k in range(len(stack.J)):
        clear(stack.J[k])
    for j in range(len(joints.integers)):
        R = load_quaternion(posture.rotations, j)
        kind, k = joints.integers[j, KIND], joints.integers[j, FREEDOM]
        leader = joints.integers[j, LEADER]
        factor = joints.numbers[j, MULTIPLIER] * freedom_worth(mechanism, leader)
        if kind == HINGE:
            axis = scale(factor, axis_of(joints, j, R))
            add_turn_row(mechanism, goal, posture, stack, j, k, axis)
        elif kind == SLIDE:
            add_shift_row(mechanism, goal, stack, j, k, scale(factor, axis_of(joints, j, R)))
        elif kind == BALL:
            add_turn_rows(mechanism, goal, posture, stack, j, k, R)
        elif kind == FREE:
            add_shift_rows(mechanism, goal, stack, j, k, frame_of(joints, j, posture))
            add_turn_rows(mechanism, goal, posture, stack, j, k + 3, R)


def add_turn_rows(mechanism, goal, posture, stack, j, k, R):
    """Add to J the turns of joint j about the axes of its own frame, from freedom k on."""
    add_turn_row(mechanism, goal, posture, stack, j, k, rotate(R, (1.0, 0.0, 0.0)))
    add_turn_row(mechanism, goal, posture, stack, j, k + 1, rotate(R, (0.0, 1.0, 0.0)))
    add_turn_row(mechanism, goal, posture, stack, j, k + 2, rotate(R, (0.0, 0.0, 1.0)))


def add_shift_rows(mechanism, goal, stack, j, k, R):
    """Add to J the shifts of joint j along the axes of a frame, from freedom k on."""
    reach = mechanism.reach
    add_shift_row(mechanism, goal, stack, j, k, rotate(R, (reach, 0.0, 0.0)))
    add_shift_row(mechanism, goal, stack, j, k + 1, rotate(R, (0.0, reach, 0.0)))
    add_shift_row(mechanism, goal, stack, j, k + 2, rotate(R, (0.0, 0.0, reach)))


def add_turn_row(mechanism, goal, posture, stack, j, k, axis):
    """Add to row k what a turn of joint j about a world axis does to the effectors below."""
    lever = LEVER * mechanism.reach
    x = load_vector(posture.positions, j)
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            row, root = mechanism.effectors[e, ROW], math.sqrt(goal[e, WEIGHT])
            move = cross(axis, subtract(tip(mechanism, posture, e), x))
            put_sum(stack.J[k], row, scale(root, move))
            if mechanism.effectors[e, ORIENTED]:
                put_sum(stack.J[k], row + 3, scale(root * lever, axis))


def add_shift_row(mechanism, goal, stack, j, k, way):
    """Add to row k what a shift of joint j by a way in the world does to the effectors below."""
    for e in range(len(mechanism.effectors)):
        if moves(mechanism, j, e):
            root = math.sqrt(goal[e, WEIGHT])
            put_sum(stack.J[k], mechanism.effectors[e, ROW], scale(root, way))


def clear(row):
    """Set all entries of a row to zero."""
    for i in range(len(row)):
        row[i] = 0.0


def put(row, i, v):
    """Write a vector into three entries of a row."""
    row[i], row[i + 1], row[i + 2] = v


def put_sum(row, i, v):
    """Add a vector to three entries of a row."""
    row[i] += v[0]
    row[i + 1] += v[1]
    row[i + 2] += v[2]


def squared(v):
    """Return the sum of the squares of an array's entries."""
    total = 0.0
    for i in range(len(v)):
        total += v[i] * v[i]
    return total


def damped_step(mechanism, posture, stack, damping):
    """Fill the step J' (J J' + damping 1)^-1 e within the limits of hinges and slides.

    A freedom that the step would take beyond its limit is held at it, its part of the way is taken
    from e, and the others are asked again; one that would then rather step back is let go. What
    remains is the constrained optimum of |e - J q|^2 + damping |q|^2.
    """
    clear(stack.held)
    clear(stack.step)
    any_held = False
    for _ in range(2 * len(stack.step) + 1):
        solve_damped(stack, damping)
        for k in range(len(stack.step)):
            if stack.held[k] == 0.0:
                stack.step[k] = inner(stack.J[k], stack.z)
        if hold_limited(mechanism, posture, stack):
            any_held = True
        elif not (any_held and let_go(stack)):
            return


def let_go(stack):
    """Let go of the held freedom that would most step back from its limit; return whether of any.

    With z = (e - J q) / damping, a freedom k that is free steps J_k z.
    """
    worst, most = -1, 0.0
    for k in range(len(stack.step)):
        if stack.held[k] != 0.0:
            back = stack.held[k] * (stack.step[k] - inner(stack.J[k], stack.z))
            if back > most:
                worst, most = k, back
    if worst < 0:
        return False
    stack.held[worst] = 0.0
    for i in range(len(stack.e)):
        stack.e[i] += stack.step[worst] * stack.J[worst, i]
    return True


def transposed_step(mechanism, posture, stack):
    """Fill the step a J' e, a = <e, J J' e> / |J J' e|^2, without what limits stop."""
    clear(stack.held)
    for _ in range(len(stack.step) + 1):
        square, moved = along_gradient(stack)
        for k in range(len(stack.step)):
            if stack.held[k] == 0.0 and moved > 0.0:
                stack.step[k] *= square / moved
            else:
                stack.step[k] = 0.0
        if not stop_at_limits(mechanism, posture, stack):
            return


def along_gradient(stack):
    """Fill the step J' e and z = J J' e over the freedoms not held; return <e, z> and |z|^2."""
    clear(stack.z)
    for k in range(len(stack.step)):
        if stack.held[k] == 0.0:
            stack.step[k] = inner(stack.J[k], stack.e)
            for i in range(len(stack.z)):
                stack.z[i] += stack.step[k] * stack.J[k, i]
    return inner(stack.e, stack.z), squared(stack.z)


def stop_at_limits(mechanism, posture, stack):
    """Hold the freedoms at a limit that the step would take further; return whether any were."""
    joints, any_held = mechanism.joints, False
    for j in range(len(joints.integers)):
        k = joints.integers[j, FREEDOM]
        if is_limited(joints, j) and stack.held[k] == 0.0:
            q, step = posture.q[joints.integers[j, AT]], stack.step[k]
            beyond = q >= joints.numbers[j, UPPER] if step > 0.0 else q <= joints.numbers[j, LOWER]
            if beyond and step != 0.0:
                stack.held[k] = 1.0
                any_held = True
    return any_held


def freedom_worth(mechanism, j):
    """Return what a unit of a hinge's or slide's freedom is worth: 1 rad, or the reach [m]."""
    return mechanism.reach if mechanism.joints.integers[j, KIND] == SLIDE else 1.0


def is_limited(joints, j):
    """Return whether a joint is a hinge or slide that moves by itself."""
    return joints.integers[j, KIND] in (HINGE, SLIDE) and joints.integers[j, LEADER] == j


def solve_damped(stack, damping):
    """Fill z of (J J' + damping 1) z = e over the freedoms that are not held."""
    m = len(stack.e)
    if m == 6:  # the compiler lays out what is of known size
        fill_matrix(stack, damping, 6)
        solve(stack, 6)
    elif m == 3:
        fill_matrix(stack, damping, 3)
        solve(stack, 3)
    else:
        fill_matrix(stack, damping, m)
        solve(stack, m)


def fill_matrix(stack, damping, m):
    """Fill the lower triangle of A = J J' + damping 1, (m, m), over the freedoms not held.

    The damping is held above rounding, so that A has factors even where J J' is singular.
    """
    A, J = stack.A, stack.J
    for i in range(m):
        for j in range(i + 1):
            A[i, j] = 0.0
    for k in range(len(J)):
        if stack.held[k] == 0.0:
            for i in range(m):
                for j in range(i + 1):
                    A[i, j] += J[k, i] * J[k, j]
    for i in range(m):
        damping += LEAST_DAMPING * A[i, i]
    for i in range(m):
        A[i, i] += damping


def solve(stack, m):
    """Fill z of A z = e by the factors L D L', which overwrite A; 1/D comes on the diagonal."""
    A, z = stack.A, stack.z
    for i in range(m):
        z[i] = stack.e[i]
        for j in range(i):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s
        for j in range(i):
            s = A[i, j] * A[j, j]
            A[i, i] -= s * A[i, j]
            A[i, j] = s
            z[i] -= s * z[j]
        A[i, i] = 1.0 / A[i, i]
    for i in range(m - 1, -1, -1):
        z[i] *= A[i, i]
        for j in range(i + 1, m):
            z[i] -= A[j, i] * z[j]


def inner(a, b):
    """Return the scalar product of two rows."""
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


def hold_limited(mechanism, posture, stack):
    """Hold the freedoms that the step takes beyond their limits; return whether there were any."""
    joints, any_held = mechanism.joints, False
    for j in range(len(joints.integers)):
        kind, k = joints.integers[j, KIND], joints.integers[j, FREEDOM]
        if joints.integers[j, LEADER] != j or kind not in (HINGE, SLIDE) or stack.held[k] != 0.0:
            continue
        q, worth = posture.q[joints.integers[j, AT]], freedom_worth(mechanism, j)
        wanted = q + worth * stack.step[k]
        bounded = min(max(wanted, joints.numbers[j, LOWER]), joints.numbers[j, UPPER])
        if bounded != wanted and not turns_round(mechanism, j):
            stack.held[k] = 1.0 if wanted > bounded else -1.0
            stack.step[k] = (bounded - q) / worth
            for i in range(len(stack.e)):
                stack.e[i] -= stack.step[k] * stack.J[k, i]
            any_held = True
    return any_held


def take_step(mechanism, posture, stack):
    """Change the coordinates by the step, within the limits."""
    joints, q, step = mechanism.joints, posture.q, stack.step
    for j in range(len(joints.integers)):
        kind, k, at = joints.integers[j, KIND], joints.integers[j, FREEDOM], joints.integers[j, AT]
        if joints.integers[j, LEADER] != j:
            continue
        if kind in (HINGE, SLIDE):
            q[at] += freedom_worth(mechanism, j) * step[k]
            if turns_round(mechanism, j):
                q[at] = same_turn(joints, j, q[at])
        elif kind == BALL:
            turn_by(q, at, step, k)
        elif kind == FREE:
            for i in range(3):
                q[at + i] += mechanism.reach * step[k + i]
            turn_by(q, at + 3, step, k + 3)
        clamp_joint(joints, j, q)
    place(mechanism, posture)


def turns_round(mechanism, j):
    """Return whether a hinge's limits leave a whole turn, so that none of them need stop it."""
    joints = mechanism.joints
    turn = joints.numbers[j, UPPER] - joints.numbers[j, LOWER]
    return joints.integers[j, KIND] == HINGE and turn >= WHOLE and not is_followed(mechanism, j)


def same_turn(joints, j, angle):
    """Return the angle that is the same turn within the limits, the nearest to that given."""
    lower, upper = joints.numbers[j, LOWER], joints.numbers[j, UPPER]
    if angle > upper:
        return angle - WHOLE * math.ceil((angle - upper) / WHOLE)
    if angle < lower:
        return angle + WHOLE * math.ceil((lower - angle) / WHOLE)
    return angle


def turn_by(q, at, step, k):
    """Turn a quaternion among the coordinates by a rotation vector in its own frame."""
    turn = exponential((step[k], step[k + 1], step[k + 2]))
    w, x, y, z = normalised(multiply((q[at], q[at + 1], q[at + 2], q[at + 3]), turn))
    q[at], q[at + 1], q[at + 2], q[at + 3] = w, x, y, z
