"""The loops of every solver: iterations of an attempt, and attempts from several starts.

The loops work on the state of a chain of unlimited balls (`chain.py`), of a mechanism
(`solve_mechanism.py`) or of tasks (`descent.py`), through its `Operations`. Each state has a `row`
of numbers, from which an attempt continues. Damping, limits of joints and steps towards targets out
of reach are those of the updates.

Attempts are the plain attempt from the start, then random *restarts*. A solver with *phases* makes
another round: from the start, and from further starts that are always the same. Without restarts
there are the phases alone.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, RecordArray
from ..backend.compiled import PythonKernel

# If further attempts may follow, an attempt is given up when so many iterations have not brought
# its error down to the share PROGRESS. If none reaches the target, attempts go on, MORE_PATIENT
# times as patient each time. Restarts are many, and phases few. On the bench's tuning robots these
# numbers took the fewest iterations of those that reached most targets.
PATIENCE, PATIENCE_OF_PHASES = 3, 8
PROGRESS, MORE_PATIENT = 0.5, 4
# How an attempt ended: within the tolerances, or of the nearest point that geometry allows; without
# further progress; with its iterations used; given up early. An attempt to come is UNMADE.
REACHED, STALLED, LIMITED, GIVEN_UP, UNMADE = range(5)
INFINITY = math.inf
# An attempt at a target, for kernels.
ATTEMPT = np.dtype(
    [
        ("iterations", np.int64),  # made so far
        ("ending", np.int64),
        ("merit", np.float64),  # of its end [m]
        ("patience", np.float64),  # iterations without progress after which it is given up
        ("milestone", np.float64),  # the error [m] whose share PROGRESS is the next progress
        ("since", np.int64),  # iterations since the last progress
    ],
    align=True,
)
# The start and the best attempt stand behind all attempts. Iterations of the best are those of all.
START, BEST = -2, -1
SPARE = 2  # their number


class Operations(NamedTuple):
    """The operations of the loops on a state, a kernel each."""

    update: PythonKernel  # (state, target): make one iteration of a solver
    # (state, target): return the largest distance [m] and angle [rad] from effector to target, the
    # sum of all distances and levered angles [m] to show progress, and the distance to make small
    error: PythonKernel
    merit: PythonKernel  # (state, target): return the cost by which attempts are compared [m]
    # (state, target, criteria, first): move a stuck first attempt, whose record is `first`; return
    # whether it was stuck
    perturb: PythonKernel
    place: PythonKernel  # (state): bring the state to what has been written to its row
    # (state, target, criteria, n): write the configuration of random restart n = 1, 2 ... to it
    draw: PythonKernel
    shift: PythonKernel  # (state, n): change the row from the start to the start of phase n = 1 ...


class Limits(NamedTuple):
    """The tolerances and numbers of iterations of a solve; limits of joints are the model's."""

    tolerance: float  # distance that counts as reached [m]
    tolerance_rotation: float  # angle that does [rad]
    max_iterations: int  # of each attempt
    far_iterations: int  # the same where geometry proves a target out of reach
    restarts: int  # further attempts
    chained: bool  # whether each target but the first starts from the solution before it
    phases: int  # starts, always the same, that a solver may try; 1 is the plain method


class Criteria(NamedTuple):
    """The end criteria of attempts at a target, and the number of attempts."""

    # distance from the target that counts as reached [m], less the rounding of the final pose; of a
    # target out of reach beyond the least distance that geometry allows
    distance: float
    angle: float  # the same for rotations [rad]
    margin: float  # an error that changes by no more has stalled [m]
    # of an attempt from the start or a random configuration, and of all phases together
    max_iterations: int
    restarts: int  # attempts from random configurations
    phases: int  # attempts from the start and from further starts, 1 of a plain method
    extensions: int  # times that the plain attempt has as many iterations again, without phases
    gives_up: bool  # whether attempts are given up early
    redraws_limbs: bool  # whether a restart leaves the limbs whose effectors reach their targets


