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
    made_unit,
    multiply,
    norm,
    normalised,
    put_quaternion,
    quaternion_at,
    subtract,
    turn_about,
    vector_at,
)
from .batch import ITERATIONS, OUTCOME, RESIDUAL, RESIDUAL_ROTATION, fill_from
from .chain import BEND, ROUNDING
from .joint_updates import ball_at, move_by, put_ball
from .levenberg_marquardt import levenberg_marquardt_update as update  # bound to each solver's
from .mechanism import (
    EFFECTOR,
    LEVER,
    ORIENTED,
    POSITION,
    ROTATION,
    Mechanism,
    give_coordinates,
    new_posture,
    place,
    residuals,
    take_coordinates,
    too_far,
)
from .stacked import Stack, new_stack

# An attempt that others may follow is given up once this many iterations have not brought it this
# much nearer; but for the last of all, and one in so many before it.
PATIENCE, PROGRESS, PATIENT = 3, 0.5, 4
# One that stalls within so few is stuck, such as a straight chain, perhaps folded since, whose
# target lies on its own line.
STUCK = 6
INFINITY = math.inf
# A stuck ball is bent about this axis of its own, which lies across no plane of the axes.
NUDGE_AXIS = (0.48, 0.6, 0.64)


class Room(NamedTuple):
    """Room for a solver.

    Attributes:
        stack: of the Jacobian methods.
        wishes: where FABRIK wishes joints to be [m], and by what weight, (joint, 4).
        eigen: Davenport's matrix and its eigenvectors, (2, 4, 4).
        ranks: how far from the goal the poses to restart from are [m], (restart,).
    """

    stack: Stack
    wishes: FloatArray
    eigen: FloatArray
    ranks: FloatArray


class Request(NamedTuple):
    """What is asked.

    Attributes:
        goals: where the effectors shall be, (target, effector, 8), see `mechanism.py`.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that does [rad].
        max_iterations: of each attempt.
        restarts: coordinates of the mechanism for further attempts, (restart, coordinate).
        tips: where they put the effectors, positions [m] and rotations, (restart, effector, 7).
        chained: whether each target but the first starts from the solution before it.
    """

    goals: FloatArray
    tolerance: float
    tolerance_rotation: float
    max_iterations: int
    restarts: FloatArray
    tips: FloatArray
    chained: bool


class Answers(NamedTuple):
    """What the kernel fills in, a row a target.

    Attributes:
        q: coordinates of the articulation, (target, coordinate).
        local: local rotations, (target, joint, 4).
        positions: of all joints [m], (target, joint, 3).
        figures: see `batch.py`, (target, 4).
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
    max_iterations, restarts, restart_tips, chained, q, local, positions, figures, history,
):  # fmt: skip
    """Do what `answer_batch` does, called from Python: single arrays come in faster than tuples."""
    own = JointArrays(own_integers, own_numbers)
    mechanism = Mechanism(
        own, sources, effectors, tips, bonds, reach, coordinates, freedoms, equations
    )
    request = Request(
        goals, tolerance, tolerance_rotation, max_iterations, restarts, restart_tips, chained
    )
    answers = Answers(q, local, positions, figures, history)
    return answer_batch(JointArrays(integers, numbers), mechanism, starts, request, answers)


def answer_batch(joints, mechanism, starts, request, answers):
    """Answer target after target; return whether all starts and goals were fit to compute with.

    `starts`, (start, coordinate), are used in turn.
    """
    posture, best = new_posture(mechanism), np.empty(mechanism.coordinates)
    room, rotations = (
        new_room(mechanism, len(request.restarts)),
        np.empty((len(joints.integers), 4)),
    )
    for i in range(len(request.goals)):
        q, goal = answers.q[i], request.goals[i]
        chained = request.chained and i > 0
        copy(answers.q[i - 1] if chained else starts[i % len(starts)], q)
        if not (fit_start(joints, q) and fit_goal(goal)):
            return False
        take_coordinates(mechanism, q, posture.q)
        history = answers.history[i % len(answers.history)]
        iterations, stalled = attempts(mechanism, goal, posture, room, request, best, history)
        give_coordinates(mechanism, best, q)
        articulated_pose(joints, q, answers.positions[i], rotations)
        for j in range(len(joints.integers)):
            _, Q = joint_transform(joints, j, q)
            put_quaternion(answers.local[i], j, Q)
        answers.figures[i, ITERATIONS] = iterations
        conclude(mechanism, goal, request, answers, i, rotations, stalled)
    return True


def fit_goal(goal):
    """Make the rotations of a goal unit; return whether they and all other numbers were fit."""
    fine = True
    for e in range(len(goal)):
        for k in range(ROTATION):
            fine &= abs(goal[e, k]) <= LARGEST_COORDINATE
        Q, unit = made_unit(quaternion_at(goal, e, ROTATION))
        goal[e, ROTATION], goal[e, ROTATION + 1], goal[e, ROTATION + 2], goal[e, ROTATION + 3] = Q
        fine &= unit
    return fine


def new_room(mechanism, restarts):
    """Return room for a solver of a mechanism."""
    n = len(mechanism.joints.integers)
    return Room(new_stack(mechanism), np.empty((n, 4)), np.empty((2, 4, 4)), np.empty(restarts))


def attempts(mechanism, goal, posture, room, request, best, history):
    """Attempt from the posture, then from a bent one if that is stuck, then from the restarts.

    Of the poses to restart from, the one that brings the effectors nearest to the goal comes first.

    Fills `best` with the coordinates of the best attempt.

    Returns:
        The iterations of all attempts, and whether the best one stalled.
    """
    more = len(request.restarts)
    for joint in range(len(mechanism.joints.integers)):
        clamp_joint(mechanism.joints, joint, posture.q)
    place(mechanism, posture)
    distance, _, _ = residuals(mechanism, goal, posture)
    fill_from(history, 0, distance)
    done, stalled, merit = attempt(mechanism, goal, posture, room, request, history, 0, more > 0)
    copy(posture.q, best)
    few = PATIENCE if more > 0 else STUCK
    if done < few and stalled and merit > ROUNDING * mechanism.reach:
        nudge(mechanism, posture)
        done, stuck, nudged = attempt(
            mechanism, goal, posture, room, request, history, done, more > 0
        )
        if nudged < merit:
            copy(posture.q, best)
            stalled, merit = stuck, nudged
    if merit > 0.0:
        rank_restarts(mechanism, goal, request, room)
    for r in range(more):
        if merit == 0.0:
            break
        take_nearest(request, room, posture.q)
        place(mechanism, posture)
        done, stuck, again = attempt(
            mechanism, goal, posture, room, request, history, done, r < more - 1 - more // PATIENT
        )
        if again < merit:
            copy(posture.q, best)
            stalled, merit = stuck, again
    return done, stalled


def rank_restarts(mechanism, goal, request, room):
    """Fill how far the effectors are from the goal [m] in each of the poses to restart from."""
    lever = LEVER * mechanism.reach
    for r in range(len(request.restarts)):
        distance, angle = 0.0, 0.0
        for e in range(len(goal)):
            way = subtract(vector_at(goal, e, POSITION), vector_at(request.tips[r], e))
            distance = max(distance, norm(way))
            if mechanism.effectors[e, ORIENTED]:
                wanted = quaternion_at(goal, e, ROTATION)
                angle = max(angle, rough_angle(quaternion_at(request.tips[r], e, 3), wanted))
        room.ranks[r] = distance + lever * angle


def rough_angle(a, b):
    """Return the angle from a to b [rad] by its quarter's sine, at most a tenth too small."""
    w = abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3])
    return 4.0 * math.sqrt(max(0.5 - 0.5 * w, 0.0))


