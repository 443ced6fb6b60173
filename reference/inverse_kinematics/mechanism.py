"""The joints that move some effector, and where they put it: what the general solvers work on.

Chains of unlimited balls with one position to reach have `chain.py` to themselves. Everything else
is a mechanism: joints of all kinds with limits, several effectors, positions and rotations. Fixed
joints are merged into the ones below them. See `reduce.py` for how one is made.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import (
    AXIS,
    FRAME,
    KIND,
    LEADER,
    OFFSET,
    PARENT,
    WIDTHS,
    JointArrays,
    articulated_pose,
)
from ..quaternion import (
    add,
    conjugate,
    dot,
    load_quaternion,
    load_vector,
    logarithm,
    multiply,
    norm,
    rotate,
    store_quaternion,
    store_vector,
    subtract,
)
from .chain import POSITION_ROUNDING

# A wrong rotation counts as much as a wrong position of its angle times this part of the reach.
LEVER = 0.5
# Columns of Mechanism.effectors: the joint an effector hangs on, -1 if none moves it; where its
# equations begin; 1 where its rotation matters, else 0; the first joint on the way to it, or -1;
# the effector among the joints of the articulation.
HANGS, ROW, ORIENTED, TOP, EFFECTOR = range(5)
# Columns of Mechanism.tips: where the three of the arm and the four of the rotation in the frame of
# that joint begin [m]; how far the effector can be from the first joint [m].
ARM, TURN, REACH = 0, 3, 7
# Columns of a goal, (effector, 8): where the three of the position [m] and the four of the rotation
# begin, and the weight.
POSITION, ROTATION, WEIGHT = 0, 3, 7


class Mechanism(NamedTuple):
    """Joints, and effectors that hang on them; parents precede children.

    Attributes:
        joints: the joints that move, fixed ones merged; coordinates are the mechanism's own.
        sources: where a joint's coordinates begin among the articulation's, (joint,).
        effectors: (effector, 5), see above.
        tips: (effector, 8), see above.
        bonds: first for each effector 1 where a joint moves it, 2 where no joint does between, else
            0; then for each joint below 1 where a turn moves it and no joint does between, else 0;
            on the diagonal 1 where others follow a joint, (joint, effector + joint).
        reach: the longest way from root to effector, slides left out unless there is nothing else
            [m].
        coordinates: how many.
        freedoms: how many.
        equations: how many in all.
    """

    joints: JointArrays
    sources: IndexArray
    effectors: IndexArray
    tips: FloatArray
    bonds: IndexArray
    reach: float
    coordinates: int
    freedoms: int
    equations: int


class Posture(NamedTuple):
    """A mechanism's coordinates, and where they put it; effectors come behind the joints.

    Attributes:
        q: (coordinate,).
        positions: [m], (joint + effector, 3).
        rotations: of the joints as moved, (joint + effector, 4).
    """

    q: FloatArray
    positions: FloatArray
    rotations: FloatArray


def new_posture(mechanism):
    """Return a posture to be filled."""
    count = len(mechanism.joints.integers) + len(mechanism.effectors)
    return Posture(np.empty(mechanism.coordinates), np.empty((count, 3)), np.empty((count, 4)))


def take_coordinates(mechanism, q, own):
    """Copy the mechanism's own coordinates out of the articulation's."""
    at = 0
    for j in range(len(mechanism.sources)):
        for k in range(width(mechanism.joints, j)):
            own[at] = q[mechanism.sources[j] + k]
            at += 1


def give_coordinates(mechanism, own, q):
    """Copy the mechanism's own coordinates back among the articulation's."""
    at = 0
    for j in range(len(mechanism.sources)):
        for k in range(width(mechanism.joints, j)):
            q[mechanism.sources[j] + k] = own[at]
            at += 1


def width(joints, j):
    """Return how many coordinates a joint has of its own."""
    return WIDTHS[joints.integers[j, KIND]] if joints.integers[j, LEADER] == j else 0


def moves(mechanism, j, e):
    """Return whether a joint moves an effector."""
    return mechanism.bonds[j, e] > 0


def sees_tip(mechanism, j, e):
    """Return whether a joint moves an effector and no joint does between."""
    return mechanism.bonds[j, e] == 2


def sees(mechanism, j, c):
    """Return whether a turn of a joint moves one below and no joint does between."""
    return mechanism.bonds[j, len(mechanism.effectors) + c] > 0


def is_followed(mechanism, j):
    """Return whether mimic joints move with a joint."""
    return mechanism.bonds[j, len(mechanism.effectors) + j] > 0


def place(mechanism, posture):
    """Compute where the coordinates put the joints and the effectors."""
    articulated_pose(mechanism.joints, posture.q, posture.positions, posture.rotations)
    for e in range(len(mechanism.effectors)):
        x, R = load_vector(mechanism.tips, e, ARM), load_quaternion(mechanism.tips, e, TURN)
        j = mechanism.effectors[e, HANGS]
        if j >= 0:
            R_joint = load_quaternion(posture.rotations, j)
            x = add(load_vector(posture.positions, j), rotate(R_joint, x))
            R = multiply(R_joint, R)
        put_tip(mechanism, posture, e, x, R)


def tip(mechanism, posture, e):
    """Return the position of an effector."""
    return load_vector(posture.positions, len(mechanism.joints.integers) + e)


def tip_rotation(mechanism, posture, e):
    """Return the rotation of an effector."""
    return load_quaternion(posture.rotations, len(mechanism.joints.integers) + e)


def put_tip(mechanism, posture, e, x, R):
    """Write an effector's position and rotation."""
    store_vector(posture.positions, len(mechanism.joints.integers) + e, x)
    store_quaternion(posture.rotations, len(mechanism.joints.integers) + e, R)


