"""The linear system of a task, and the steps of the Jacobian methods within limits, by active sets.

The errors of all effectors are stacked: the vector to the target [m] and, where the rotation
matters, a lever [m] times the rotation vector. Both are times the root of the effector's weight.
The Jacobian, transposed, holds a row a freedom: the motion of the effectors by its unit.

The damped step J' (J J' + damping 1)^-1 e needs a matrix of the size of e only, however many joints
there are. A freedom stopped by a limit is active: the others are solved for again without it.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..articulation import BALL, FREE, FREEDOMS, HINGE, SLIDE, clamp_joint
from ..jacobians import accumulate, motion, move_joint, velocity_at
from ..quaternion import load_vector, logarithm, normalised, scale, subtract
from .linear_algebra import ROUNDING_DAMPING, clear, inner, solve, store
from .mechanism import (
    LEVER,
    cost,
    effector_position,
    load_ball,
    move_by,
    position_error,
    rotation_error,
    store_ball,
    update_forward_kinematics,
)

FULL_CIRCLE = 2.0 * math.pi  # [rad]
# The step of a joint with followers is halved at most so often.
HALVINGS = 20


class TaskSystem(NamedTuple):
    """The linear system of a task, and a step."""

    e: FloatArray  # stacked errors [m], (equation,)
    J: FloatArray  # the Jacobian transposed, -de/dq, lengths over the reach, (freedom, equation)
    A: FloatArray  # J J' + damping and then its factors, (equation, equation)
    z: FloatArray  # A^-1 e, (equation,)
    step: FloatArray  # of the freedoms, lengths over the reach, (freedom,)
    # 1 where the upper limit stops a freedom, -1 where the lower does, else 0, (freedom,)
    active: FloatArray
    # towards targets out of reach, see `far_step`: the Hessian of |e|²/2, the damped Hessian and
    # then its factors, (freedom, freedom); J e, and both sides of a linear system, (freedom,)
    H: FloatArray
    damped: FloatArray
    gradient: FloatArray
    rhs: FloatArray
    solution: FloatArray


def new_system(equations, freedoms):
    """Return a system, not filled, in two blocks of memory."""
    m, n = equations, freedoms
    block, square = np.empty(n * m + m * m + 2 * m + 2 * n), np.empty((2 * n + 3, n))
    J, A, rows = block[: n * m], block[n * m : n * m + m * m], block[n * m + m * m :]
    e, z, step, active = rows[:m], rows[m : 2 * m], rows[2 * m : 2 * m + n], rows[2 * m + n :]
    return TaskSystem(
        e, J.reshape(n, m), A.reshape(m, m), z, step, active,
        square[:n], square[n : 2 * n], square[2 * n], square[2 * n + 1], square[2 * n + 2],
    )  # fmt: skip


def linearise_task(mechanism, target, data, system):
    """Fill errors and Jacobian of a configuration."""
    fill_errors(mechanism, target, data, system.e)
    fill_jacobian(mechanism, target, data, system.J)


def fill_errors(mechanism, target, data, e):
    """Fill the errors, (equation,)."""
    effectors, lever = mechanism.effectors, LEVER * mechanism.reach
    for i in range(len(effectors)):
        row, root = effectors["row"][i], math.sqrt(target["weight"][i])
        store(e, row, scale(root, position_error(mechanism, target, data, i)))
        if effectors["oriented"][i]:
            error = logarithm(rotation_error(mechanism, target, data, i))
            store(e, row + 3, scale(root * lever, error))


def fill_jacobian(mechanism, target, data, J):
    """Fill the Jacobian transposed, (freedom, equation)."""
    joints, effectors, lever = mechanism.joints, mechanism.effectors, LEVER * mechanism.reach
    for k in range(len(J)):
        clear(J[k])
    for j in range(len(joints)):
        x = load_vector(data.positions, j)
        for i in range(FREEDOMS[joints["kind"][j]]):
            angular, linear = motion(joints, j, i, data.rotations, mechanism.reach)
            row = J[joints["freedom"][j] + i]
            for e in range(len(effectors)):
                if mechanism.moves[j, e]:
                    at, root = effectors["row"][e], math.sqrt(target["weight"][e])
                    arm = subtract(effector_position(mechanism, data, e), x)
                    accumulate(row, at, scale(root, velocity_at(angular, linear, arm)))
                    if effectors["oriented"][e]:
                        accumulate(row, at + 3, scale(root * lever, angular))


def damped_step(mechanism, data, system, damping):
    """Fill the minimising step of |e - J q|^2 + damping |q|^2 within the limits.

    A freedom becomes active if the step would take it beyond its limit. The freedom goes to the
    limit, its effect is taken from e, and the others are solved for again. An active freedom is
    released if it would rather step back.
    """
    clear(system.active)
    clear(system.step)
    any_active = False
    for _ in range(2 * len(system.step) + 1):
        solve_system(system, damping)
        for k in range(len(system.step)):
            if system.active[k] == 0.0:
                system.step[k] = inner(system.J[k], system.z)
        if activate_limits(mechanism, data, system):
            any_active = True
        elif not (any_active and release(system)):
            return


def activate_limits(mechanism, data, system):
    """Make the freedoms active that the step takes beyond a limit; return whether any are."""
    joints, any_active = mechanism.joints, False
    for j in range(len(joints)):
        k = joints["freedom"][j]
        if not has_bounds(joints, j) or system.active[k] != 0.0:
            continue
        q, unit = data.q[joints["coordinate"][j]], freedom_unit(mechanism, j)
        unbounded = q + unit * system.step[k]
        bounded = min(max(unbounded, joints["lower"][j]), joints["upper"][j])
        if bounded != unbounded and not covers_circle(joints, j):
            system.active[k] = 1.0 if unbounded > bounded else -1.0
            system.step[k] = (bounded - q) / unit
            for i in range(len(system.e)):
                system.e[i] -= system.step[k] * system.J[k, i]
            any_active = True
    return any_active


def release(system):
    """Release the active freedom that most steps back from its limit; return whether any is.

    With z = (e - J q) / damping, a free freedom k steps J_k z.
    """
    worst, largest = -1, 0.0
    for k in range(len(system.step)):
        if system.active[k] != 0.0:
            back = system.active[k] * (system.step[k] - inner(system.J[k], system.z))
            if back > largest:
                worst, largest = k, back
    if worst < 0:
        return False
    system.active[worst] = 0.0
    for i in range(len(system.e)):
        system.e[i] += system.step[worst] * system.J[worst, i]
    return True


def transposed_step(mechanism, data, system):
    """Fill the step a J' e, a = <e, J J' e> / |J J' e|^2, without freedoms that limits stop."""
    clear(system.active)
    for _ in range(len(system.step) + 1):
        clear(system.z)
        for k in range(len(system.step)):
            if system.active[k] == 0.0:
                system.step[k] = inner(system.J[k], system.e)
                for i in range(len(system.z)):
                    system.z[i] += system.step[k] * system.J[k, i]
        square, moved = inner(system.e, system.z), inner(system.z, system.z)
        for k in range(len(system.step)):
            if system.active[k] == 0.0 and moved > 0.0:
                system.step[k] *= square / moved
            else:
                system.step[k] = 0.0
        if not stop_at_limits(mechanism, data, system):
            return


