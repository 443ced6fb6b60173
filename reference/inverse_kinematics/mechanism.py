"""The joints that move some effector, and the effectors' positions, for the general solvers.

Chains of unlimited balls with a single position to reach have `chain.py`. All other problems are
mechanisms: joints of all kinds with limits, several effectors, positions and rotations. Fixed
joints are merged into the joints below. `reduce.py` makes mechanisms.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import BoolArray, FloatArray, IndexArray, RecordArray
from ..articulation import FREE, JOINT, articulated_pose, ball_coordinate, clamp_ball
from ..backend.memory import packed, part
from ..quaternion import (
    add,
    conjugate,
    dot,
    load_quaternion,
    load_quaternion_from,
    load_vector,
    logarithm,
    multiply,
    norm,
    normalised,
    rotate,
    store_quaternion,
    store_quaternion_to,
    store_vector,
    subtract,
)
from .chain import POSITION_ROUNDING

# An angle between rotations counts as much as a distance of the angle times this part of the reach.
# On average the points of a mechanism are half the reach away from an axis.
LEVER = 0.5
# A record of an effector, for kernels.
EFFECTOR = np.dtype(
    [
        ("joint", np.int64),  # the joint it is attached to, -1 if none moves it
        ("first", np.int64),  # the first joint on the path to it, or -1
        ("source", np.int64),  # its index among the joints of the articulation
        ("row", np.int64),  # where its equations begin
        ("oriented", np.bool_),  # whether its rotation matters
        ("position", np.float64, 3),  # in the frame of the joint it is attached to [m]
        ("rotation", np.float64, 4),  # likewise
        ("reach", np.float64),  # how far it can be from the first joint [m]
    ],
    align=True,
)
# A record of an effector's target, for kernels.
TARGET = np.dtype(
    [("position", np.float64, 3), ("rotation", np.float64, 4), ("weight", np.float64)], align=True
)
TARGET_WIDTH = TARGET.itemsize // 8  # the numbers of a record
# A joint's backward position in FABRIK [m], and its weight, 0 if the joint has none.
BACKWARD = np.dtype([("position", np.float64, 3), ("weight", np.float64)], align=True)


class Mechanism(NamedTuple):
    """Joints, and effectors attached to them; parents precede children."""

    # the moving joints, fixed joints merged; coordinates are the mechanism's own, (joint,)
    joints: RecordArray
    columns: IndexArray  # of its coordinates among the articulation's, (coordinate,)
    effectors: RecordArray  # (effector,)
    moves: BoolArray  # whether a joint moves an effector, (joint, effector)
    # whether a joint moves a joint below, or an effector, with no moving joint between, (joint,
    # joint + effector)
    adjacent: BoolArray
    # the length of the longest path from the root to an effector, slides left out unless there is
    # nothing else [m]
    reach: float
    freedoms: int  # their number
    equations: int  # their number


class ConfigurationData(NamedTuple):
    """A mechanism's coordinates with their forward kinematics; effectors come behind the joints."""

    q: FloatArray  # (coordinate,)
    positions: FloatArray  # in the world [m], (joint + effector, 3)
    rotations: FloatArray  # in the world, (joint + effector, 4)


class Problem(NamedTuple):
    """What the kernels read of a solve."""

    joints: RecordArray  # of the articulation, JOINT, (joint,)
    width: int  # the number of its coordinates
    mechanism: Mechanism
    restarts: FloatArray  # the mechanism's coordinates in random poses, (restart, coordinate)
    # the effectors in these poses, positions [m] and rotations, (restart, effector, 7)
    effector_frames: FloatArray
    shares: FloatArray  # of the ranges of joints at further starts, (phase - 1, joint)


def packed_problem(problem: Problem) -> FloatArray:
    """Return a problem in a single block of memory, to be viewed by `problem_on`."""
    mechanism = problem.mechanism
    sizes = np.array([problem.width, mechanism.freedoms, mechanism.equations])
    return packed(
        sizes, np.array([mechanism.reach]), problem.joints, mechanism.joints, mechanism.columns,
        mechanism.effectors, mechanism.moves, mechanism.adjacent, problem.restarts,
        problem.effector_frames, problem.shares,
    )  # fmt: skip


