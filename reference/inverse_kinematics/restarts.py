"""The two loops of every solver: iterations of an attempt, and attempts from further starts.

They work on the state of a chain of unlimited balls (`solve_chain.py`) or of a mechanism
(`solve_mechanism.py`), through its `Operations`. Both states have a `row` of numbers that an
attempt continues from.
"""

import math
from typing import NamedTuple

from ..arguments import FloatArray
from ..backend.compiled import PythonKernel
from ..outcome import Outcome

# An attempt that others may follow is given up once PATIENCE iterations have not brought the error
# to this share of what it was. If no other reaches the target it goes on, MORE_PATIENT times as
# patient each time.
PATIENCE, PROGRESS, MORE_PATIENT = 3, 0.5, 4
# How an attempt ended: within the tolerances, or of the nearest point that geometry allows; with no
# more progress; with its iterations used; given up early.
REACHED, STALLED, LIMITED, GIVEN_UP = range(4)
# Columns of progress: iterations made, how the attempt ended, its merit [m], and its patience.
COUNT, STATE, COST, WAIT = range(4)
INFINITY = math.inf
# Columns of Result.figures: the largest distance from effector to target [m], the largest angle
# between them [rad], the number of iterations, the value of the outcome, the merit [m], and the
# distance above the least that geometry allows [m].
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME, MERIT, EXCESS = FIGURES = range(6)


class Operations(NamedTuple):
    """The operations of the loops on a state, a kernel each."""

    update: PythonKernel  # (state, target): make one iteration of a solver
    # (state, target): return the largest distance [m] and angle [rad] from effector to target, the
    # sum of all distances and levered angles [m], which shows progress, and the distance that has
    # to be small
    error: PythonKernel
    merit: PythonKernel  # (state, target): return the cost by which attempts are compared [m]
    # (state, target, criteria, first): move the first attempt, whose row of progress is `first`, if
    # it is stuck, and return whether it was
    perturb: PythonKernel
    place: PythonKernel  # (state): bring the state to what has been copied to its row
    draw: PythonKernel  # (state, target, n): take the configuration of random restart n = 1, 2 ...


class Limits(NamedTuple):
    """The tolerances and numbers of iterations of a solve."""

    tolerance: float  # distance that counts as reached [m]
    tolerance_rotation: float  # angle that does [rad]
    max_iterations: int  # of each attempt
    far_iterations: int  # the same where geometry proves a target out of reach
    restarts: int  # further attempts
    chained: bool  # whether each target but the first starts from the solution before it


class Criteria(NamedTuple):
    """The end criteria of attempts at a target."""

    # at most this far from the target counts as reached [m], some of it left for the rounding of
    # the final pose
    distance: float
    angle: float  # the same for rotations [rad]
    margin: float  # an error that changes by no more has stalled [m]
    max_iterations: int  # of each attempt


class Result(NamedTuple):
    """The arrays that kernels fill, a row a target."""

    local: FloatArray  # local rotations, (target, joint, 4)
    positions: FloatArray  # global positions [m], (target, joint, 3)
    figures: FloatArray  # (target, 6), see above
    # distances before and after each iteration [m], (target, iteration); (1, 1) if they are not to
    # be recorded. Entries after the last iteration are not filled
    history: FloatArray
    # of an articulation, (target, coordinate); of a skeleton its local rotations
    coordinates: FloatArray


def limits_of(numbers):
    """Return Limits from an array of their numbers, which comes in faster from Python."""
    return Limits(
        numbers[0], numbers[1], int(numbers[2]), int(numbers[3]), int(numbers[4]), numbers[5] > 0.0
    )


