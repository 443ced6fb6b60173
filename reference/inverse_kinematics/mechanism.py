"""The joints that move some effector, and where they put it: what the general solvers work on.

Chains of unlimited balls with one position to reach have `chain.py` to themselves. Everything else
is a mechanism: joints of all kinds with limits, several effectors, positions and rotations. Fixed
joints are merged into the ones below them. See `reduce.py` for how one is made.
"""

import math
from typing import NamedTuple

import numpy as np

from ..arguments import BoolArray, FloatArray, IndexArray, RecordArray
from ..articulation import WIDTHS, articulated_pose
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

# An angle between rotations counts as much as a distance of the angle times this part of the reach.
LEVER = 0.5
# What the kernels read of each effector, a record an effector.
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
# What the kernels read of the target of an effector.
TARGET = np.dtype(
    [("position", np.float64, 3), ("rotation", np.float64, 4), ("weight", np.float64)], align=True
)


class Mechanism(NamedTuple):
    """Joints, and effectors attached to them; parents precede children."""

    # those that move, fixed ones merged; coordinates are the mechanism's own, (joint,)
    joints: RecordArray
    sources: IndexArray  # where a joint's coordinates begin among the articulation's, (joint,)
    effectors: RecordArray  # (effector,)
    moves: BoolArray  # whether a joint moves an effector, (joint, effector)
    # whether a joint moves a joint below it, or an effector, and no joint between them does,
    # (joint, joint + effector)
    adjacent: BoolArray
    # the length of the longest path from the root to an effector, slides left out unless there is
    # nothing else [m]
    reach: float
    coordinates: int  # how many
    freedoms: int  # how many
    equations: int  # how many in all


class ConfigurationData(NamedTuple):
    """A mechanism's coordinates with their forward kinematics; effectors come behind the joints."""

    state: FloatArray  # what an attempt continues from, `q` and then `far_step`, (coordinate + 2,)
    q: FloatArray  # (coordinate,)
    far_step: FloatArray  # see `box_step.far_damping`, (2,); zero before the first step
    positions: FloatArray  # in the world [m], (joint + effector, 3)
    rotations: FloatArray  # in the world, (joint + effector, 4)


def new_data(mechanism):
    """Return the data of a configuration, to be filled."""
    count, n = len(mechanism.joints) + len(mechanism.effectors), mechanism.coordinates
    state = np.zeros(n + 2)
    return ConfigurationData(
        state, state[:n], state[n:], np.empty((count, 3)), np.empty((count, 4))
    )


def gather(mechanism, q, own):
    """Copy the mechanism's own coordinates out of the articulation's."""
    at = 0
    for j in range(len(mechanism.sources)):
        for k in range(width(mechanism.joints, j)):
            own[at] = q[mechanism.sources[j] + k]
            at += 1


def scatter(mechanism, own, q):
    """Copy the mechanism's own coordinates back among the articulation's."""
    at = 0
    for j in range(len(mechanism.sources)):
        for k in range(width(mechanism.joints, j)):
            q[mechanism.sources[j] + k] = own[at]
            at += 1


def width(joints, j):
    """Return how many coordinates a joint has of its own."""
    return WIDTHS[joints["kind"][j]] if joints["leader"][j] == j else 0


def update_forward_kinematics(mechanism, data):
    """Compute where the coordinates put the joints and the effectors."""
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
    """Return the rotation in the world that takes an effector's rotation to its target's."""
    R = effector_rotation(mechanism, data, e)
    return multiply(load_quaternion(target["rotation"], e), conjugate(R))


def rotation_weight(mechanism):
    """Return the weight of half the squared distance of two rotation matrices, lever²/2 [m²].

    That is 3 - tr R for the rotation R between them, the square of the angle where it is small.
    """
    lever = LEVER * mechanism.reach
    return 0.5 * lever * lever


def cost(mechanism, target, data):
    """Return what CCD lowers [m²]: the weighted sum of |error|² and of lever² (3 - tr R)."""
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


def residuals(mechanism, target, data):
    """Return the largest distance [m] and angle [rad] from effector to target, their sum, a bound.

    The sum [m] is of all distances, and of all angles times the lever: it shows the progress of one
    effector while another, further from its target, stays. No effector is further above its own
    least distance than the bound [m] is above the largest of those.
    """
    largest, largest_angle, total, least, excess = 0.0, 0.0, 0.0, 0.0, 0.0
    for e in range(len(mechanism.effectors)):
        distance, angle = errors(mechanism, target, data, e)
        largest, largest_angle = max(largest, distance), max(largest_angle, angle)
        total = total + distance + LEVER * mechanism.reach * angle
        lower_bound = least_distance(mechanism, target, e)
        least, excess = max(least, lower_bound), max(excess, distance - lower_bound)
    return largest, largest_angle, total, least + excess


def merit_of(mechanism, target, data):
    """Return the root of the sum of weighted squares of distances and of lever times angles [m]."""
    total = 0.0
    for e in range(len(mechanism.effectors)):
        apart, off = errors(mechanism, target, data, e)
        total += weighted_square(mechanism, target["weight"][e], apart, off)
    return math.sqrt(total)


def weighted_square(mechanism, weight, distance, angle):
    """Return what one effector adds to the square of the merit [m²]."""
    lever = LEVER * mechanism.reach
    return weight * (distance * distance + lever * lever * angle * angle)


def least_residual(mechanism, target):
    """Return a lower bound of the largest distance from effector to target over all poses [m]."""
    least = 0.0
    for e in range(len(mechanism.effectors)):
        least = max(least, least_distance(mechanism, target, e))
    return least


def least_distance(mechanism, target, e):
    """Return a lower bound of the distance from one effector to its target over all poses [m].

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
