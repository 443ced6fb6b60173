"""The two loops of every solver: the iterations of one attempt, and attempts from further starts.

A target is solved on a chain of unlimited balls (`solve_chain.py`) or a mechanism
(`solve_mechanism.py`). What these do differently stands in slots, which one `bind` fills. Their
`state` holds, beside what they work on:

    saved: configurations, a row an attempt and in the last row the best end of one.
    progress: (attempt + 1, 6), see the columns below; the last row is not used.
"""

import math
from typing import NamedTuple

import numpy as np

from ..backend.compiled import Slot
from .result import store_if_inside

# One iteration of a solver: update(state, target).
update = Slot("update")
# error(state, target): the largest distance [m] and angle [rad] from effector to target, the sum of
# all distances and levered angles [m], which shows progress, and the distance that has to be small.
error = Slot("error")
# merit(state, target): what says which attempt is better, the less the better [m].
merit = Slot("merit")
# perturb(state, target, criteria, first): move the first attempt if it is stuck, and return whether
# it was; `first` is its row of progress.
perturb = Slot("perturb")
# save(state, k) and restore(state, k): the configuration to row k of `saved`, and back.
save, restore = Slot("save"), Slot("restore")
# draw(state, target, n): take the configuration of random restart n = 1, 2, ...
draw = Slot("draw")

# An attempt that others may follow is given up once PATIENCE iterations have not brought the error
# to this share of what it was. If no other reaches the target it goes on, MORE_PATIENT times as
# patient each time.
PATIENCE, PROGRESS, MORE_PATIENT = 3, 0.5, 4
# How an attempt ended: within the tolerances, or of the nearest point that geometry allows; with no
# more progress; with its iterations used; given up early.
REACHED, SETTLED, LIMITED, GIVEN_UP = range(4)
# Columns of progress: iterations made, how the attempt ended, its merit [m], its patience, and how
# far the configuration it starts from is from the target [m].
MADE, STATE, COST, WAIT, RANK = range(5)
INFINITY = math.inf


class Limits(NamedTuple):
    """What a solve may leave and take.

    Attributes:
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that does [rad].
        max_iterations: of each attempt.
        far_iterations: the same where geometry proves a target out of reach.
        restarts: further attempts.
        chained: whether each target but the first starts from the solution before it.
    """

    tolerance: float
    tolerance_rotation: float
    max_iterations: int
    far_iterations: int
    restarts: int
    chained: bool


class Criteria(NamedTuple):
    """When an attempt at one target ends.

    Attributes:
        distance: at most this far from the target counts as reached [m], some of it left for the
            rounding of the final pose.
        angle: the same for rotations [rad].
        margin: an error that changes by no more has settled [m].
        max_iterations: of each attempt.
    """

    distance: float
    angle: float
    margin: float
    max_iterations: int


def limits_of(numbers):
    """Return Limits from their numbers in one array, which comes in faster from Python."""
    return Limits(
        numbers[0], numbers[1], int(numbers[2]), int(numbers[3]), int(numbers[4]), numbers[5] > 0.0
    )


def solve_with_restarts(state, target, limits, criteria, history):
    """Attempt from the start, then from random configurations, until one reaches the target.

    While others may follow an attempt at a target in reach is given up early. If none reaches it,
    all are finished, and the first makes as many iterations as all of them may: its ends after one
    attempt's iterations, two and so on count as attempts too. So what restarts give is the best
    of more than one start gives, or fewer restarts, and can be no worse.

    Saves the best attempt in the last row of `state.saved`.

    Returns:
        The iterations of all attempts, and whether the best one settled.
    """
    progress, random = state.progress, len(state.progress) - 2
    reset(progress, PATIENCE if random > 0 and criteria.distance <= limits.tolerance else INFINITY)
    distance, _, _, _ = error(state, target)
    store_if_inside(history, 0, distance)
    perturbed = perturb(state, target, criteria, progress[0])
    best, ending, done, drawn, periods = INFINITY, LIMITED, 0, 0, 1
    k, most = 0, criteria.max_iterations
    while k >= 0:
        done += solve_once(state, target, criteria, progress[k], most, history, done)
        if rate(state, target, progress[k], k, best):
            best, ending = progress[k, COST], int(progress[k, STATE])
            save(state, len(progress) - 1)
        if ending == REACHED:
            break
        if k == 0 and not perturbed:
            perturbed = perturb(state, target, criteria, progress[0])
            if perturbed:
                continue
        if drawn < random:
            drawn += 1
            k, most = drawn, criteria.max_iterations
            draw(state, target, drawn)
            continue
        k = most_promising(progress)
        if k < 0 and periods <= limits.restarts and progress[0, STATE] == LIMITED:
            k, periods = 0, periods + 1
        if k >= 0:
            most = periods * criteria.max_iterations
            restore(state, k)
    return done, ending <= SETTLED


def new_progress(attempts):
    """Return rows for the progress of attempts, not filled."""
    return np.empty((attempts + 1, RANK + 1))


def reset(progress, patience):
    """Note that no attempt has been made."""
    for k in range(len(progress) - 1):
        row = progress[k]
        row[MADE], row[STATE], row[COST] = 0.0, LIMITED, INFINITY
        row[WAIT] = patience


def solve_once(state, target, criteria, attempt, most, history, done):
    """Update until the target is reached, the error settles, or `most` iterations are made.

    `attempt` is the row of progress, where it is noted how the attempt ends; `done` iterations
    have been made by all attempts.

    Returns:
        The iterations made.
    """
    _, angle, total, bound = error(state, target)
    milestone, since = total, 0
    first, ending = int(attempt[MADE]), LIMITED
    made = first
    while ending == LIMITED:
        if bound <= criteria.distance and angle <= criteria.angle:
            ending = REACHED
        if ending == REACHED or made >= most:
            break
        before = total
        update(state, target)
        made += 1
        distance, angle, total, bound = error(state, target)
        store_if_inside(history, done + made - first, distance)
        since += 1
        if total < PROGRESS * milestone:
            milestone, since = total, 0
        if abs(before - total) <= criteria.margin:
            ending = SETTLED
        elif since >= attempt[WAIT]:
            ending = GIVEN_UP
    if ending != LIMITED and bound <= criteria.distance and angle <= criteria.angle:
        ending = REACHED
    attempt[MADE], attempt[STATE] = made, ending
    return made - first


def rate(state, target, attempt, k, best):
    """Save where attempt k is; return whether it is finished and better than the best [m]."""
    attempt[COST] = merit(state, target)
    save(state, k)
    if attempt[STATE] == GIVEN_UP:
        attempt[WAIT] *= MORE_PATIENT
        return False
    return attempt[STATE] == REACHED or attempt[COST] < best


def most_promising(progress):
    """Return the attempt to go on with of those given up, -1 if there is none.

    The least patient come first, and among them the one of the least merit.
    """
    found, row = -1, progress[-1]
    for k in range(len(progress) - 1):
        other = progress[k]
        if other[STATE] == GIVEN_UP:
            sooner = found < 0 or other[WAIT] < row[WAIT]
            if sooner or (other[WAIT] == row[WAIT] and other[COST] < row[COST]):
                found, row = k, other
    return found


def copy_row(source, target):
    """Copy one row of numbers into another."""
    for k in range(len(source)):
        target[k] = source[k]
