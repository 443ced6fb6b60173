"""Newton's method over all frames of a motion at once, on the poses that meet their goals.

Steps lie in the null spaces of the frames' Jacobians and are led back onto the path, so that the
cost itself is what must go down. Its second derivatives within the null spaces are those of the
cost less the multipliers of the path times those of the effectors, the multipliers the least
squares fit to the gradient (Absil, Mahony & Sepulchre 2008, Riemannian Newton on a submanifold).
What is not positive definite is shifted until it is, and so is a step that does not go down
(Levenberg-Marquardt).
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..backend.compiled import TwoSpeeds
from .augmented_lagrangian import add_limits, limits_cost, push_limits, raise_multipliers
from .cyclic_banded import Ring
from .problem import Course, jumps, moved, path, pseudoinverse, restored
from .smoothness import add_jumps
from .task_derivatives import subtract_second

# The penalty of overstepping a limit by 1 rad, and that of a goal that a frame is only drawn to, by
# the reach.
LIMIT, DRAWN = 100.0, 100.0
# A motion is at rest when a step promises no more than this share of the cost, or of this cost.
REST, NOTHING = 1e-14, 1e-20
# Limits are kept when no multiplier changes by more than this, over the penalty [rad].
KEPT = 1e-10
# Multipliers follow the motion once steps are no longer than this [rad].
CALM = 0.1
MOST_STEPS = 100
# How often the limits that a step touches are found anew.
MOST_TOUCHES = 10
# The second derivatives are about 1.
FIRST_SHIFT, LEAST_SHIFT, SOME_SHIFT, MOST_SHIFT = 1e-6, 1e-12, 1e-7, 1e4
# Of what a step promises: it is accepted above the first share, and trusted above the second.
ACCEPTED, TRUSTED = 1e-4, 0.75

_add_jumps, _add_limits = TwoSpeeds(add_jumps), TwoSpeeds(add_limits)
_limits_cost, _raise = TwoSpeeds(limits_cost), TwoSpeeds(raise_multipliers)
_push, _subtract_second = TwoSpeeds(push_limits), TwoSpeeds(subtract_second)


class Model(NamedTuple):
    """The cost about a motion to second order, limits left out.

    Attributes:
        cost: of the motion, limits included.
        gradient: (frame, freedom).
        within: second derivatives by each frame, (frame, freedom, freedom).
        between: those within the null spaces by the frame after each jump and the one before it,
            (jump, freedom, freedom).
        P: projections onto the null spaces, (frame, freedom, freedom).
    """

    cost: float
    gradient: FloatArray
    within: FloatArray
    between: FloatArray
    P: FloatArray


class Taken(NamedTuple):
    """A step that was accepted: where it leads, how long it was, what it promised, the shift."""

    q: FloatArray
    length: float
    promise: float
    shift: float


def descend(course: Course, q: FloatArray) -> tuple[FloatArray, int]:
    """Return the motion of least cost near one that is on its path, and the steps to it."""
    ring = Ring(len(q), course.mechanism.freedoms, course.closed)
    z, shift = np.zeros((len(q), len(course.mechanism.joints.integers), 3)), FIRST_SHIFT
    steps, done = 0, False
    while steps < MOST_STEPS and not done:
        steps += 1
        model = expanded(course, q, z)
        taken = lower(course, q, z, model, ring, shift)
        if taken is None:
            break
        q, shift, change = taken.q, taken.shift, np.inf
        if taken.length <= CALM:
            change = _raise(course.mechanism.joints, course.worth, q, z, LIMIT)
        done = abs(taken.promise) <= REST * model.cost + NOTHING and change <= KEPT
    return q, steps


def cost(course: Course, q: FloatArray, z: FloatArray) -> float:
    """Return half the squared jumps, and what limits and goals not met cost."""
    d, (e, _) = jumps(course, q), path(course, q)
    limits = _limits_cost(course.mechanism.joints, course.worth, q, z, LIMIT)
    return 0.5 * float((d * d).sum() + DRAWN * (e[~course.strict] ** 2).sum()) + limits


def expanded(course: Course, q: FloatArray, z: FloatArray) -> Model:
    """Return the cost about a motion to second order."""
    mechanism, (frames, n) = course.mechanism, (len(q), course.mechanism.freedoms)
    d, (e, J) = jumps(course, q), path(course, q)
    gradient, within = np.zeros((frames, n)), np.zeros((frames, n, n))
    between = np.zeros((len(d), n, n))
    _add_jumps(mechanism.joints, d, gradient, within, between)
    K, drawn = pseudoinverse(J), ~course.strict
    pushed = gradient.copy()
    _push(mechanism.joints, course.worth, q, z, LIMIT, pushed)
    m = np.einsum("fek,fk->fe", K, pushed)
    P = np.eye(n) - J.swapaxes(-1, -2) @ K
    P[drawn], m[drawn] = np.eye(n), DRAWN * e[drawn]
    gradient[drawn] -= np.einsum("fek,fe->fk", J[drawn], m[drawn])
    within[drawn] += DRAWN * J[drawn].swapaxes(-1, -2) @ J[drawn]
    _subtract_second(mechanism, course.worth, course.goals, q, m / mechanism.reach, within)
    after = np.roll(P, -1, axis=0)[: len(d)]
    return Model(cost(course, q, z), gradient, within, after @ between @ P[: len(d)], P)


def lower(
    course: Course, q: FloatArray, z: FloatArray, model: Model, ring: Ring, shift: float
) -> Taken | None:
    """Return a step that lowers the cost, with as small a shift as need be, or None."""
    while shift <= MOST_SHIFT:
        step, promise = newton_step(course, q, z, model, ring, shift)
        if step is not None:
            rounding = abs(promise) <= REST * model.cost + NOTHING
            there, on = restored(course, moved(course, q, step))
            if on[course.strict].all():
                gain = model.cost - cost(course, there, z)
                if rounding or gain >= ACCEPTED * abs(promise):
                    trusted = rounding or gain >= TRUSTED * promise
                    after = max(shift / 16.0, LEAST_SHIFT) if trusted else shift
                    return Taken(there, float(np.abs(step).max()), promise, after)
        shift = max(4.0 * shift, SOME_SHIFT)
    return None


def newton_step(
    course: Course, q: FloatArray, z: FloatArray, model: Model, ring: Ring, shift: float
) -> tuple[FloatArray | None, float]:
    """Return the step to the least value of the shifted model, and what it promises.

    Limits that it comes to touch or to leave are taken into account until they are the same.
    """
    step, promise = np.zeros_like(model.gradient), 0.0
    touched = np.full((len(q), len(course.mechanism.joints.integers), 3), -1)
    for _ in range(MOST_TOUCHES):
        gradient, within, surplus, same = limited(course, q, z, model, step, touched)
        if same:
            break
        gradient, within = projected(model.P, gradient, within)
        ring.fill(within, model.between)
        found = ring.solve(-gradient, shift)
        if found is None:
            return None, 0.0
        step = found
        promise = 0.5 * float((step * (shift * step - gradient)).sum()) - surplus
    return step, promise


def limited(
    course: Course,
    q: FloatArray,
    z: FloatArray,
    model: Model,
    step: FloatArray,
    touched: np.ndarray,
) -> tuple[FloatArray, FloatArray, float, bool]:
    """Return gradient and second derivatives by each frame, with the limits that a step touches.

    See `limits.add_limits` for the rest.
    """
    gradient, within = model.gradient.copy(), model.within.copy()
    surplus, same = _add_limits(
        course.mechanism.joints, course.worth, q, z, LIMIT, step, gradient, within, touched
    )
    return gradient, within, surplus, same


def projected(
    P: FloatArray, gradient: FloatArray, within: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return both within the null spaces; across them the second derivatives are 1."""
    return np.einsum("fkl,fl->fk", P, gradient), P @ within @ P + np.eye(P.shape[-1]) - P