def solve_with_restarts(operations, state, saved, progress, target, limits, criteria, history):
    """Attempt from the start, then from random configurations, until the target is reached.

    While others may follow, an attempt at a target in reach is given up early. If none reaches it,
    all are finished, and the first makes as many iterations as all of them may: its ends after each
    attempt's number of iterations count as attempts too. So the result is no worse than
    from a single start, or with fewer restarts.

    The rows of `saved`, a row of the state each, and of `progress`, see the columns above, are of
    attempts; their last rows are spare. The best attempt is saved in the last row.

    Returns:
        The iterations of all attempts, and whether the best of them stalled.
    """
    random = len(progress) - 2
    patience = PATIENCE if random > 0 and criteria.distance <= limits.tolerance else INFINITY
    for i in range(random + 1):
        row = progress[i]
        row[COUNT], row[STATE], row[COST], row[WAIT] = 0.0, LIMITED, INFINITY, patience
    distance, _, _, _ = operations.error(state, target)
    store_if_inside(history, 0, distance)
    perturbed = operations.perturb(state, target, criteria, progress[0])
    best, ending, count, drawn, periods = INFINITY, LIMITED, 0, 0, 1
    k, limit = 0, criteria.max_iterations
    while k >= 0:
        count += solve_once(operations, state, target, criteria, progress[k], limit, history, count)
        progress[k, COST] = operations.merit(state, target)
        copy_row(state.row, saved[k])
        if is_better(progress[k], best):
            best, ending = progress[k, COST], int(progress[k, STATE])
            copy_row(state.row, saved[-1])
        if ending == REACHED:
            break
        if k == 0 and not perturbed:
            perturbed = operations.perturb(state, target, criteria, progress[0])
            if perturbed:
                continue
        if drawn < random:
            drawn += 1
            k, limit = drawn, criteria.max_iterations
            operations.draw(state, target, drawn)
            continue
        k = most_promising(progress)
        if k < 0 and periods <= limits.restarts and progress[0, STATE] == LIMITED:
            k, periods = 0, periods + 1
        if k >= 0:
            limit = periods * criteria.max_iterations
            copy_row(saved[k], state.row)
            operations.place(state)
    return count, ending <= STALLED


def solve_once(operations, state, target, criteria, attempt, limit, history, earlier):
    """Update until the target is reached, the error stalls, or `limit` iterations are made.

    `attempt` is the row of progress, where its end is noted; all attempts have made `earlier`
    iterations so far.

    Returns:
        The iterations made.
    """
    _, angle, total, bound = operations.error(state, target)
    milestone, since = total, 0
    first, ending = int(attempt[COUNT]), LIMITED
    count = first
    while ending == LIMITED:
        if bound <= criteria.distance and angle <= criteria.angle:
            ending = REACHED
        if ending == REACHED or count >= limit:
            break
        before = total
        operations.update(state, target)
        count += 1
        distance, angle, total, bound = operations.error(state, target)
        store_if_inside(history, earlier + count - first, distance)
        since += 1
        if total < PROGRESS * milestone:
            milestone, since = total, 0
        if abs(before - total) <= criteria.margin:
            ending = STALLED
        elif since >= attempt[WAIT]:
            ending = GIVEN_UP
    if ending != LIMITED and bound <= criteria.distance and angle <= criteria.angle:
        ending = REACHED
    attempt[COUNT], attempt[STATE] = count, ending
    return count - first


def is_better(attempt, best):
    """Return whether an attempt is finished and better than the best [m].

    An attempt that was given up becomes more patient.
    """
    if attempt[STATE] == GIVEN_UP:
        attempt[WAIT] *= MORE_PATIENT
        return False
    return attempt[STATE] == REACHED or attempt[COST] < best


def most_promising(progress):
    """Return the attempt given up to go on with: the least patient, then the best; -1 if none."""
    best, row = -1, progress[-1]
    for k in range(len(progress) - 1):
        attempt = progress[k]
        if attempt[STATE] == GIVEN_UP:
            sooner = best < 0 or attempt[WAIT] < row[WAIT]
            if sooner or (attempt[WAIT] == row[WAIT] and attempt[COST] < row[COST]):
                best, row = k, attempt
    return best


def copy_row(source, target):
    """Copy a row of numbers into another."""
    for k in range(len(source)):
        target[k] = source[k]


def store_if_inside(row, i, value):
    """Write entry i of a row, if there is one."""
    if i < len(row):
        row[i] = value


def fill_figures(figures, distance, angle, iterations, merit, lower_bound):
    """Fill all figures but the outcome; no pose is nearer to the target than a bound [m]."""
    figures[RESIDUAL], figures[RESIDUAL_ROTATION] = distance, angle
    figures[ITERATIONS], figures[MERIT] = iterations, merit
    figures[EXCESS] = max(0.0, distance - lower_bound)


def outcome_of(reached, unreachable, stalled):
    """Return how a solve ended; `unreachable` is whether geometry proves the target to be so."""
    if reached:
        return Outcome.CONVERGED
    if unreachable:
        return Outcome.UNREACHABLE if stalled else Outcome.UNREACHABLE_UNSETTLED
    return Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT
