"""Joint limits as terms of an augmented Lagrangian, with the derivatives that Newton needs.

Each limit h(q) <= 0 adds psi = (max(0, z + r h)^2 - z^2) / 2 r, z its multiplier and r the penalty
(Rockafellar 1973; Nocedal & Wright 2006, chapter 17); after a step z becomes max(0, z + r h). The
gradient is max(0, z + r h) grad h, and where a limit is active the Gauss-Newton Hessian is
r grad h grad h'.

A ball with the twist axis u rotates by Q = w + v; with s = v . u its twist is 2 atan(s/w), of
gradient (w (w u + u x v) + s v)/(w^2 + s^2) in the ball's own frame. Its swing is the angle from u
to Q u, of gradient along Q* u x u.
"""

import math

import numpy as np

from ..arguments import IndexArray, RecordArray
from ..articulation import BALL, FREEDOMS, HINGE, SLIDE, swing_twist
from ..quaternion import add, conjugate, cross, dot, load_vector, norm, rotate, scale

# The bounds of a joint.
LOWER, UPPER, CONE = range(3)
# r: the penalty of exceeding a limit by 1 rad.
PENALTY = 100.0
# The swing has no gradient where its sine, the twist where w^2 + s^2 is below this (squared).
DEGENERATE = 1e-9


def joint_limits(joints: RecordArray) -> IndexArray:
    """Return the joint and the bound, LOWER, UPPER or CONE, of every finite limit, (limit, 2)."""
    limits = [
        (j, bound)
        for j, joint in enumerate(joints)
        for bound in ((LOWER, UPPER, CONE) if joint["kind"] == BALL else (LOWER, UPPER))
        if joint["leader"] == j
        and joint["kind"] in (HINGE, SLIDE, BALL)
        and np.isfinite(bound_of(joints, j, bound))
    ]
    return np.array(limits, dtype=np.int64).reshape(-1, 2)


def bound_of(joints, j, bound):
    """Return the value of a bound of a joint [rad or m]."""
    if bound == LOWER:
        return joints["lower"][j]
    return joints["upper"][j] if bound == UPPER else joints["cone"][j]


def excess(problem, q, limit):
    """Return by how much a limit is exceeded, h [rad, or m over the reach], and its gradient."""
    joints, j, bound = problem.mechanism.joints, problem.limits[limit, 0], problem.limits[limit, 1]
    value, sign = bound_of(joints, j, bound), -1.0 if bound == LOWER else 1.0
    at = joints["coordinate"][j]
    if joints["kind"][j] != BALL:
        unit = problem.units[joints["freedom"][j]]
        return sign * (q[at] - value) / unit, (sign, 0.0, 0.0)
    Q, u = (q[at], q[at + 1], q[at + 2], q[at + 3]), load_vector(joints["axis"], j)
    if bound == CONE:
        swing, gradient = swing_and_gradient(Q, u)
        return swing - value, gradient
    _, twist = swing_twist(Q, u)
    return sign * (twist - value), scale(sign, twist_gradient(Q, u))


def swing_and_gradient(Q, u):
    """Return the angle [rad] from u to Q u, and its gradient, zero where it has none."""
    rotated = rotate(conjugate(Q), u)
    normal = cross(rotated, u)
    sine = norm(normal)
    swing = math.atan2(sine, dot(rotated, u))
    return swing, scale(1.0 / sine if sine > DEGENERATE else 0.0, normal)


def twist_gradient(Q, u):
    """Return the gradient of the twist about u, zero where it has none."""
    w, v = Q[0], (Q[1], Q[2], Q[3])
    s = dot(v, u)
    square = w * w + s * s
    if square <= DEGENERATE * DEGENERATE:
        return 0.0, 0.0, 0.0
    gradient = add(scale(w, add(scale(w, u), cross(u, v))), scale(s, v))
    return scale(1.0 / square, gradient)


def limit_cost(problem, q, z):
    """Return the sum of psi over all frames and limits; z holds multipliers, (frame, limit)."""
    total = 0.0
    for f in range(len(q)):
        for i in range(len(problem.limits)):
            h, _ = excess(problem, q[f], i)
            force = max(0.0, z[f, i] + PENALTY * h)
            total += 0.5 * (force * force - z[f, i] * z[f, i]) / PENALTY
    return total


def add_active_limits(problem, q, z, step, gradient, diagonal, active):
    """Add the derivatives of the limits that are active where a step ends.

    psi has a kink where a limit becomes active: to second order it is a parabola above it and
    zero below, and the step decides which. `active`, (frame, limit), is set to whether it
    is the parabola.

    Returns:
        By how much the parabolas exceed psi where the step begins, to be taken off the decrease
        that they predict; and whether `active` has changed.
    """
    joints, surplus, changed = problem.mechanism.joints, 0.0, False
    for f in range(len(q)):
        for i in range(len(problem.limits)):
            j = problem.limits[i, 0]
            k, n = joints["freedom"][j], FREEDOMS[joints["kind"][j]]
            h, normal = excess(problem, q[f], i)
            force, slope = z[f, i] + PENALTY * h, 0.0
            for a in range(n):
                slope += normal[a] * step[f, k + a]
            at_end = force + PENALTY * slope
            if at_end > 0.0:
                if force < 0.0:
                    surplus += 0.5 * force * force / PENALTY
                for a in range(n):
                    gradient[f, k + a] += force * normal[a]
                    for b in range(n):
                        diagonal[f, k + a, k + b] += PENALTY * normal[a] * normal[b]
            changed |= active[f, i] != (at_end > 0.0)
            active[f, i] = at_end > 0.0
    return surplus, changed


def update_multipliers(problem, q, z):
    """Set z to max(0, z + r h); return the largest change over r."""
    change = 0.0
    for f in range(len(q)):
        for i in range(len(problem.limits)):
            h, _ = excess(problem, q[f], i)
            force = max(0.0, z[f, i] + PENALTY * h)
            change = max(change, abs(force - z[f, i]) / PENALTY)
            z[f, i] = force
    return change
