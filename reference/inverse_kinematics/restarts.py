"""The loops around a solver's update of a mechanism: one attempt, restarts, and many targets."""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import LARGEST_COORDINATE, FloatArray
from ..articulation import (
    BALL,
    FREE,
    HINGE,
    KIND,
    LEADER,
    JointArrays,
    articulated_pose,
    clamp_joint,
    fit_start,
    joint_transform,
)
from ..outcome import Outcome
from ..quaternion import (
    angle_between,
    load_quaternion,
    load_vector,
    made_unit,
    multiply,
    norm,
    normalised,
    store_quaternion,
    subtract,
    turn_about,
)
from .batch import (
    EXCESS,
    ITERATIONS,
    MERIT,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_ROTATION,
    put_if_room,
)
from .chain import BEND, POSITION_ROUNDING
from .joint_updates import ball_at, move_by, put_ball
from .levenberg_marquardt import levenberg_marquardt_update as update  # bound to each solver's
from .mechanism import (
    EFFECTOR,
    LEVER,
    ORIENTED,
    POSITION,
    ROTATION,
    WEIGHT,
    Mechanism,
    give_coordinates,
    least_residual,
    merit_of,
    new_posture,
    place,
    residuals,
    take_coordinates,
    weighted_square,
)
from .stacked import Stack, new_stack

# An attempt that others may follow is given up once this many iterations have not brought it this
# much nearer. If none of the others reaches the target either it goes on, so many times as patient
# whenever it does.
PATIENCE, PROGRESS, MORE_PATIENT = 3, 0.5, 4
# One that settles within so few is stuck, such as a straight chain, perhaps folded since, whose
# target lies on its own line.
STUCK = 6
# How an attempt ended: within the tolerances, or of the nearest point that geometry allows; with no
# more progress; with its iterations used; given up early.
REACHED, SETTLED, LIMITED, GIVEN_UP = range(4)
# Columns of Room.progress, (attempt, 6): iterations made, how it ended, its merit [m], 1 where its
# stuck start has been bent, its patience, and how far the pose it starts from is from the goal [m].
MADE, STATE, COST, BENT, WAIT, RANK = range(6)
# Entries of the last row of Room.progress: merit [m] and ending of the best attempt that is
# finished; how many poses to restart from have been taken; how many attempts' iterations the first
# one may make.
BEST_COST, BEST_STATE, TAKEN, PERIODS = range(4)
INFINITY = math.inf
# A stuck ball is bent about this axis of its own, which lies across no plane of the axes.
NUDGE_AXIS = (0.48, 0.6, 0.64)


class Room(NamedTuple):
    """Room for a solver.

    Attributes:
        stack: of the Jacobian methods.
        wishes: where FABRIK wishes joints to be [m], and by what weight, (joint, 4).
        eigen: Davenport's matrix and its eigenvectors, (2, 4, 4).
        q: coordinates of the mechanism where each attempt is, the first from the start,
            and in the last row the best end of one, (1 + restart + 1, coordinate).
        progress: of each attempt and of all, see above, (1 + restart + 1, 6).
    """

    stack: Stack
    wishes: FloatArray
    eigen: FloatArray
    q: FloatArray
    progress: FloatArray


class Request(NamedTuple):
    """What is asked.

    Attributes:
        goals: where the effectors shall be, (target, effector, 8), see `mechanism.py`.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that does [rad].
        max_iterations: of each attempt.
        far_iterations: the same where geometry proves a target out of reach.
        restarts: coordinates of the mechanism for further attempts, (restart, coordinate).
        tips: where they put the effectors, positions [m] and rotations, (restart, effector, 7).
        chained: whether each target but the first starts from the solution before it.
    """

    goals: FloatArray
    tolerance: float
    tolerance_rotation: float
    max_iterations: int
    far_iterations: int
    restarts: FloatArray
    tips: FloatArray
    chained: bool


class Answers(NamedTuple):
    """What the kernel fills in, a row a target.

    Attributes:
        q: coordinates of the articulation, (target, coordinate).
        local: local rotations, (target, joint, 4).
        positions: of all joints [m], (target, joint, 3).
        figures: see `batch.py`, (target, 6).
        history: distances before and after each iteration [m], (target, iteration), or (1, 1).
    """

    q: FloatArray
    local: FloatArray
    positions: FloatArray
    figures: FloatArray
    history: FloatArray


