"""The loops of every solver: iterations of an attempt, attempts from further starts, and phases.

The loops work on the state of a chain of unlimited balls (`solve_chain.py`) or of a mechanism
(`solve_mechanism.py`), through its `Operations`. Both states have a `row` of numbers that an
attempt continues from.
"""

import math
from typing import NamedTuple

from ..arguments import FloatArray
from ..backend.compiled import PythonKernel
from ..outcome import Outcome

# If further attempts may follow, give up an attempt when PATIENCE iterations have not brought its
# error down to the share PROGRESS. If no attempt reaches the target, attempts go on, MORE_PATIENT
# times as patient each time.
PATIENCE, PROGRESS, MORE_PATIENT = 3, 0.5, 4
# The patience of the phases of a single start: of the first phase, and of each further phase. The
# first costs 1 or 2 in 1,000 of the targets that the phase would ever reach.
FIRST_PATIENCE, FURTHER_PATIENCE = 50.0, 10.0
# How an attempt ended: within the tolerances, or of the nearest point that geometry allows; without
# further progress; with its iterations used; given up early.
REACHED, STALLED, LIMITED, GIVEN_UP = range(4)
# Columns of progress: iterations made, end of the attempt, its merit [m] and its patience. Then an
# error [m] whose share PROGRESS is the next progress, at first infinite; the iterations since the
# last progress; and the largest number of iterations.
COUNT, STATE, COST, WAIT, MILESTONE, SINCE, LIMIT = range(7)
# Rows behind the rows of attempts, of progress and of saved states: the best end of a phase, the
# start, and the best attempt. In the last row iterations are the sum over all attempts.
BEST_PHASE, START, BEST = -3, -2, -1
SPARE_ROWS = 3  # their number
INFINITY = math.inf
# Columns of Result.figures: the largest distance [m] and angle [rad] from effector to target, the
# number of iterations, and the value of the outcome. Then the merit [m], and the distance above the
# least that geometry allows [m].
RESIDUAL, RESIDUAL_ROTATION, ITERATIONS, OUTCOME, MERIT, EXCESS = FIGURES = range(6)


class Operations(NamedTuple):
    """The operations of the loops on a state, a kernel each."""

    update: PythonKernel  # (state, target): make one iteration of a solver
    # (state, target): return the largest distance [m] and angle [rad] from effector to target, the
    # sum of all distances and levered angles [m] to show progress, and the distance to make small
    error: PythonKernel
    merit: PythonKernel  # (state, target): return the cost by which attempts are compared [m]
    # (state, target, criteria, first): move a stuck first attempt, whose row of progress is
    # `first`; return whether it was stuck
    perturb: PythonKernel
    place: PythonKernel  # (state): bring the state to what has been copied to its row
    # (state, target, criteria, n): take from the configuration of random restart n = 1, 2 ...
    draw: PythonKernel
    # (state, n): begin phase n = 0, 1 ... of the solver; return whether the phase exists
    begin: PythonKernel


class Limits(NamedTuple):
    """The tolerances and numbers of iterations of a solve."""

    tolerance: float  # distance that counts as reached [m]
    tolerance_rotation: float  # angle that does [rad]
    max_iterations: int  # of each attempt
    far_iterations: int  # the same where geometry proves a target out of reach
    restarts: int  # further attempts
    chained: bool  # whether each target but the first starts from the solution before it
    phases: int  # that a start goes through while it stalls, at most; 1 is the plain method


class Criteria(NamedTuple):
    """The end criteria of attempts at a target."""

    # distance from the target that counts as reached [m], less the rounding of the final pose
    distance: float
    angle: float  # the same for rotations [rad]
    margin: float  # an error that changes by no more has stalled [m]
    max_iterations: int  # of each attempt
    redraws_limbs: bool  # whether a restart leaves the limbs whose effectors reach their targets


