"""Forward kinematics of a tree of joints, and back from global to local rotations."""

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, rotation
from .arguments import FloatArray, frozen
from .articulation import Articulation
from .compiled import TwoSpeeds
from .quaternion import (
    add,
    conjugate,
    multiply,
    put_quaternion,
    put_vector,
    quaternion_at,
    rotate,
    vector_at,
)
from .rotation import UNIT_TOLERANCE
from .skeleton import Pose, Skeleton, checked_skeleton


def forward_kinematics(skeleton: Skeleton | Articulation, local_rotations: ArrayLike) -> Pose:
    """Return the global pose of every joint.

    A joint with parent p has the rotation R = R_p Q and the position x = x_p + R_p offset. The
    offset is turned by the *parent's* global rotation; a joint's own rotation moves only what
    hangs below it.

    Args:
        skeleton: the tree.
        local_rotations: unit quaternions relative to the parent, w first, shape (..., joint, 4);
            leading axes are batch or frame. For an Articulation, its coordinates (...,
            coordinate).

    Returns:
        Pose with positions (..., joint, 3) [m] and rotations (..., joint, 4), read-only.

    Raises:
        ValueError: if the shape is another, or a quaternion is not finite or further than 1e-6
            from unit length.
    """
    if isinstance(skeleton, Articulation):
        x, R = skeleton.forward(local_rotations)
        return Pose(frozen(x), frozen(R))
    count = checked_skeleton(skeleton).joint_count
    local = arguments.floats("local_rotations", local_rotations, "...", count, 4)
    positions = np.empty((*local.shape[:-1], 3))
    rotations = np.empty(local.shape)
    fine = _forward(
        *skeleton.arrays,
        local.reshape(-1, count, 4),
        positions.reshape(-1, count, 3),
        rotations.reshape(-1, count, 4),
    )
    if not fine:  # raise, or the lengths were on the very edge of the tolerance
        return forward_kinematics(skeleton, rotation.unit("local_rotations", local))
    return Pose(frozen(positions), frozen(rotations))


def local_from_global(skeleton: Skeleton, rotations: ArrayLike) -> FloatArray:
    """Return local rotations, (..., joint, 4), from global ones: Q = R_parent* R, the root's Q = R.

    Raises:
        ValueError: if the shape is another, or a quaternion is not finite or further than 1e-6
            from unit length.
    """
    count = checked_skeleton(skeleton).joint_count
    given = arguments.floats("rotations", rotations, "...", count, 4)
    local = np.empty(given.shape)
    fine = _local(skeleton.arrays.parents, given.reshape(-1, count, 4), local.reshape(-1, count, 4))
    if not fine:
        return local_from_global(skeleton, rotation.unit("rotations", given))
    return local


def forward_pose(parents, offsets, local, positions, rotations):
    """Fill positions (joint, 3) and rotations (joint, 4) of one pose from unit quaternions."""
    x, R = vector_at(offsets, 0), quaternion_at(local, 0)
    put_vector(positions, 0, x)
    put_quaternion(rotations, 0, R)
    for j in range(1, len(parents)):
        if parents[j] != j - 1:  # along a chain the parent is still at hand
            x, R = vector_at(positions, parents[j]), quaternion_at(rotations, parents[j])
        x = add(x, rotate(R, vector_at(offsets, j)))
        R = multiply(R, quaternion_at(local, j))
        put_vector(positions, j, x)
        put_quaternion(rotations, j, R)


def local_pose(parents, rotations, local):
    """Fill local rotations (joint, 4) of one pose from global ones."""
    put_quaternion(local, 0, quaternion_at(rotations, 0))
    for j in range(1, len(parents)):
        R_parent = quaternion_at(rotations, parents[j])
        put_quaternion(local, j, multiply(conjugate(R_parent), quaternion_at(rotations, j)))


def normalise(given, unit):
    """Fill unit quaternions (joint, 4); return whether all given ones were unit within 1e-6.

    1/|q| is the series of (1 + e)^-1/2 in e = |q|^2 - 1, which for so small an e is exact to
    rounding with four terms, and needs neither a root nor a division.
    """
    fine = True
    for j in range(len(given)):
        w, x, y, z = quaternion_at(given, j)
        e = w * w + x * x + y * y + z * z - 1.0
        s = 1.0 - e * (0.5 - e * (0.375 - e * 0.3125))
        put_quaternion(unit, j, (s * w, s * x, s * y, s * z))
        fine &= abs(e) <= 2.0 * UNIT_TOLERANCE
    return fine


def _forward_batch(parents, offsets, given, positions, rotations):
    local = np.empty(given.shape[1:])
    for i in range(len(given)):
        if not normalise(given[i], local):
            return False
        forward_pose(parents, offsets, local, positions[i], rotations[i])
    return True


def _local_batch(parents, given, local):
    rotations = np.empty(given.shape[1:])
    for i in range(len(given)):
        if not normalise(given[i], rotations):
            return False
        local_pose(parents, rotations, local[i])
    return True


_forward = TwoSpeeds(_forward_batch)
_local = TwoSpeeds(_local_batch)