def answer_given(
    integers, numbers, own_integers, own_numbers, sources, effectors, tips, bonds, reach,
    coordinates, freedoms, equations, starts, goals, tolerance, tolerance_rotation,
    max_iterations, far_iterations, restarts, restart_tips, chained, q, local, positions, figures,
    history,
):  # fmt: skip
    """Do what `answer_batch` does, called from Python: single arrays come in faster than tuples."""
    own = JointArrays(own_integers, own_numbers)
    mechanism = Mechanism(
        own, sources, effectors, tips, bonds, reach, coordinates, freedoms, equations
    )
    request = Request(
        goals, tolerance, tolerance_rotation, max_iterations, far_iterations, restarts,
        restart_tips, chained,
    )  # fmt: skip
    answers = Answers(q, local, positions, figures, history)
    return answer_batch(JointArrays(integers, numbers), mechanism, starts, request, answers)


def answer_batch(joints, mechanism, starts, request, answers):
    """Answer target after target; return whether all starts and goals were fit to compute with.

    `starts`, (start, coordinate), are used in turn.
    """
    posture, rotations = new_posture(mechanism), np.empty((len(joints.integers), 4))
    room = new_room(mechanism, len(request.restarts))
    for i in range(len(request.goals)):
        q, goal = answers.q[i], request.goals[i]
        chained = request.chained and i > 0
        copy_row(answers.q[i - 1] if chained else starts[i % len(starts)], q)
        if not (fit_start(joints, q) and fit_goal(goal)):
            return False
        take_coordinates(mechanism, q, posture.q)
        history = answers.history[i % len(answers.history)]
        least = least_residual(mechanism, goal)
        iterations, settled = attempts(mechanism, goal, posture, room, request, history, least)
        give_coordinates(mechanism, room.q[-1], q)
        articulated_pose(joints, q, answers.positions[i], rotations)
        for j in range(len(joints.integers)):
            _, Q = joint_transform(joints, j, q)
            store_quaternion(answers.local[i], j, Q)
        answers.figures[i, ITERATIONS] = iterations
        conclude(mechanism, goal, request, answers, i, rotations, least, settled)
    return True


def fit_goal(goal):
    """Make the rotations of a goal unit; return whether they and all other numbers were fit."""
    fine = True
    for e in range(len(goal)):
        for k in range(ROTATION):
            fine &= abs(goal[e, k]) <= LARGEST_COORDINATE
        Q, unit = made_unit(load_quaternion(goal, e, ROTATION))
        goal[e, ROTATION], goal[e, ROTATION + 1], goal[e, ROTATION + 2], goal[e, ROTATION + 3] = Q
        fine &= unit
    return fine


def new_room(mechanism, restarts):
    """Return room for a solver of a mechanism."""
    n = len(mechanism.joints.integers)
    return Room(
        new_stack(mechanism), np.empty((n, 4)), np.empty((2, 4, 4)),
        np.empty((restarts + 2, mechanism.coordinates)), np.empty((restarts + 2, 6)),
    )  # fmt: skip


def attempts(mechanism, goal, posture, room, request, history, least):
    """Attempt from the posture, then from the restarts, until one reaches the goal.

    While others may follow an attempt is given up early. If none reaches the goal, all are
    finished, and the first makes as many iterations as all of them may: its ends after one
    attempt's iterations, two and so on count as attempts too. So what restarts give is the best
    of more than one start gives, or fewer restarts, and can be no worse.

    Fills the last row of `room.q` with the coordinates of the best attempt; no pose has a lesser
    residual than `least` [m].

    Returns:
        The iterations of all attempts, and whether the best one settled.
    """
    start_attempts(mechanism, posture, room)
    count = request.far_iterations if least > request.tolerance else request.max_iterations
    single = len(goal) == 1 and not mechanism.effectors[0, ORIENTED]
    nearest = least if single else 0.0
    done, k, limit = 0, 0, count
    while k >= 0:
        place(mechanism, posture)
        done += attempt(mechanism, goal, posture, room, request, history, done, k, limit, nearest)
        keep_better(mechanism, goal, posture, room, k)
        k, limit = next_attempt(mechanism, goal, posture, room, request, k, count, limit)
    return done, room.progress[-1, BEST_STATE] <= SETTLED