def stop_at_limits(mechanism, data, system):
    """Make the freedoms active that the step takes away from a limit; return whether any are."""
    joints, any_active = mechanism.joints, False
    for j in range(len(joints)):
        k = joints["freedom"][j]
        if has_bounds(joints, j) and system.active[k] == 0.0:
            q, step = data.q[joints["coordinate"][j]], system.step[k]
            beyond = q >= joints["upper"][j] if step > 0.0 else q <= joints["lower"][j]
            if beyond and step != 0.0:
                system.active[k] = 1.0
                any_active = True
    return any_active


def freedom_unit(mechanism, j):
    """Return the unit of a hinge's or slide's freedom: 1 rad, or the reach [m]."""
    return mechanism.reach if mechanism.joints["kind"][j] == SLIDE else 1.0


def has_bounds(joints, j):
    """Return whether a joint is a hinge or slide, and no follower."""
    return joints["kind"][j] in (HINGE, SLIDE) and joints["leader"][j] == j


def solve_system(system, damping):
    """Fill z of (J J' + damping 1) z = e over the freedoms not active."""
    m = len(system.e)
    if m == 6:  # the compiler lays out what is of known size
        fill_matrix(system, damping, 6)
        solve(system.A, system.e, system.z, 6)
    elif m == 3:
        fill_matrix(system, damping, 3)
        solve(system.A, system.e, system.z, 3)
    else:
        fill_matrix(system, damping, m)
        solve(system.A, system.e, system.z, m)


