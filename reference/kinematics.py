"""Forward kinematics of a tree of joints, and back from global to local rotations."""

import math

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, rotation
from .arguments import FloatArray, frozen
from .articulation import Articulation
from .backend.compiled import TwoSpeeds, bind
from .backend.simd.lanes import (
    LANES,
    all_within,
    lanes_at,
    put_lanes,
    put_quaternions,
    put_vectors,
    quaternions_at,
    vectors_at,
)
from .backend.threads import in_slices
from .quaternion import (
    add,
    conjugate,
    made_unit,
    multiply,
    put_quaternion,
    put_vector,
    quaternion_at,
    rotate,
    vector_at,
)

# The same under the names of what they read back: in lanes that is read in another way.
from .quaternion import quaternion_at as rotation_at
from .quaternion import vector_at as position_at
from .skeleton import Pose, Skeleton, SkeletonArrays, checked_skeleton

# A slice of a batch with fewer joints than this is done before another thread is well under way.
THREAD_JOINTS = 100_000


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
    tree = checked_skeleton(skeleton).arrays
    count = len(tree.parents)
    local = arguments.floats("local_rotations", local_rotations, "...", count, 4)
    positions, rotations = np.empty((*local.shape[:-1], 3)), np.empty(local.shape)
    if local.ndim == 2:  # one pose, most often one of many calls, is spared all that it can be
        fine = _forward(*tree, local, positions, rotations)
    else:
        fine = _in_slices(_forward_batch, tree, local, positions, rotations)
    if not fine:  # raise, or the lengths were on the very edge of the tolerance
        return forward_kinematics(skeleton, rotation.unit("local_rotations", local))
    positions.setflags(write=False)
    rotations.setflags(write=False)
    return Pose(positions, rotations)


def local_from_global(skeleton: Skeleton, rotations: ArrayLike) -> FloatArray:
    """Return local rotations, (..., joint, 4), from global ones: Q = R_parent* R, the root's Q = R.

    Raises:
        ValueError: if the shape is another, or a quaternion is not finite or further than 1e-6
            from unit length.
    """
    tree = checked_skeleton(skeleton).arrays
    given = arguments.floats("rotations", rotations, "...", len(tree.parents), 4)
    local = np.empty(given.shape)
    if not _in_slices(_local_batch, tree, given, local):
        return local_from_global(skeleton, rotation.unit("rotations", given))
    return local


def _in_slices(kernel: TwoSpeeds, tree: SkeletonArrays, *poses: FloatArray) -> bool:
    """Run a kernel on slices of arrays (..., joint, 3 or 4); return whether all were fine."""
    flat = [values.reshape(-1, *values.shape[-2:]) for values in poses]
    least = math.ceil(THREAD_JOINTS / len(tree.parents))
    done = in_slices(
        kernel, len(flat[0]), lambda part: (*tree, *(values[part] for values in flat)), least=least
    )
    return all(done)


def forward_pose(parents, offsets, local, positions, rotations):
    """Fill positions (joint, 3) and rotations (joint, 4) of one pose from unit quaternions."""
    x, R = vector_at(offsets, 0), quaternion_at(local, 0)
    put_vector(positions, 0, x)
    put_quaternion(rotations, 0, R)
    for j in range(1, len(parents)):
        if parents[j] != j - 1:  # along a chain the parent is still at hand
            x, R = position_at(positions, parents[j]), rotation_at(rotations, parents[j])
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
    """Fill unit quaternions (joint, 4); return whether all given ones were unit within 1e-6."""
    fine = True
    for j in range(len(unit)):
        Q, near = made_unit(quaternion_at(given, j))
        put_quaternion(unit, j, Q)
        fine &= near
    return fine


# The same on LANES poses side by side: a tile of a batch, and unit quaternions in a scratch array.
forward_tile = bind(
    forward_pose,
    quaternion_at=lanes_at,
    position_at=vectors_at,
    rotation_at=quaternions_at,
    put_vector=put_vectors,
    put_quaternion=put_quaternions,
)
local_tile = bind(local_pose, quaternion_at=lanes_at, put_quaternion=put_quaternions)
normalise_tile = bind(
    normalise,
    quaternion_at=quaternions_at,
    made_unit=bind(made_unit, within=all_within),
    put_quaternion=put_lanes,
)


def _forward_one(parents, offsets, given, positions, rotations):
    local = np.empty(given.shape)
    if not normalise(given, local):
        return False
    forward_pose(parents, offsets, local, positions, rotations)
    return True


def _forward_each(parents, offsets, given, positions, rotations):
    fine = True
    for i in range(len(given)):
        fine &= _forward_one(parents, offsets, given[i], positions[i], rotations[i])
    return fine


def _forward_many(parents, offsets, given, positions, rotations):
    if len(given) < LANES:
        return _forward_each(parents, offsets, given, positions, rotations)
    local = np.empty((len(parents), 4, LANES))
    for i in range(0, len(given), LANES):
        first = min(i, len(given) - LANES)  # the last tile overlaps the one before
        end = first + LANES
        if not normalise_tile(given[first:end], local):
            return False
        forward_tile(parents, offsets, local, positions[first:end], rotations[first:end])
    return True


def _local_each(parents, given, local):
    rotations = np.empty(given.shape[1:])
    for i in range(len(given)):
        if not normalise(given[i], rotations):
            return False
        local_pose(parents, rotations, local[i])
    return True


def _local_many(parents, offsets, given, local):
    if len(given) < LANES:
        return _local_each(parents, given, local)
    rotations = np.empty((len(parents), 4, LANES))
    for i in range(0, len(given), LANES):
        first = min(i, len(given) - LANES)
        if not normalise_tile(given[first : first + LANES], rotations):
            return False
        local_tile(parents, rotations, local[first : first + LANES])
    return True


_forward = TwoSpeeds(_forward_one, label="forward_kinematics")
_forward_batch = TwoSpeeds(_forward_many, label="forward_kinematics of a batch")
_local_batch = TwoSpeeds(_local_many, label="local_from_global")