def start_attempts(mechanism, posture, room):
    """Bring the start within its limits, and note that no attempt has been made."""
    for joint in range(len(mechanism.joints.integers)):
        clamp_joint(mechanism.joints, joint, posture.q)
    plan, several = room.progress[-1], len(room.progress) > 2
    plan[BEST_COST], plan[BEST_STATE], plan[TAKEN], plan[PERIODS] = INFINITY, LIMITED, 0.0, 1.0
    for k in range(len(room.progress) - 1):
        row = room.progress[k]
        row[MADE], row[STATE], row[COST], row[BENT] = 0.0, LIMITED, INFINITY, 0.0
        row[WAIT] = PATIENCE if several else INFINITY


def next_attempt(mechanism, goal, posture, room, request, k, count, limit):
    """Give the posture the coordinates from which an attempt goes on, after one of k.

    Returns:
        Which attempt, -1 if none, and how many iterations it may have made in the end.
    """
    plan, first, more = room.progress[-1], room.progress[0], len(request.restarts)
    if plan[BEST_STATE] == REACHED:
        return -1, limit
    if k == 0 and is_stuck(mechanism, first):
        nudge(mechanism, posture)
        first[BENT] = 1.0
        return 0, limit
    if plan[TAKEN] < more:
        if plan[TAKEN] == 0.0:
            rank_restarts(mechanism, goal, request, room)
        take_nearest(request, room, posture.q)
        plan[TAKEN] += 1.0
        return int(plan[TAKEN]), count
    again = most_promising(room)
    if again < 0 and plan[PERIODS] <= more and first[STATE] == LIMITED:
        again = 0
        plan[PERIODS] += 1.0
    if again >= 0:
        copy_row(room.q[again], posture.q)
    return again, int(plan[PERIODS]) * count


def is_stuck(mechanism, row):
    """Return whether an attempt settled at once, away from its goal, and has not been bent yet."""
    away = row[COST] > POSITION_ROUNDING * mechanism.reach
    return row[STATE] == SETTLED and row[MADE] < STUCK and row[BENT] == 0.0 and away


def most_promising(room):
    """Return the attempt to go on with of those given up, -1 if there is none.

    The least patient come first, and among them the one of the least merit.
    """
    found, row = -1, room.progress[-1]
    for k in range(len(room.progress) - 1):
        other = room.progress[k]
        if other[STATE] == GIVEN_UP:
            sooner = found < 0 or other[WAIT] < row[WAIT]
            if sooner or (other[WAIT] == row[WAIT] and other[COST] < row[COST]):
                found, row = k, other
    return found


def keep_better(mechanism, goal, posture, room, k):
    """Note where an attempt is, and keep it if it is finished and the best so far."""
    row, plan, cost = room.progress[k], room.progress[-1], merit_of(mechanism, goal, posture)
    row[COST] = cost
    copy_row(posture.q, room.q[k])
    if row[STATE] == GIVEN_UP:
        row[WAIT] *= MORE_PATIENT
    elif row[STATE] == REACHED or cost < plan[BEST_COST]:
        plan[BEST_COST], plan[BEST_STATE] = cost, row[STATE]
        copy_row(posture.q, room.q[-1])


def rank_restarts(mechanism, goal, request, room):
    """Fill how far the effectors are from the goal [m] in each of the poses to restart from."""
    lever = LEVER * mechanism.reach
    for r in range(len(request.restarts)):
        distance, angle = 0.0, 0.0
        for e in range(len(goal)):
            way = subtract(load_vector(goal, e, POSITION), load_vector(request.tips[r], e))
            distance = max(distance, norm(way))
            if mechanism.effectors[e, ORIENTED]:
                wanted = load_quaternion(goal, e, ROTATION)
                angle = max(angle, rough_angle(load_quaternion(request.tips[r], e, 3), wanted))
        room.progress[1 + r, RANK] = distance + lever * angle


def rough_angle(a, b):
    """Return the angle from a to b [rad] by its quarter's sine, at most a tenth too small."""
    w = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 4.0 * math.sqrt(max(0.5 - 0.5 * w, 0.0))


