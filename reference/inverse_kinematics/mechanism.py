"""The joints that move some effector, and where they put it: what the general solvers work on.

Chains of unlimited balls with one position to reach have `chain.py` to themselves. Everything else
is a mechanism: joints of all kinds with limits, several effectors, positions and rotations. Fixed
joints are merged into the ones below them. See `preparation.py` for how one is made.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import FloatArray, IndexArray
from ..articulation import AXIS, FRAME, OFFSET, PARENT, JointArrays, articulated_pose
from ..quaternion import (
    add,
    conjugate,
    dot,
    logarithm,
    multiply,
    norm,
    put_quaternion,
    put_vector,
    quaternion_at,
    rotate,
    subtract,
    vector_at,
)

# A wrong rotation counts as much as a wrong position of its angle times this part of the reach.
LEVER = 0.5
# Columns of Mechanism.effectors: the joint an effector hangs on, -1 if none moves it; where its
# equations begin; 1 where its rotation matters, else 0; the first joint on the way to it, or -1.
HANGS, ROW, ORIENTED, TOP = range(4)
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
        effectors: (effector, 4), see above.
        tips: (effector, 8), see above.
        moves: 1 where a joint moves an effector, 2 where no joint does between, else 0, (joint,
            effector).
        sees: 1 where a turn of the first joint moves the second and no joint between, else 0; on
            the diagonal 1 where others follow a joint, (joint, joint).
        scales: what a unit of each freedom is worth: 1 for turns, the reach for ways, (freedom,).
        reach: the longest way from root to effector, slides left out [m].
        equations: how many in all.
    """

    joints: JointArrays
    effectors: IndexArray
    tips: FloatArray
    moves: IndexArray
    sees: IndexArray
    scales: FloatArray
    reach: float
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


def new_posture(mechanism, coordinates):
    """Return a posture with room for so many coordinates."""
    count = len(mechanism.joints.integers) + len(mechanism.effectors)
    return Posture(np.empty(coordinates), np.empty((count, 3)), np.empty((count, 4)))


def place(mechanism, posture):
    """Compute where the coordinates put the joints and the effectors."""
    articulated_pose(mechanism.joints, posture.q, posture.positions, posture.rotations)
    for e in range(len(mechanism.effectors)):
        x, R = vector_at(mechanism.tips, e, ARM), quaternion_at(mechanism.tips, e, TURN)
        j = mechanism.effectors[e, HANGS]
        if j >= 0:
            R_joint = quaternion_at(posture.rotations, j)
            x = add(vector_at(posture.positions, j), rotate(R_joint, x))
            R = multiply(R_joint, R)
        put_tip(mechanism, posture, e, x, R)


def tip(mechanism, posture, e):
    """Return the position of an effector."""
    return vector_at(posture.positions, len(mechanism.joints.integers) + e)


def tip_rotation(mechanism, posture, e):
    """Return the rotation of an effector."""
    return quaternion_at(posture.rotations, len(mechanism.joints.integers) + e)


def put_tip(mechanism, posture, e, x, R):
    """Write an effector's position and rotation."""
    put_vector(posture.positions, len(mechanism.joints.integers) + e, x)
    put_quaternion(posture.rotations, len(mechanism.joints.integers) + e, R)


def axis_of(joints, j, R):
    """Return a joint's axis in the world, R its rotation there."""
    return rotate(R, vector_at(joints.numbers, j, AXIS))


def frame_of(joints, j, posture):
    """Return the rotation of a joint's unmoved frame in the world."""
    frame = quaternion_at(joints.numbers, j, FRAME)
    if joints.integers[j, PARENT] < 0:
        return frame
    return multiply(quaternion_at(posture.rotations, joints.integers[j, PARENT]), frame)


def position_error(mechanism, goal, posture, e):
    """Return the way from an effector to its target [m]."""
    return subtract(vector_at(goal, e, POSITION), tip(mechanism, posture, e))


def wrong_turn(mechanism, goal, posture, e):
    """Return the rotation in the world that turns an effector into its target."""
    R = tip_rotation(mechanism, posture, e)
    return multiply(quaternion_at(goal, e, ROTATION), conjugate(R))


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
    """Return the largest distance [m] and the largest angle [rad] from effector to target."""
    distance, angle = 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        distance = max(distance, norm(position_error(mechanism, goal, posture, e)))
        if mechanism.effectors[e, ORIENTED]:
            angle = max(angle, norm(logarithm(wrong_turn(mechanism, goal, posture, e))))
    return distance, angle


def too_far(mechanism, goal, margin):
    """Return whether a target is further than its effector can ever be, by a margin [m]."""
    for e in range(len(mechanism.effectors)):
        start, top = vector_at(mechanism.tips, e, ARM), mechanism.effectors[e, TOP]
        if top >= 0:
            start = vector_at(mechanism.joints.numbers, top, OFFSET)
        way = norm(subtract(vector_at(goal, e, POSITION), start))
        if way > mechanism.tips[e, REACH] + margin:
            return True
    return False
