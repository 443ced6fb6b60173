"""Joints within their limits: what it costs to leave them, by Newton.

A multiplier z and a penalty r keep h <= 0, h by how much a limit is overstepped: (max(0, z + r h)^2
- z^2) / 2 r (Rockafellar 1973). Its gradient is max(0, z + r h) times that of h. For a ball with
the twist axis u, with Q = w + v and s = v . u: the twist is 2 atan(s/w), whose gradient in the
ball's own frame is (w (w u + u x v) + s v)/(w^2 + s^2); the tilt is the angle from u to Q u, whose
gradient is the unit vector along Q* u x u.
"""

import math

from ..articulation import (
    AT,
    AXIS,
    BALL,
    CONE,
    FREEDOM,
    HINGE,
    KIND,
    LEADER,
    LOWER,
    SLIDE,
    UPPER,
    swing_twist,
)
from ..quaternion import add, conjugate, cross, dot, norm, rotate, scale, vector_at

# The limits of a joint, in the order of their multipliers: columns of JointArrays.numbers.
SIDES = (LOWER, UPPER, CONE)
# A ball tilted by less, or by all but this much from half a turn, is tilted in no direction.
STRAIGHT = 1e-9


def is_limit(joints, j, side):
    """Return whether a joint has this limit."""
    kind, own = joints.integers[j, KIND], joints.integers[j, LEADER] == j
    fits = kind == BALL if side == CONE else kind in (HINGE, SLIDE, BALL)
    return own and fits and abs(joints.numbers[j, side]) < math.inf


def overstep(joints, worth, q, j, side):
    """Return by how much a joint oversteps a limit, ways over the reach, and the gradient."""
    at = joints.integers[j, AT]
    bound, sign = joints.numbers[j, side], -1.0 if side == LOWER else 1.0
    if joints.integers[j, KIND] != BALL:
        unit = worth[joints.integers[j, FREEDOM]]
        return sign * (q[at] - bound) / unit, (sign, 0.0, 0.0)
    Q, u = (q[at], q[at + 1], q[at + 2], q[at + 3]), vector_at(joints.numbers, j, AXIS)
    if side == CONE:
        tilt, gradient = tilt_of(Q, u)
        return tilt - bound, gradient
    _, twist = swing_twist(Q, u)
    return sign * (twist - bound), scale(sign, twist_gradient(Q, u))


def tilt_of(Q, u):
    """Return the angle [rad] from u to Q u, and its gradient, zero where it has none."""
    seen = rotate(conjugate(Q), u)
    across = cross(seen, u)
    sine = norm(across)
    tilt = math.atan2(sine, dot(seen, u))
    return tilt, scale(1.0 / sine if sine > STRAIGHT else 0.0, across)


def twist_gradient(Q, u):
    """Return the gradient of the twist about u, zero where there is no twist."""
    w, v = Q[0], (Q[1], Q[2], Q[3])
    s = dot(v, u)
    square = w * w + s * s
    if square <= STRAIGHT * STRAIGHT:
        return 0.0, 0.0, 0.0
    gradient = add(scale(w, add(scale(w, u), cross(u, v))), scale(s, v))
    return scale(1.0 / square, gradient)


def limits_cost(joints, worth, q, z, penalty):
    """Return what the limits cost in all frames; z are the multipliers, (frame, joint, 3)."""
    total = 0.0
    for f in range(len(q)):
        for j in range(len(joints.integers)):
            for i in range(3):
                if is_limit(joints, j, SIDES[i]):
                    h, _ = overstep(joints, worth, q[f], j, SIDES[i])
                    push = max(0.0, z[f, j, i] + penalty * h)
                    total += 0.5 * (push * push - z[f, j, i] * z[f, j, i]) / penalty
    return total


def add_limits(joints, worth, q, z, penalty, step, gradient, within, touched):
    """Add the derivatives of the pieces of that in which a step ends, see `descent.Model`.

    The cost has a kink where a limit begins to push: to second order it is one parabola on the far
    side and nothing on the near one. Marks the limits `touched`, (frame, joint, 3), by 1.

    Returns:
        By how much those parabolas are above the cost where the step begins, and whether they are
        the ones that were marked before.
    """
    surplus, same = 0.0, True
    for f in range(len(q)):
        for j in range(len(joints.integers)):
            for i in range(3):
                before, touched[f, j, i] = touched[f, j, i], 0
                if is_limit(joints, j, SIDES[i]):
                    h, normal = overstep(joints, worth, q[f], j, SIDES[i])
                    push = z[f, j, i] + penalty * h
                    if push + penalty * along(joints, j, normal, step[f]) > 0.0:
                        touched[f, j, i] = 1
                        add_limit(joints, j, push, penalty, normal, gradient[f], within[f])
                        if push < 0.0:
                            surplus += 0.5 * push * push / penalty
                same &= before == touched[f, j, i]
    return surplus, same


def push_limits(joints, worth, q, z, penalty, gradient):
    """Add the gradient of the limits' cost, (frame, freedom)."""
    for f in range(len(q)):
        for j in range(len(joints.integers)):
            for i in range(3):
                if is_limit(joints, j, SIDES[i]):
                    h, normal = overstep(joints, worth, q[f], j, SIDES[i])
                    k, push = joints.integers[j, FREEDOM], max(0.0, z[f, j, i] + penalty * h)
                    for a in range(3 if joints.integers[j, KIND] == BALL else 1):
                        gradient[f, k + a] += push * normal[a]


def along(joints, j, normal, step):
    """Return by how much a step oversteps a limit of joint j further."""
    k, total = joints.integers[j, FREEDOM], 0.0
    for a in range(3 if joints.integers[j, KIND] == BALL else 1):
        total += normal[a] * step[k + a]
    return total


def add_limit(joints, j, push, penalty, normal, gradient, within):
    """Add the derivatives of one limit's parabola."""
    k = joints.integers[j, FREEDOM]
    for a in range(3 if joints.integers[j, KIND] == BALL else 1):
        gradient[k + a] += push * normal[a]
        for b in range(3 if joints.integers[j, KIND] == BALL else 1):
            within[k + a, k + b] += penalty * normal[a] * normal[b]


def raise_multipliers(joints, worth, q, z, penalty):
    """Set z to max(0, z + r h); return the largest change over r."""
    change = 0.0
    for f in range(len(q)):
        for j in range(len(joints.integers)):
            for i in range(3):
                if is_limit(joints, j, SIDES[i]):
                    h, _ = overstep(joints, worth, q[f], j, SIDES[i])
                    raised = max(0.0, z[f, j, i] + penalty * h)
                    change = max(change, abs(raised - z[f, j, i]) / penalty)
                    z[f, j, i] = raised
    return change
