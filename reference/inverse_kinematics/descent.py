"""Tasks: exact tasks are met by Levenberg-Marquardt, the others approached as far as these allow.

The exact tasks are met as `solve_ik` reaches its targets: by the same bounded steps and loops, in
phases and restarts (`restarts.py`), with a smaller share of the squared error as damping. Then an
augmented Lagrangian (Rockafellar 1973) holds the exact tasks while the sum of squares of the others
falls: multipliers u shift the exact residuals r. Where the minimum of the sum of squares of r + u
and of the other residuals does not meet the exact tasks, u grows by r. Here the squares have minima
other than zero, so a step counts only if they fall, and the damping follows the gain (Nielsen
1999).

The loops are compiled for the tasks of Plumbob. With tasks of a user the interpreter runs the same
loops, on compiled steps.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..arguments import FloatArray
from ..articulation import Articulation, clamp_joint, normalise_start
from ..backend.compiled import PythonKernel
from .bounded_step import TaskSystem, damped_step, new_system, take_step
from .chain import POSITION_ROUNDING
from .far_step import fill_normal_equations, step_within_limits
from .levenberg_marquardt import DAMPING_OF_TASKS
from .linear_algebra import clear, inner
from .mechanism import EFFECTOR, ConfigurationData, Mechanism, new_data, update_forward_kinematics
from .restarts import (
    BEST,
    INFINITY,
    Criteria,
    Operations,
    copy_row,
    new_search,
    solve_with_restarts,
)
from .result import outcome_of
from .solve_mechanism import shift_mechanism
from .task_errors import Residuals, TaskArrays, evaluate_tasks

# The first damping of a descent and the largest, over the largest diagonal entry of J J' at first.
FIRST_DAMPING, LARGEST_DAMPING = 1e-3, 1e12
# A descent settles where a step promises to lower the cost by less than the first share, or the
# second between two updates of the multipliers. The second share halves the iterations, and costs
# are half a per cent higher at most.
SETTLED, SETTLED_BETWEEN = 1e-8, 1e-3
# At a minimum a step at the first damping promises to lower the cost by no more than the first
# share. Where a descent with exact tasks has settled, the second share counts: ten times the
# remainder of nine in ten descents. In this step errors of exact tasks count HELD times as much.
MINIMUM, MINIMUM_BETWEEN, HELD = 1e-6, 1e-2, 1e4
# A step counts if the cost falls by this share of what was promised.
ACCEPTED = 1e-3
# If an update of the multipliers leaves more than PROGRESS of the error, exact tasks count PENALTY
# times as much, at most PENALTIES times.
PROGRESS, PENALTY, PENALTIES = 0.1, 10.0, 6
# Factors of exact residuals while the others are approached. Without a factor the others may lead
# away for good, with a large one to dearer minima. The second is tried if the first lowers no cost.
STRENGTHS = 1.0, 30.0


class TaskState(NamedTuple):
    """A model with tasks, and the arrays of the loops."""

    mechanism: Mechanism  # all joints, without effectors; lengths in metres
    tasks: TaskArrays
    data: ConfigurationData  # the configuration that a step has led to
    row: FloatArray  # its coordinates
    restarts: FloatArray  # random coordinates for further attempts, (restart, coordinate)
    shares: FloatArray  # of the ranges of joints at further starts, (phase - 1, joint)
    system: TaskSystem  # of a step
    current: Residuals
    trial: Residuals  # after a step
    best: Residuals  # of all
    scale: FloatArray  # factors of the residuals, (row,)
    multipliers: FloatArray  # u, (row,)


class DescentOperations(NamedTuple):
    """The operations of a descent, a kernel each."""

    evaluate: PythonKernel  # (state, evaluation): evaluate all tasks at the data
    # (state, damping): move the data by a step; return the square of the residuals and its decrease
    step: PythonKernel
    keep: PythonKernel  # (source, target): copy an evaluation


def new_state(
    model: Articulation, tasks: TaskArrays, restarts: FloatArray, shares: FloatArray
) -> TaskState:
    """Return the arrays of the loops, to be filled."""
    n, freedoms, rows = model.joint_count, model.freedom_count, len(tasks.factors)
    mechanism = Mechanism(
        model.joints, np.arange(model.coordinate_count), np.zeros(0, EFFECTOR),
        np.zeros((n, 0), dtype=bool), np.zeros((n, n), dtype=bool), 1.0, freedoms, 0,
    )  # fmt: skip
    shapes: Any = model.coordinate_count, rows, (freedoms, rows), len(tasks.records)
    current, trial, best = (Residuals(*map(np.zeros, shapes)) for _ in range(3))
    data, system = new_data(mechanism), new_system(rows, freedoms)
    scale, multipliers = np.zeros((2, rows))
    return TaskState(
        mechanism, tasks, data, data.q, restarts, shares, system, current, trial, best, scale,
        multipliers,
    )  # fmt: skip


def solve(attempting, descending, state, tolerance, limit):
    """Meet the exact tasks from the data, then approach the others; the solution is `state.best`.

    If not all exact tasks are met, a descent brings the best attempt to a minimum. Else descents
    with all tasks begin at the best attempt; where one leads away from the exact tasks, these are
    met again from there.

    Returns:
        The iterations, the value of the outcome, the largest error of a task, infinite where
        numbers overflow, and the cost.
    """
    current, best, exact = state.current, state.best, state.tasks.exact
    count, is_settled = 0, False
    if exact.any():
        criteria = criteria_of(state, tolerance, limit)
        attempts = new_search(len(state.restarts) + 1 + criteria.phases, len(state.row))
        history = np.empty(1)
        count, is_settled = solve_with_restarts(
            attempting, state, attempts, state.tasks.records, criteria, history
        )
        copy_row(attempts.rows[BEST], state.row)
        attempting.place(state)
    descending.evaluate(state, current)
    descending.keep(current, best)
    is_met, iterations = largest_error(state, best, True) <= tolerance, 0
    for stage in range(0 if is_met and exact.all() else 2 * len(STRENGTHS)):
        repairs = stage % 2 == 1
        if not repairs or largest_error(state, current, True) > tolerance:
            alone = repairs or not is_met
            strength = 1.0 if alone else STRENGTHS[stage // 2]
            more, is_settled = descend(
                descending, state, alone, strength, tolerance, limit - iterations
            )
            iterations += more
        if not is_met or (repairs and is_better(state, tolerance)):
            descending.keep(current, best)
            break
        if repairs:
            descending.keep(best, current)
    count += iterations
    error, other_error = largest_error(state, best, True), largest_error(state, best, False)
    cost = square_of(state, best, False)
    share = MINIMUM_BETWEEN if is_settled and exact.any() else MINIMUM
    converged = error <= tolerance and (
        other_error <= tolerance or remaining(descending, state) <= share * cost
    )
    return count, outcome_of(converged, False, is_settled).value, max(error, other_error), cost


def criteria_of(state, tolerance, limit):
    """Return the end criteria of attempts to meet the exact tasks."""
    restarts, phases = len(state.restarts), 1 + len(state.shares)
    return Criteria(
        tolerance, INFINITY, POSITION_ROUNDING, limit, restarts, phases, 0, restarts + phases > 1,
        False,
    )  # fmt: skip


def meet(state, _target):
    """Make an iteration of Levenberg-Marquardt for the exact tasks, evaluated before."""
    set_scale(state, 1.0, 0.0)
    step(state, DAMPING_OF_TASKS * square_of(state, state.current, True))


def attempt_error(state, _target):
    """Evaluate the tasks; return the largest error of an exact task as in `Operations.error`."""
    evaluate_tasks(state, state.current)
    return exact_errors(state)


def exact_errors(state):
    """Return the largest error of an exact task, no angle, the sum of errors, the largest again."""
    total, errors = 0.0, state.current.errors
    for t in range(len(errors)):
        if state.tasks.records["exact"][t]:
            total += errors[t]
    largest = largest_error(state, state.current, True)
    return largest, 0.0, total, largest


def attempt_merit(state, _target):
    """Return the root of the weighted sum of squares of the exact residuals."""
    return math.sqrt(square_of(state, state.current, True))


def leave(_state, _target, _criteria, _first):
    """Return that no start of tasks is stuck."""
    return False


def place_tasks(state):
    """Bring the joints to the coordinates in the row."""
    update_forward_kinematics(state.mechanism, state.data)


def draw_tasks(state, _target, _criteria, n):
    """Write the coordinates of random restart n to the row."""
    copy_row(state.restarts[n - 1], state.row)


def is_better(state, tolerance):
    """Return whether the current configuration meets the exact tasks at less cost than the best."""
    costs = square_of(state, state.current, False), square_of(state, state.best, False)
    return largest_error(state, state.current, True) <= tolerance and costs[0] < costs[1]


def descend(operations, state, alone, strength, tolerance, limit):
    """Minimise the residuals of the exact tasks alone, or times a strength with all others.

    With the others, multipliers hold the exact tasks. The descent begins and ends at the current
    configuration.

    Returns:
        The iterations, and whether the descent has settled.
    """
    current, trial, any_exact = state.current, state.trial, state.tasks.exact.any()
    set_scale(state, strength, 0.0 if alone else 1.0)
    share = SETTLED if alone or not any_exact else SETTLED_BETWEEN
    unit = largest_diagonal(state, current, True)
    unit = max(unit, largest_diagonal(state, current, False)) or 1.0
    damping, growth, length, penalties = FIRST_DAMPING * unit, 2.0, math.inf, 0
    for count in range(limit):
        is_met = largest_error(state, current, True) <= tolerance
        if alone and is_met:
            return count, True
        square, promised = operations.step(state, damping)
        operations.evaluate(state, trial)
        ratio = gain_ratio(state, square, promised)
        damping, growth = next_damping(damping, growth, ratio)
        if ratio > ACCEPTED:
            operations.keep(trial, current)
        if promised > share * square and damping < LARGEST_DAMPING * unit:
            continue
        is_met = largest_error(state, current, True) <= tolerance
        if alone or is_met or penalties == PENALTIES:
            return count + 1, True
        before, length = length, math.sqrt(square_of(state, current, True))
        penalties += update_multipliers(state, length > PROGRESS * before)
    return limit, False


def set_scale(state, strength, other):
    """Set the factors of exact residuals and of the others, and no multipliers."""
    clear(state.multipliers)
    for i in range(len(state.scale)):
        state.scale[i] = strength if state.tasks.exact[i] else other


def scaled(state, evaluation, i):
    """Return a residual with its multiplier, times its factor."""
    return state.scale[i] * (evaluation.r[i] + state.multipliers[i])


def step(state, damping):
    """Move the data from the current configuration by a damped step within the limits.

    Returns:
        The square of the scaled residuals, and its decrease as promised by the derivative.
    """
    system, current = state.system, state.current
    copy_row(current.q, state.data.q)
    for i in range(len(system.e)):
        system.e[i] = -scaled(state, current, i)
        for k in range(len(system.J)):
            system.J[k, i] = state.scale[i] * current.J[k, i]
    square, left = inner(system.e, system.e), 0.0
    if len(system.e) > len(system.step):  # the smaller system, of the same step
        fill_normal_equations(system)
        step_within_limits(state.mechanism, state.data, system, damping)
    else:
        damped_step(state.mechanism, state.data, system, damping)
    for i in range(len(system.e)):
        e = -scaled(state, current, i)
        for k in range(len(system.J)):
            e -= system.J[k, i] * system.step[k]
        left += e * e
    take_step(state.mechanism, state.data, system)
    return square, square - left


def gain_ratio(state, square, promised):
    """Return the decrease of the square by the step, over the promised decrease."""
    gain = square
    for i in range(len(state.scale)):
        gain -= scaled(state, state.trial, i) ** 2
    return gain / promised if promised > 0.0 else 0.0


def next_damping(damping, growth, ratio):
    """Return the next damping, and its growth if the next step fails (Nielsen 1999)."""
    if ratio > ACCEPTED:
        return damping * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), 2.0
    return damping * growth, 2.0 * growth


def update_multipliers(state, penalised):
    """Add exact residuals to their multipliers; return 1 if they then count PENALTY times as much.

    The forces that hold the exact tasks, scale² times the multipliers, then stay.
    """
    for i in range(len(state.scale)):
        if state.tasks.exact[i]:
            state.multipliers[i] += state.current.r[i]
            if penalised:
                state.multipliers[i] /= PENALTY
                state.scale[i] *= PENALTY**0.5
    return 1 if penalised else 0


def remaining(operations, state):
    """Return how much of the cost motions within the limits and the exact tasks may take away.

    The multipliers cancel the exact residuals: the step keeps these as they are.
    """
    best, exact = state.best, state.tasks.exact
    unit = largest_diagonal(state, best, False) or 1.0
    unit_exact = largest_diagonal(state, best, True) or 1.0
    set_scale(state, HELD * (unit / unit_exact) ** 0.5, 1.0)
    for i in range(len(exact)):
        state.multipliers[i] = -best.r[i] if exact[i] else 0.0
    operations.keep(best, state.current)
    _, promised = operations.step(state, FIRST_DAMPING * unit)
    return promised


def largest_error(state, evaluation, exact):
    """Return the largest error of an exact task, or of the others."""
    largest = 0.0
    for t in range(len(evaluation.errors)):
        if state.tasks.records["exact"][t] == exact:
            largest = max(largest, evaluation.errors[t])
    return largest


def square_of(state, evaluation, exact):
    """Return the sum of squares of exact residuals, or of the others."""
    total = 0.0
    for i in range(len(evaluation.r)):
        if state.tasks.exact[i] == exact:
            total += evaluation.r[i] ** 2
    return total


def largest_diagonal(state, evaluation, exact):
    """Return the largest diagonal entry of J J' of exact residuals, or of the others."""
    largest = 0.0
    for i in range(len(evaluation.r)):
        square = 0.0
        for k in range(len(evaluation.J)):
            square += evaluation.J[k, i] ** 2
        if state.tasks.exact[i] == exact:
            largest = max(largest, square)
    return largest


