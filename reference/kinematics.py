"""Forward kinematics of a tree of joints, and back from global to local rotations."""

import functools
import math
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from . import arguments, rotation
from .arguments import FLOAT64, FloatArray, frozen, is_plain
from .articulation import POSED, Articulation, forward_posed
from .backend.compiled import Kernel
from .backend.simd.vectors import (
    LANES,
    in_lanes,
    load_position,
    load_rotation,
    load_unit,
    store_position,
    store_rotation,
    store_unit,
)
from .backend.threads import ArraysOfThread, in_slices
from .model import Model, checked_model, coordinates_name
from .quaternion import add, conjugate, load_vector, made_unit, multiply, rotate
from .skeleton import POSE_FIELDS, Pose, PoseArrays, Skeleton, checked_skeleton, pose_arrays

# A joint of a skeleton with its unit local rotation and its pose, for kernels.
TREE_FIELDS = [("parent", np.int64), ("offset", np.float64, 3)]
LINK = np.dtype([*TREE_FIELDS, ("unit", np.float64, 4), *POSE_FIELDS])
# All C-contiguous float64 arrays of two axes convert to its type. No pose has its shape.
EXAMPLE = frozen(np.zeros((2, 2)))
# A slice of a batch with fewer joints than this takes less time than another thread to begin.
THREAD_JOINTS = 100_000


def forward_kinematics(
    skeleton: Model, local_rotations: ArrayLike, *, out: PoseArrays = None
) -> Pose:
    """Return the global pose of every joint, read-only: (..., joint, 3) [m] and (..., joint, 4).

    A joint with parent p has the rotation R = R_p Q and the position x = x_p + R_p offset. The
    offset is rotated by the *parent's* global rotation; a joint's own rotation moves only its
    descendants.

    Args:
        skeleton: the tree, an Articulation, or a Robot read from a file.
        local_rotations: unit quaternions relative to the parent, w first, shape (..., joint, 4);
            leading axes are batch or frame. For an Articulation, its coordinates (...,
            coordinate).
        out: a Pose, or a pair of C-contiguous float64 arrays, to be filled and returned, writable;
            may overlap `local_rotations`. Large batches take less time than in new memory.

    Raises:
        ValueError: if a shape is another, `out` cannot be filled, or a quaternion is not finite or
            further than 1e-6 from unit length. The contents of `out` are then not defined.
    """
    if isinstance(skeleton, Skeleton):
        positions, rotations = _skeleton_pose(skeleton, local_rotations, out)
    else:
        model: Any = skeleton if isinstance(skeleton, Articulation) else checked_model(skeleton)
        positions, rotations = model.forward(local_rotations, out)
    if out is None:
        positions.setflags(False)  # by its name it takes twice as long
        rotations.setflags(False)
    return tuple.__new__(Pose, (positions, rotations))  # in half the time of the constructor


def _skeleton_pose(skeleton: Skeleton, local: Any, out: PoseArrays) -> tuple[Any, Any]:
    tree = skeleton.arrays
    count = len(tree.parents)
    if out is None and is_plain(local, (count, 4)):  # often one of many short calls
        positions, rotations = np.empty((count, 3)), np.empty((count, 4))
        valid = _forward(*tree, local, positions, rotations)
    else:
        local = arguments.floats("local_rotations", local, "...", count, 4)
        local, positions, rotations = pose_arrays(out, local, *local.shape[:-1])
        valid = _in_slices(_forward_batch, tree, local, positions, rotations)
    if valid:
        return positions, rotations
    # raise, or the lengths were within rounding of the tolerance
    return _skeleton_pose(skeleton, rotation.unit("local_rotations", local), out)


class PreparedKinematics(ArraysOfThread):
    """Forward kinematics of a model, a pose a call, into the same arrays every time.

    A call takes a quarter of the time of `forward_kinematics` (ten balls): it allocates nothing,
    and its kernel takes model and results as a single array and checks the shape. Each thread that
    shares the object has arrays of its own.

    Attributes:
        pose: the pose of the last call, NaN before the first: positions (joint, 3) [m] and
            rotations (joint, 4), read-only views of the array that the next call fills.
    """

    def __init__(self, model: Skeleton | Articulation):
        """Allocate the arrays of a thread; `prepare` checks the argument."""
        self._shape: tuple[int, ...]
        if isinstance(model, Skeleton):
            joints, self._shape = np.zeros(model.joint_count, LINK), (model.joint_count, 4)
            joints["parent"], joints["offset"] = model.arrays
            forward = _forward_links.specialise(joints.view(FLOAT64), EXAMPLE)
        else:
            joints, self._shape = np.zeros(model.joint_count, POSED), (model.coordinate_count,)
            joints["joint"], unit = model.joints, np.empty(self._shape)
            kernel = forward_posed.specialise(unit, joints.view(FLOAT64), EXAMPLE[0])
            forward = functools.partial(kernel, unit)
        joints["position"] = joints["rotation"] = np.nan
        self.pose = Pose(frozen(joints["position"]), frozen(joints["rotation"]))
        self._problem, self._joints = (model,), joints
        # one attribute, as a thread's attribute takes 0.05 µs
        self._work = forward, joints.view(FLOAT64), self.pose

    def __call__(self, local_rotations: ArrayLike) -> Pose:
        """Return the pose of local rotations, (joint, 4); the next call overwrites the pose.

        For an Articulation, of its coordinates, (coordinate,).

        Raises:
            ValueError: if the shape is another, or a quaternion is not finite or further than 1e-6
                from unit length. The pose is then not defined.
        """
        if type(local_rotations) is ndarray:
            forward, table, pose = self._work
            try:
                if forward(table, local_rotations):
                    return pose
            except Exception:  # for other types, and so slow that later calls look first
                self._work = functools.partial(_if_plain, forward, self._shape), table, pose
        (model,) = self._problem
        local = arguments.floats(coordinates_name(model), local_rotations, *self._shape)
        self._joints["position"], self._joints["rotation"] = forward_kinematics(model, local)
        return self.pose