class Result(NamedTuple):
    """The arrays that kernels fill, a row a target."""

    local: FloatArray  # local rotations, (target, joint, 4)
    positions: FloatArray  # global positions [m], (target, joint, 3)
    figures: FloatArray  # (target, 6), see above
    # distances before and after each iteration [m], (target, iteration); (1, 1) if not recorded.
    # Entries after the last iteration are not filled
    history: FloatArray
    # of an articulation, (target, coordinate); of a skeleton its local rotations
    coordinates: FloatArray


def limits_of(numbers):
    """Return Limits from an array of their numbers, which comes in faster from Python."""
    return Limits(
        numbers[0], numbers[1], int(numbers[2]), int(numbers[3]), int(numbers[4]),
        numbers[5] > 0.0, int(numbers[6]),
    )  # fmt: skip


def solve_with_restarts(operations, state, saved, progress, target, limits, criteria, history):
    """Attempt from the start, then from random configurations, until the target is reached.

    While others may follow, an attempt at a target in reach is given up early. If no attempt
    reaches the target, all are finished, unless each has redrawn the failing limbs of its
    predecessor. Finally a solver of several phases goes through all phases as from a single start.
    With any other solver the first attempt makes as many iterations as all attempts may. Its ends
    after each attempt's number of iterations count as attempts too. So the result is no worse than
    from a single start, or with fewer restarts.

    The rows of `saved`, states, and of `progress`, see the columns above, are of attempts and then
    the spare rows. The best attempt is saved in the last row.

    Returns:
        The iterations of all attempts, and whether the best of them stalled.
    """
    total, in_reach = progress[BEST], criteria.distance <= limits.tolerance
    phased = limits.phases > 1 and in_reach and operations.begin(state, 1)
    operations.begin(state, 0)
    begin_rows(progress, criteria, in_reach, phased)
    distance, _, _, _ = operations.error(state, target)
    store_if_inside(history, 0, distance)
    copy_row(state.row, saved[START])
    perturb(operations, state, saved, progress, target, criteria)
    k, turn, drawing = 0, 0, len(progress) > SPARE_ROWS + 1
    while True:
        go_on(operations, state, saved, progress, k, target, criteria, history)
        if total[STATE] == REACHED:
            break
        if perturb(operations, state, saved, progress, target, criteria):
            continue
        if drawing:
            k = begin_attempt(operations, state, saved, progress, target, criteria, k)
            if k < 0:
                begin_start(operations, state, saved, progress, phased)
                k, drawing = 0, False
            if drawing or phased:
                continue
        turn += 1
        if phased and not begin_phase(operations, state, saved, progress, limits, turn):
            break
        if not phased and not extend_first(progress, criteria, limits, turn):
            break
    return int(total[COUNT]), total[STATE] <= STALLED


def begin_rows(progress, criteria, in_reach, phased):
    """Fill the rows of attempts to be made; the start has the patience of its phases.

    Towards a target out of reach no attempt is given up.
    """
    others_follow = len(progress) > SPARE_ROWS + 1
    for i in range(len(progress)):
        reset(progress[i], PATIENCE if others_follow and in_reach else INFINITY)
        progress[i, LIMIT] = criteria.max_iterations
    progress[START, WAIT] = FIRST_PATIENCE if phased else INFINITY
    if not others_follow:
        progress[0, WAIT] = progress[START, WAIT]


def perturb(operations, state, saved, progress, target, criteria):
    """Move the first attempt and the start, once, if they are stuck; return whether they were."""
    start, first = progress[START], progress[0]
    if start[STATE] != LIMITED or progress[BEST, COUNT] != first[COUNT]:
        return False
    if not operations.perturb(state, target, criteria, first):
        return False
    start[STATE], start[COUNT] = STALLED, first[COUNT]
    copy_row(state.row, saved[START])
    return True