def fill_matrix(system, damping, m):
    """Fill the lower triangle of A = J J' + damping 1, (m, m), over the freedoms not active.

    The damping is held above rounding: A has factors even where J J' is singular.
    """
    A, J = system.A, system.J
    for i in range(m):
        for j in range(i + 1):
            A[i, j] = 0.0
    for k in range(len(J)):
        if system.active[k] == 0.0:
            for i in range(m):
                for j in range(i + 1):
                    A[i, j] += J[k, i] * J[k, j]
    for i in range(m):
        damping += ROUNDING_DAMPING * A[i, i]
    for i in range(m):
        A[i, i] += damping


def take_step(mechanism, data, system):
    """Change the coordinates by the step, within the limits; the step is left in rad and m."""
    joints, q, step = mechanism.joints, data.q, system.step
    for j in range(len(joints)):
        kind, k = joints["kind"][j], joints["freedom"][j]
        if joints["leader"][j] == j:
            for i in range(3 if kind == FREE else 1 if kind == SLIDE else 0):
                step[k + i] *= mechanism.reach
            move_joint(joints, j, step, q)
            if kind in (BALL, FREE):
                store_ball(joints, q, j, normalised(load_ball(joints, q, j)))
            elif covers_circle(joints, j):
                wrap(joints, j, q)
            clamp_joint(joints, j, q)
    update_forward_kinematics(mechanism, data)


def covers_circle(joints, j):
    """Return whether a hinge's limits leave all angles, so that no limit need stop the hinge."""
    span = joints["upper"][j] - joints["lower"][j]
    return joints["kind"][j] == HINGE and span >= FULL_CIRCLE and not joints["followed"][j]


def wrap(joints, j, q):
    """Bring a hinge's coordinate within its limits by multiples of 2 pi, as few as do."""
    at = joints["coordinate"][j]
    lower, upper = joints["lower"][j], joints["upper"][j]
    if q[at] > upper:
        q[at] -= FULL_CIRCLE * math.ceil((q[at] - upper) / FULL_CIRCLE)
    elif q[at] < lower:
        q[at] += FULL_CIRCLE * math.ceil((lower - q[at]) / FULL_CIRCLE)


def descend(mechanism, target, data, work, j):
    """Move a joint with followers down the gradient, half as far until the cost does not rise."""
    q, at, k = data.q, mechanism.joints["coordinate"][j], mechanism.joints["freedom"][j]
    update_forward_kinematics(mechanism, data)
    linearise_task(mechanism, target, data, work.system)
    row = work.system.J[k]
    slope, square = inner(row, work.system.e), inner(row, row)
    before, start = cost(mechanism, target, data), q[at]
    step = freedom_unit(mechanism, j) * slope / square if square > 0.0 else 0.0
    for _ in range(HALVINGS):
        move_by(mechanism.joints, q, j, step)
        update_forward_kinematics(mechanism, data)
        if cost(mechanism, target, data) <= before:
            return
        q[at] = start
        step *= 0.5
    update_forward_kinematics(mechanism, data)