def axis_of(joints, j, R):
    """Return a joint's axis in the world, R its rotation there."""
    return rotate(R, load_vector(joints.numbers, j, AXIS))


def frame_of(joints, j, posture):
    """Return the rotation of a joint's unmoved frame in the world."""
    frame = load_quaternion(joints.numbers, j, FRAME)
    if joints.integers[j, PARENT] < 0:
        return frame
    return multiply(load_quaternion(posture.rotations, joints.integers[j, PARENT]), frame)


def position_error(mechanism, goal, posture, e):
    """Return the way from an effector to its target [m]."""
    return subtract(load_vector(goal, e, POSITION), tip(mechanism, posture, e))


def wrong_turn(mechanism, goal, posture, e):
    """Return the rotation in the world that turns an effector into its target."""
    R = tip_rotation(mechanism, posture, e)
    return multiply(load_quaternion(goal, e, ROTATION), conjugate(R))


def turn_weight(mechanism):
    """Return what half the squared distance of two rotation matrices counts beside 1 m²: lever²/2.

    For a small angle it is the square of the angle, 3 - tr R in general.
    """
    lever = LEVER * mechanism.reach
    return 0.5 * lever * lever


def misfit(mechanism, goal, posture):
    """Return what CCD makes smaller [m²]: weighted squared distances, and lever² (3 - tr R*' R)."""
    total = 0.0
    for e in range(len(mechanism.effectors)):
        way = position_error(mechanism, goal, posture, e)
        total += goal[e, WEIGHT] * dot(way, way)
        if mechanism.effectors[e, ORIENTED]:
            w, _, _, _ = wrong_turn(mechanism, goal, posture, e)
            total += goal[e, WEIGHT] * turn_weight(mechanism) * 8.0 * (1.0 - w * w)
    return total


def residuals(mechanism, goal, posture):
    """Return the largest distance [m] and angle [rad] from effector to target, and all in one [m].

    The last is the sum of all distances, and of all angles times the lever: it shows the progress
    of one effector while another, further from its target, stays.
    """
    distance, angle, total = 0.0, 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        way = norm(position_error(mechanism, goal, posture, e))
        distance, total = max(distance, way), total + way
        if mechanism.effectors[e, ORIENTED]:
            turn = norm(logarithm(wrong_turn(mechanism, goal, posture, e)))
            angle, total = max(angle, turn), total + LEVER * mechanism.reach * turn
    return distance, angle, total


def merit_of(mechanism, goal, posture):
    """Return the root of the sum of weighted squares of distances and of lever times angles [m]."""
    total = 0.0
    for e in range(len(mechanism.effectors)):
        way, angle = position_error(mechanism, goal, posture, e), 0.0
        if mechanism.effectors[e, ORIENTED]:
            angle = norm(logarithm(wrong_turn(mechanism, goal, posture, e)))
        total += weighted_square(mechanism, goal[e, WEIGHT], norm(way), angle)
    return math.sqrt(total)


def weighted_square(mechanism, weight, distance, angle):
    """Return what one effector adds to the square of the merit [m²]."""
    lever = LEVER * mechanism.reach
    return weight * (distance * distance + lever * lever * angle * angle)


def too_far(mechanism, goal, margin):
    """Return whether a target is further than its effector can ever be, by a margin [m]."""
    return least_residual(mechanism, goal) > margin


def least_residual(mechanism, goal):
    """Return what the largest distance from effector to target is at least, in any pose [m].

    Links and the travel of slides reach no further than their sum. Distances and sums of lengths
    are known to a few roundings for each joint.
    """
    share, least = POSITION_ROUNDING * (1 + len(mechanism.joints.integers)), 0.0
    for e in range(len(mechanism.effectors)):
        start, top = load_vector(mechanism.tips, e, ARM), mechanism.effectors[e, TOP]
        if top >= 0:
            start = load_vector(mechanism.joints.numbers, top, OFFSET)
        target, reach = load_vector(goal, e, POSITION), mechanism.tips[e, REACH]
        rounding = share * (reach + norm(start) + norm(target))
        least = max(least, norm(subtract(target, start)) - reach - rounding)
    return least