def begin_attempt(operations, state, saved, progress, target, criteria, k):
    """Begin the attempt after attempt k, or an attempt given up; return its index, -1 if none."""
    if k + 1 < len(progress) - SPARE_ROWS and progress[k + 1, COST] == INFINITY:
        operations.draw(state, target, criteria, k + 1)
        return k + 1
    k = -1 if criteria.redraws_limbs else most_promising(progress)
    if k >= 0:
        attempt = progress[k]
        attempt[WAIT], attempt[MILESTONE], attempt[SINCE] = (
            MORE_PATIENT * attempt[WAIT],
            INFINITY,
            0,
        )
        copy_row(saved[k], state.row)
        operations.place(state)
    return k


def begin_start(operations, state, saved, progress, phased):
    """Begin at the start again, for all phases; of a single phase go on with the first attempt."""
    copy_row(saved[START] if phased else saved[0], state.row)
    if phased:
        copy_row(progress[START], progress[0])
    operations.place(state)


def extend_first(progress, criteria, limits, n):
    """Give the first attempt the iterations of the n-th; return whether the first needs more."""
    progress[0, LIMIT] = (n + 1) * criteria.max_iterations
    progress[0, WAIT] = INFINITY
    return n <= limits.restarts and progress[0, STATE] == LIMITED


def begin_phase(operations, state, saved, progress, limits, n):
    """Begin phase n, behind the last go on with the best; return whether there is anything to do.

    The phase before has just ended, and all phases have the iterations of one attempt together.
    """
    first, best = progress[0], progress[BEST_PHASE]
    left = first[LIMIT] - first[COUNT]
    if first[WAIT] == INFINITY or left <= 0.0:
        return False
    if first[COST] < best[COST]:
        copy_row(first, best)
        copy_row(saved[0], saved[BEST_PHASE])
    copy_row(saved[START], state.row)
    patience = FURTHER_PATIENCE
    if n >= limits.phases or not operations.begin(state, n):
        if best[STATE] == STALLED:
            return False
        copy_row(saved[BEST_PHASE], state.row)
        patience = INFINITY
    reset(first, patience)
    first[LIMIT] = left
    operations.place(state)
    return True


def reset(attempt, patience):
    """Reset a row of progress to an attempt not yet made."""
    attempt[COUNT], attempt[STATE], attempt[COST], attempt[WAIT] = 0.0, LIMITED, INFINITY, patience
    attempt[MILESTONE], attempt[SINCE] = INFINITY, 0.0


def go_on(operations, state, saved, progress, k, target, criteria, history):
    """Continue attempt k; save its end, and again if it is the best."""
    attempt, total = progress[k], progress[BEST]
    total[COUNT] += solve_once(
        operations, state, target, criteria, attempt, history, int(total[COUNT])
    )
    attempt[COST] = operations.merit(state, target)
    copy_row(state.row, saved[k])
    is_settled = attempt[COST] == total[COST] and total[STATE] == GIVEN_UP
    if attempt[STATE] == REACHED or attempt[COST] < total[COST] or is_settled:
        total[STATE], total[COST] = attempt[STATE], attempt[COST]
        copy_row(state.row, saved[BEST])


def solve_once(operations, state, target, criteria, attempt, history, earlier):
    """Update until the target is reached, the error stalls, or the limit of iterations is met.

    `attempt` is the row of progress, where its end is noted; all attempts have made `earlier`
    iterations so far.

    Returns:
        The iterations made.
    """
    _, angle, total, bound = operations.error(state, target)
    milestone, since = min(attempt[MILESTONE], total), attempt[SINCE]
    first, ending = int(attempt[COUNT]), LIMITED
    count = first
    while ending == LIMITED:
        if bound <= criteria.distance and angle <= criteria.angle:
            ending = REACHED
        if ending == REACHED or count >= attempt[LIMIT]:
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
    attempt[MILESTONE], attempt[SINCE] = milestone, since
    return count - first


def most_promising(progress):
    """Return the attempt given up to go on with: the least patient, then the best; -1 if none."""
    best, row = -1, progress[0]
    for k in range(len(progress) - SPARE_ROWS):
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
    """Write entry i of a row, if the entry exists."""
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