def keep(source, target):
    """Copy an evaluation."""
    copy_row(source.q, target.q)
    copy_row(source.r, target.r)
    copy_row(source.errors, target.errors)
    for k in range(len(source.J)):
        copy_row(source.J[k], target.J[k])


def place(state, q):
    """Bring the data to coordinates, within the limits; return whether these were valid."""
    joints = state.mechanism.joints
    copy_row(q, state.row)
    valid = normalise_start(joints, state.row)
    for j in range(len(joints)):
        clamp_joint(joints, j, state.row)
    place_tasks(state)
    return valid


ATTEMPTING = Operations(
    meet, attempt_error, attempt_merit, leave, place_tasks, draw_tasks, shift_mechanism
)
DESCENDING = DescentOperations(evaluate_tasks, step, keep)


def solve_from(arrays, q, tolerance, limit):
    """Solve from coordinates with the tasks of Plumbob; -1 iterations if these are not valid.

    The arrays of the state are plain tuples, since named tuples take longer from Python.
    """
    mechanism, tasks, data, row, restarts, shares, system, current, trial, best, scale, u = arrays
    state = TaskState(
        Mechanism(*mechanism), TaskArrays(*tasks), ConfigurationData(*data), row, restarts, shares,
        TaskSystem(*system), Residuals(*current), Residuals(*trial), Residuals(*best), scale, u,
    )  # fmt: skip
    if not place(state, q):
        return -1, 0, 0.0, 0.0
    return solve(ATTEMPTING, DESCENDING, state, tolerance, limit)