class Attempts(NamedTuple):
    """The attempts: from the start, from random configurations, in phases; then the spare two."""

    attempts: RecordArray  # ATTEMPT, (attempt + 2,)
    rows: FloatArray  # the coordinates where each ended, (attempt + 2, coordinate)


def limits_of(numbers):
    """Return Limits from an array of their numbers, which comes in faster from Python."""
    return Limits(
        numbers[0], numbers[1], int(numbers[2]), int(numbers[3]), int(numbers[4]),
        numbers[5] > 0.0, int(numbers[6]),
    )  # fmt: skip


def new_search(attempts, width):
    """Return room for attempts on rows of a width, not filled."""
    count = attempts + SPARE
    return Attempts(np.empty(count, ATTEMPT), np.empty((count, width)))


def solve_with_restarts(operations, state, search, target, criteria, history):
    """Make attempts from the start and from other configurations until one reaches the target.

    An attempt at a target in reach is given up early if others may follow. While none reaches the
    target, the most promising attempt given up goes on. The phases have the iterations of an
    attempt together, and begin alike whatever the number of restarts. With a solver of a single
    phase the start goes on for as many iterations as all attempts may make. So the result is no
    worse than with fewer restarts.

    Returns:
        The iterations of all attempts, and whether the best of them has ended by itself.
    """
    begin_search(operations, state, search, target, criteria)
    k, extensions = 0, 0
    while True:
        allowed = iterations_left(search, criteria, k, extensions)
        go_on(operations, state, search, k, target, criteria, allowed, history)
        if search.attempts[BEST]["ending"] == REACHED:
            break
        if perturb(operations, state, search, target, criteria):
            continue
        k = next_attempt(operations, state, search, target, criteria, extensions)
        if k < 0:
            k, extensions = 0, extensions + 1
            if not extend_first(state, search, criteria, extensions):
                break
        operations.place(state)
    best = search.attempts[BEST]
    return best["iterations"], best["ending"] <= STALLED


def first_phase(criteria):
    """Return the index of the attempt that is the first phase, behind all if there are none."""
    return criteria.restarts + 1 if criteria.restarts > 0 or criteria.phases == 1 else 0


def attempt_count(criteria):
    """Return the number of attempts."""
    return first_phase(criteria) + (criteria.phases if criteria.phases > 1 else 0)


def begin_search(operations, state, search, target, criteria):
    """Begin with the start; no attempt at a target out of reach is given up."""
    for k in range(len(search.attempts)):
        attempt = search.attempts[k]
        attempt["iterations"], attempt["ending"], attempt["merit"] = 0, UNMADE, INFINITY
        patience = PATIENCE if k < first_phase(criteria) else PATIENCE_OF_PHASES
        attempt["patience"] = patience if criteria.gives_up else INFINITY
        attempt["milestone"], attempt["since"] = INFINITY, 0
    copy_row(state.row, search.rows[START])
    copy_row(state.row, search.rows[BEST])  # stays where all numbers overflow
    perturb(operations, state, search, target, criteria)


def perturb(operations, state, search, target, criteria):
    """Move the first attempt and the start, once, if they are stuck; return whether they were."""
    start, first = search.attempts[START], search.attempts[0]
    if start["ending"] == STALLED or search.attempts[BEST]["iterations"] != first["iterations"]:
        return False
    if not operations.perturb(state, target, criteria, first):
        return False
    start["ending"] = STALLED
    copy_row(state.row, search.rows[START])
    return True


def next_attempt(operations, state, search, target, criteria, extensions):
    """Write the row of the next attempt, or of the most promising; return its index, -1 if none."""
    phases = first_phase(criteria)
    for k in range(1, attempt_count(criteria)):
        if search.attempts[k]["ending"] == UNMADE:
            if k < phases:
                operations.draw(state, target, criteria, k)
                return k
            if iterations_left(search, criteria, k, extensions) > 0:
                copy_row(search.rows[START], state.row)
                if k > phases:
                    operations.shift(state, k - phases)
                return k
    k = most_promising(search, criteria, extensions)
    if k >= 0:
        attempt = search.attempts[k]
        attempt["patience"] *= MORE_PATIENT
        attempt["milestone"], attempt["since"] = INFINITY, 0
        copy_row(search.rows[k], state.row)
    return k