def take_nearest(request, room, q):
    """Copy the nearest of the poses to restart from that has not yet been taken."""
    nearest = 0
    for r in range(1, len(request.restarts)):
        if room.progress[1 + r, RANK] < room.progress[1 + nearest, RANK]:
            nearest = r
    room.progress[1 + nearest, RANK] = INFINITY
    copy_row(request.restarts[nearest], q)


def attempt(mechanism, goal, posture, room, request, history, done, k, count, least):
    """Update a placed posture until it reaches its goal, settles, or has had its iterations.

    `done` iterations have been made by all attempts; how this one, k, ends is noted.

    Returns:
        The iterations made.
    """
    distance, angle, total = residuals(mechanism, goal, posture)
    if done == 0 and k == 0:
        put_if_room(history, 0, distance)
    milestone, since = total, 0
    first, state = int(room.progress[k, MADE]), LIMITED
    made = first
    while state == LIMITED:
        if within(mechanism, request, distance, angle, least):
            state = REACHED
        if state == REACHED or made >= count:
            break
        before = total
        update(mechanism, goal, posture, room)
        made += 1
        distance, angle, total = residuals(mechanism, goal, posture)
        put_if_room(history, done + made - first, distance)
        since += 1
        if total < PROGRESS * milestone:
            milestone, since = total, 0
        if abs(before - total) <= POSITION_ROUNDING * mechanism.reach:
            state = REACHED if within(mechanism, request, distance, angle, least) else SETTLED
        elif since >= room.progress[k, WAIT]:
            state = REACHED if within(mechanism, request, distance, angle, least) else GIVEN_UP
    room.progress[k, MADE], room.progress[k, STATE] = made, state
    return made - first


def within(mechanism, request, distance, angle, least):
    """Return whether the tolerances are kept, with some room for the rounding of another pose.

    A single target out of reach counts as kept within the tolerance of the least distance.
    """
    room = min(POSITION_ROUNDING * mechanism.reach, 0.5 * request.tolerance)
    angular = min(POSITION_ROUNDING, 0.5 * request.tolerance_rotation)
    near = distance <= least + request.tolerance - room
    return near and angle <= request.tolerance_rotation - angular


def nudge(mechanism, posture):
    """Bend a stuck mechanism, always in the same way: every joint by a share of one angle."""
    joints, q, count = mechanism.joints, posture.q, len(mechanism.joints.integers)
    for j in range(count):
        kind, angle = joints.integers[j, KIND], BEND / count
        if joints.integers[j, LEADER] != j:
            continue
        if kind == HINGE and move_by(joints, q, j, angle) == 0.0:
            move_by(joints, q, j, -angle)
        elif kind in (BALL, FREE):
            turn = turn_about(NUDGE_AXIS, angle)
            put_ball(joints, q, j, normalised(multiply(ball_at(joints, q, j), turn)))
            clamp_joint(joints, j, q)


def conclude(mechanism, goal, request, answers, i, rotations, least, settled):
    """Fill residuals, merit and outcome of a target from the pose of all joints."""
    distance, angle, total = 0.0, 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        j, apart, off = mechanism.effectors[e, EFFECTOR], 0.0, 0.0
        apart = norm(subtract(load_vector(goal, e, POSITION), load_vector(answers.positions[i], j)))
        if mechanism.effectors[e, ORIENTED]:
            off = angle_between(load_quaternion(rotations, j), load_quaternion(goal, e, ROTATION))
        distance, angle = max(distance, apart), max(angle, off)
        total += weighted_square(mechanism, goal[e, WEIGHT], apart, off)
    figures = answers.figures[i]
    figures[RESIDUAL], figures[RESIDUAL_ROTATION], figures[MERIT] = (
        distance,
        angle,
        math.sqrt(total),
    )
    figures[EXCESS] = max(0.0, distance - least)
    figures[OUTCOME] = outcome_of(request, distance, angle, least, settled).value


def outcome_of(request, distance, angle, least, settled):
    """Return how a solve ended: UNREACHABLE only where geometry proves it."""
    if distance <= request.tolerance and angle <= request.tolerance_rotation:
        return Outcome.CONVERGED
    if least > request.tolerance:
        return Outcome.UNREACHABLE if settled else Outcome.UNREACHABLE_UNSETTLED
    return Outcome.STALLED if settled else Outcome.ITERATION_LIMIT


def copy_row(source, target):
    """Copy one row of numbers into another."""
    for k in range(len(source)):
        target[k] = source[k]