def take_nearest(request, room, q):
    """Copy the nearest of the poses to restart from that has not yet been taken."""
    nearest = 0
    for r in range(1, len(room.ranks)):
        if room.ranks[r] < room.ranks[nearest]:
            nearest = r
    room.ranks[nearest] = INFINITY
    copy(request.restarts[nearest], q)


def attempt(mechanism, goal, posture, room, request, history, done, hasty):
    """Update a placed posture until it reaches its goal, stalls, or has had its iterations.

    Returns:
        All iterations so far, whether it ended before its last, and how far it is from its goal
        [m], 0 if it reached that.
    """
    distance, angle, merit = residuals(mechanism, goal, posture)
    milestone, since = merit, 0
    for i in range(request.max_iterations + 1):
        if within(mechanism, request, distance, angle):
            return done + i, True, 0.0
        if i == request.max_iterations:
            break
        before = merit
        update(mechanism, goal, posture, room)
        distance, angle, merit = residuals(mechanism, goal, posture)
        fill_from(history, done + i + 1, distance)
        since += 1
        if merit < PROGRESS * milestone:
            milestone, since = merit, 0
        still = abs(before - merit) <= ROUNDING * mechanism.reach
        if still or (hasty and since >= PATIENCE):
            reached = within(mechanism, request, distance, angle)
            return done + i + 1, True, 0.0 if reached else merit
    return done + request.max_iterations, False, merit


def within(mechanism, request, distance, angle):
    """Return whether the tolerances are kept, with some room for the rounding of another pose."""
    room = min(ROUNDING * mechanism.reach, 0.5 * request.tolerance)
    angular = min(ROUNDING, 0.5 * request.tolerance_rotation)
    return distance <= request.tolerance - room and angle <= request.tolerance_rotation - angular


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
    place(mechanism, posture)


def conclude(mechanism, goal, request, answers, i, rotations, stalled):
    """Fill residuals and outcome of a target from the pose of all joints."""
    distance, angle = 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        j = mechanism.effectors[e, EFFECTOR]
        way = subtract(vector_at(goal, e, POSITION), vector_at(answers.positions[i], j))
        distance = max(distance, norm(way))
        if mechanism.effectors[e, ORIENTED]:
            wanted = quaternion_at(goal, e, ROTATION)
            angle = max(angle, angle_between(quaternion_at(rotations, j), wanted))
    answers.figures[i, RESIDUAL], answers.figures[i, RESIDUAL_ROTATION] = distance, angle
    outcome = outcome_of(mechanism, goal, request, distance, angle, stalled)
    answers.figures[i, OUTCOME] = outcome.value


def outcome_of(mechanism, goal, request, distance, angle, stalled):
    """Return how a solve ended: UNREACHABLE only where geometry proves it."""
    if distance <= request.tolerance and angle <= request.tolerance_rotation:
        return Outcome.CONVERGED
    if too_far(mechanism, goal, request.tolerance):
        return Outcome.UNREACHABLE
    return Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT


def copy(source, target):
    """Copy one row of numbers into another."""
    for k in range(len(source)):
        target[k] = source[k]