def most_promising(search, criteria, extensions):
    """Return the attempt given up to go on with: the least patient, then the best; -1 if none.

    Where restarts redraw limbs, each has gone on from the attempt before.
    """
    best, phases = -1, first_phase(criteria)
    for k in range(attempt_count(criteria)):
        attempt = search.attempts[k]
        if attempt["ending"] == GIVEN_UP and not (k < phases and criteria.redraws_limbs):
            rival = search.attempts[best]
            sooner = best < 0 or attempt["patience"] < rival["patience"]
            as_soon = attempt["patience"] == rival["patience"]
            better = sooner or (as_soon and attempt["merit"] < rival["merit"])
            if better and iterations_left(search, criteria, k, extensions) > 0:
                best = k
    return best


def extend_first(state, search, criteria, extensions):
    """Give the first attempt as many iterations again; return whether this is allowed."""
    first = search.attempts[0]
    first["patience"] = INFINITY
    copy_row(search.rows[0], state.row)
    return extensions <= criteria.extensions and first["ending"] in (LIMITED, GIVEN_UP)


def iterations_left(search, criteria, k, extensions):
    """Return how many iterations an attempt may make."""
    most, phases, count = criteria.max_iterations, first_phase(criteria), 0
    if k < phases:
        return (1 + extensions if k == 0 else 1) * most - search.attempts[k]["iterations"]
    for phase in range(phases, attempt_count(criteria)):
        count += search.attempts[phase]["iterations"]
    return most - count


def go_on(operations, state, search, k, target, criteria, allowed, history):
    """Continue attempt k; save its end, and again if it is the best."""
    attempt, best = search.attempts[k], search.attempts[BEST]
    best["iterations"] += solve_once(
        operations, state, target, criteria, attempt, allowed, history, best["iterations"]
    )
    attempt["merit"] = operations.merit(state, target)
    copy_row(state.row, search.rows[k])
    is_settled = attempt["merit"] == best["merit"] and best["ending"] == GIVEN_UP
    if attempt["ending"] == REACHED or attempt["merit"] < best["merit"] or is_settled:
        best["ending"], best["merit"] = attempt["ending"], attempt["merit"]
        copy_row(state.row, search.rows[BEST])


def solve_once(operations, state, target, criteria, attempt, allowed, history, earlier):
    """Update until the target is reached, progress ends, or all iterations allowed are made.

    The end is noted in the attempt; all attempts have made `earlier` iterations so far.

    Returns:
        The iterations made.
    """
    milestone, since = attempt["milestone"], attempt["since"]
    count, ending, before = 0, LIMITED, INFINITY
    while True:
        distance, angle, total, bound = operations.error(state, target)
        if count > 0 or earlier == 0:
            store_if_inside(history, earlier + count, distance)
        if total < PROGRESS * milestone:
            milestone, since = total, 0
        if bound <= criteria.distance and angle <= criteria.angle:
            ending = REACHED
        elif count > 0 and abs(before - total) <= criteria.margin:
            ending = STALLED
        elif since >= attempt["patience"]:
            ending = GIVEN_UP
        if ending != LIMITED or count >= allowed:
            break
        before = total
        operations.update(state, target)
        count += 1
        since += 1
    attempt["iterations"] += count
    attempt["ending"], attempt["milestone"], attempt["since"] = ending, milestone, since
    return count


def copy_row(source, target):
    """Copy a row of numbers into another."""
    for k in range(len(source)):
        target[k] = source[k]


def store_if_inside(row, i, value):
    """Write entry i of a row, if the entry exists."""
    if i < len(row):
        row[i] = value