def problem_on(memory):
    """Return the problem in a block of memory."""
    sizes, reach = part(memory, 0, np.int64), part(memory, 1, np.float64)[0]
    joints, columns = part(memory, 3, JOINT), part(memory, 4, np.int64)
    effectors, n = part(memory, 5, EFFECTOR), len(joints)
    ends = len(effectors)
    moves, adjacent = part(memory, 6, np.bool_), part(memory, 7, np.bool_)
    restarts, frames = part(memory, 8, np.float64), part(memory, 9, np.float64)
    shares = part(memory, 10, np.float64)
    count = len(frames) // (7 * ends)
    return Problem(
        part(memory, 2, JOINT), sizes[0],
        Mechanism(
            joints, columns, effectors, moves[: n * ends].reshape(n, ends),
            adjacent[: n * (n + ends)].reshape(n, n + ends), reach, sizes[1], sizes[2],
        ),
        restarts.reshape(count, len(columns)), frames.reshape(count, ends, 7),
        shares.reshape(len(shares) // max(n, 1), n),
    )  # fmt: skip


def new_data(mechanism):
    """Return the data of a configuration, to be filled."""
    count = len(mechanism.joints) + len(mechanism.effectors)
    return ConfigurationData(
        np.empty(len(mechanism.columns)), np.empty((count, 3)), np.empty((count, 4))
    )


def gather(mechanism, q, own):
    """Copy the mechanism's own coordinates out of the articulation's."""
    for k in range(len(mechanism.columns)):
        own[k] = q[mechanism.columns[k]]


def scatter(mechanism, own, q):
    """Copy the mechanism's own coordinates back among the articulation's."""
    for k in range(len(mechanism.columns)):
        q[mechanism.columns[k]] = own[k]


def update_forward_kinematics(mechanism, data):
    """Compute the poses of joints and effectors from the coordinates."""
    articulated_pose(mechanism.joints, data.q, data.positions, data.rotations)
    effectors = mechanism.effectors
    for e in range(len(effectors)):
        x, R = load_vector(effectors["position"], e), load_quaternion(effectors["rotation"], e)
        j = effectors["joint"][e]
        if j >= 0:
            R_joint = load_quaternion(data.rotations, j)
            x = add(load_vector(data.positions, j), rotate(R_joint, x))
            R = multiply(R_joint, R)
        store_effector(mechanism, data, e, x, R)


def effector_position(mechanism, data, e):
    """Return the position of an effector in the world [m]."""
    return load_vector(data.positions, len(mechanism.joints) + e)


def effector_rotation(mechanism, data, e):
    """Return the rotation of an effector in the world."""
    return load_quaternion(data.rotations, len(mechanism.joints) + e)


def store_effector(mechanism, data, e, x, R):
    """Write an effector's position and rotation in the world."""
    store_vector(data.positions, len(mechanism.joints) + e, x)
    store_quaternion(data.rotations, len(mechanism.joints) + e, R)


def position_error(mechanism, target, data, e):
    """Return the vector from an effector to its target [m]."""
    return subtract(load_vector(target["position"], e), effector_position(mechanism, data, e))


def rotation_error(mechanism, target, data, e):
    """Return the rotation in the world from an effector's rotation to its target's."""
    R = effector_rotation(mechanism, data, e)
    return multiply(load_quaternion(target["rotation"], e), conjugate(R))


def rotation_weight(mechanism):
    """Return the weight of half the squared distance of two rotation matrices, lever²/2 [m²].

    This distance is 3 - tr R for the rotation R between the two; for a small angle, its square.
    """
    lever = LEVER * mechanism.reach
    return 0.5 * lever * lever


def cost(mechanism, target, data):
    """Return the cost of CCD [m²]: the weighted sum of |error|² and of lever² (3 - tr R)."""
    total = 0.0
    for e in range(len(mechanism.effectors)):
        error = position_error(mechanism, target, data, e)
        total += target["weight"][e] * dot(error, error)
        if mechanism.effectors["oriented"][e]:
            w, _, _, _ = rotation_error(mechanism, target, data, e)
            total += target["weight"][e] * rotation_weight(mechanism) * 8.0 * (1.0 - w * w)
    return total


def errors(mechanism, target, data, e):
    """Return the distance [m] and the angle [rad] from an effector to its target."""
    distance = norm(position_error(mechanism, target, data, e))
    if not mechanism.effectors["oriented"][e]:
        return distance, 0.0
    return distance, norm(logarithm(rotation_error(mechanism, target, data, e)))


def residuals(state, target):
    """Return the largest distance [m] and angle [rad] from effector to target, their sum, a bound.

    The sum [m] is of all distances, and of all angles times the lever. It shows the progress of an
    effector while another effector, further from its target, stays. No effector is further above
    its own least distance than the bound [m] is above the largest of the least distances.
    """
    mechanism, data = state.mechanism, state.data
    largest, largest_angle, total, largest_bound, excess = 0.0, 0.0, 0.0, 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        distance, angle = errors(mechanism, target, data, e)
        largest, largest_angle = max(largest, distance), max(largest_angle, angle)
        total = total + distance + LEVER * mechanism.reach * angle
        lower_bound = least_distance(mechanism, target, e)
        largest_bound = max(largest_bound, lower_bound)
        excess = max(excess, distance - lower_bound)
    return largest, largest_angle, total, largest_bound + excess


def merit_of(state, target):
    """Return the root of the sum of weighted squares of distances and of lever times angles [m]."""
    total, lever = 0.0, LEVER * state.mechanism.reach
    for e in range(len(state.mechanism.effectors)):
        distance, angle = errors(state.mechanism, target, state.data, e)
        square = distance * distance + lever * lever * angle * angle
        total += target["weight"][e] * square
    return math.sqrt(total)


def least_residual(mechanism, target):
    """Return a lower bound of the largest distance from effector to target over all poses [m]."""
    bound = 0.0
    for e in range(len(mechanism.effectors)):
        bound = max(bound, least_distance(mechanism, target, e))
    return bound


def least_distance(mechanism, target, e):
    """Return a lower bound of the distance from an effector to its target over all poses [m].

    Links and the travel of slides reach no further than their sum. Distances and sums of lengths
    are known to a few roundings for each joint.
    """
    effectors, first = mechanism.effectors, mechanism.effectors["first"][e]
    start = load_vector(effectors["position"], e)
    if first >= 0:
        start = load_vector(mechanism.joints["offset"], first)
    position, reach = load_vector(target["position"], e), effectors["reach"][e]
    offset = subtract(position, start)
    if dot(offset, offset) <= reach * reach:
        return 0.0
    rounding = POSITION_ROUNDING * (reach + norm(start) + norm(position))
    return max(0.0, norm(offset) - reach - rounding * (1 + len(mechanism.joints)))


def move_by(joints, q, j, displacement):
    """Move a hinge or slide as far as its limits allow; return the displacement made."""
    at = joints["coordinate"][j]
    before = q[at]
    q[at] = min(max(before + displacement, joints["lower"][j]), joints["upper"][j])
    return q[at] - before


def load_ball(joints, q, j):
    """Return the quaternion of a ball or free joint."""
    return load_quaternion_from(q, ball_coordinate(joints, j))


def store_ball(joints, q, j, Q):
    """Write the quaternion of a ball or free joint."""
    store_quaternion_to(q, ball_coordinate(joints, j), Q)


def rotate_to(joints, q, j, frame, R):
    """Rotate a ball or free joint to R in the world as far as its limits allow.

    Returns the rotation reached; at the rotation `frame` the coordinates are zero.
    """
    Q = normalised(multiply(conjugate(frame), R))
    if joints["kind"][j] != FREE:
        axis, cone = load_vector(joints["axis"], j), joints["cone"][j]
        Q = clamp_ball(Q, axis, joints["lower"][j], joints["upper"][j], cone)
    store_ball(joints, q, j, Q)
    return multiply(frame, Q)


def translate_free(joints, q, j, v):
    """Translate a free joint by a vector in its own frame at zero."""
    at = joints["coordinate"][j]
    q[at], q[at + 1], q[at + 2] = q[at] + v[0], q[at + 1] + v[1], q[at + 2] + v[2]