def _if_plain(kernel: Any, shape: tuple[int, ...], table: FloatArray, q: Any) -> bool:
    return is_plain(q, shape) and kernel(table, q)


def prepare(skeleton: Model) -> PreparedKinematics:
    """Return forward kinematics for many single poses of a model: `prepare(skeleton)(local)`.

    The result runs on the backend now in force.

    Raises:
        ValueError: if the model is no Skeleton, Articulation or Robot.
    """
    return PreparedKinematics(checked_model(skeleton))


def local_from_global(
    skeleton: Skeleton, rotations: ArrayLike, *, out: FloatArray | None = None
) -> FloatArray:
    """Return local rotations, (..., joint, 4), of global rotations: Q = R_parent* R.

    The root's are R. An array `out` is filled and returned. Errors are as for
    `forward_kinematics`.
    """
    tree = checked_skeleton(skeleton).arrays
    poses = arguments.floats("rotations", rotations, "...", len(tree.parents), 4)
    local = arguments.output("out", out, poses.shape)
    if np.may_share_memory(local, poses):
        poses = poses.copy()
    if not _in_slices(_local_batch, tree, poses, local):
        return local_from_global(skeleton, rotation.unit("rotations", poses), out=out)
    return local


def _in_slices(kernel: Kernel, tree: tuple[Any, Any], *poses: FloatArray) -> bool:
    """Run a kernel on slices of arrays (..., joint, 3 or 4); return whether all were valid."""
    flat = [values.reshape(-1, *values.shape[-2:]) for values in poses]
    length = math.ceil(THREAD_JOINTS / len(tree[0]))
    part_of = lambda part: (*tree, *(values[part] for values in flat))  # noqa: E731
    return all(in_slices(kernel, len(flat[0]), part_of, minimum=length))


def forward_pose(parents, offsets, local, positions, rotations):
    """Fill positions (joint, 3) and rotations (joint, 4) of a pose from unit quaternions."""
    x, R = load_vector(offsets, 0), load_unit(local, 0)
    store_position(positions, 0, x)
    store_rotation(rotations, 0, R)
    for j in range(1, len(parents)):
        if parents[j] != j - 1:  # along a chain x and R are the parent's already
            x, R = load_position(positions, parents[j]), load_rotation(rotations, parents[j])
        x = add(x, rotate(R, load_vector(offsets, j)))
        R = multiply(R, load_unit(local, j))
        store_position(positions, j, x)
        store_rotation(rotations, j, R)


def local_pose(parents, rotations, local):
    """Fill local rotations (joint, 4) of a pose from global unit quaternions, in place too."""
    for j in range(len(parents) - 1, 0, -1):
        R_parent = load_unit(rotations, parents[j])
        store_rotation(local, j, multiply(conjugate(R_parent), load_unit(rotations, j)))
    store_rotation(local, 0, load_unit(rotations, 0))


def normalise(rotations, unit):
    """Fill unit quaternions (joint, 4); return whether all rotations were unit within 1e-6."""
    valid = True
    for j in range(len(unit)):
        Q, near = made_unit(load_rotation(rotations, j))
        store_unit(unit, j, Q)
        valid &= near
    return valid


forward_tile, local_tile = in_lanes(forward_pose), in_lanes(local_pose)
normalise_tile = in_lanes(normalise)


def _forward_one(parents, offsets, pose, positions, rotations):
    if not normalise(pose, rotations):  # where unit local rotations are until their joints' turns
        return False
    forward_pose(parents, offsets, rotations, positions, rotations)
    return True


def _forward_of_links(table, local):
    links = table.view(LINK)
    fits = local.dtype == table.dtype and local.shape == (len(links), 4)
    if not fits or not normalise(local, links["unit"]):  # `local` may be a view of the last pose
        return False
    tree, pose = (links["parent"], links["offset"]), (links["position"], links["rotation"])
    forward_pose(*tree, links["unit"], *pose)
    return True


def _forward_many(parents, offsets, poses, positions, rotations):
    if len(poses) < LANES:
        valid = True
        for i in range(len(poses)):
            valid &= _forward_one(parents, offsets, poses[i], positions[i], rotations[i])
        return valid
    local = np.empty((len(parents), 4, LANES))
    for i in range(0, len(poses), LANES):
        first = min(i, len(poses) - LANES)  # the last tile overlaps the one before
        end = first + LANES
        if not normalise_tile(poses[first:end], local):
            return False
        forward_tile(parents, offsets, local, positions[first:end], rotations[first:end])
    return True


def _local_many(parents, offsets, poses, local):
    if len(poses) < LANES:
        valid = True
        for i in range(len(poses)):
            valid &= normalise(poses[i], local[i])
            local_pose(parents, local[i], local[i])
        return valid
    rotations = np.empty((len(parents), 4, LANES))
    for i in range(0, len(poses), LANES):
        first = min(i, len(poses) - LANES)
        if not normalise_tile(poses[first : first + LANES], rotations):
            return False
        local_tile(parents, rotations, local[first : first + LANES])
    return True


_forward = Kernel(_forward_one, label="forward_kinematics", nogil=False)
_forward_links = Kernel(_forward_of_links, label="prepared forward_kinematics", nogil=False)
_forward_batch = Kernel(_forward_many, label="forward_kinematics of a batch")
_local_batch = Kernel(_local_many, label="local_from_global")
