"""Skeleton (the model) and Pose (its state)."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from . import arguments
from .arguments import FloatArray, IndexArray, KeepsReadOnly, frozen, shown


class SkeletonArrays(NamedTuple):
    """The arrays of a skeleton for kernels."""

    parents: IndexArray
    offsets: FloatArray


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Skeleton(KeepsReadOnly):
    """A tree of ball joints without limits; parents precede children.

    Methods raise a ValueError for an unknown joint.

    Attributes:
        parents: each joint's parent, shape (joint,); -1 for the root, which is joint 0.
        offsets: each joint's position in its parent's frame [m], shape (joint, 3); the root's
            is its global position.
        names: each joint's name.
        arrays: for kernels, not to be written to.
    """

    parents: IndexArray
    offsets: FloatArray
    names: tuple[str, ...]
    arrays: SkeletonArrays
    _paths: dict[int, IndexArray]

    def __init__(
        self, parents: ArrayLike, offsets: ArrayLike, names: Sequence[str] | None = None
    ) -> None:
        """Check and copy the tree.

        Raises:
            ValueError: if there is not exactly a single root, a parent does not precede its child,
                an offset is not finite, or a name is missing, empty or used twice.
        """
        arrays = SkeletonArrays(*_checked_tree(parents, offsets))
        self.__dict__.update(
            arrays=arrays,
            parents=frozen(arrays.parents),
            offsets=frozen(arrays.offsets),
            names=_checked_names(names, len(arrays.parents)),
            _paths={},
        )

    @functools.cached_property
    def joint_count(self) -> int:
        """Number of joints, the root included."""
        return len(self.arrays.parents)

    @functools.cached_property
    def tips(self) -> list[int]:
        """The joints without children."""
        return sorted({*range(self.joint_count)}.difference(self.parents.tolist()))

    @property
    def link_lengths(self) -> FloatArray:
        """Distance of each joint from its parent [m], shape (joint,); zero for the root."""
        lengths = np.linalg.norm(self.offsets, axis=-1)
        lengths[0] = 0.0
        return lengths

    def index(self, joint: int | str, argument: str = "joint") -> int:
        """Return the index of a joint given by name or index; negative indices count from the end.

        Raises:
            ValueError: naming `argument`, if the joint does not exist.
        """
        count = self.joint_count
        if type(joint) is int and -count <= joint < count:
            return joint % count
        argument = arguments.text("argument", argument) or "joint"
        if isinstance(joint, str):
            return self._numbers[arguments.choice(argument, joint, self._numbers)]
        return arguments.integer(argument, joint, minimum=-count, below=count) % count

    @functools.cached_property
    def _numbers(self) -> dict[str, int]:
        return {name: joint for joint, name in enumerate(self.names)}

    def path(self, effector: int | str = -1) -> IndexArray:
        """Return the joints from the root to the effector, both included, shape (path,)."""
        return frozen(self.path_array(self.index(effector, "effector")))

    def path_array(self, joint: int) -> IndexArray:
        """Return the path to a joint given by index, for kernels: not to be written to."""
        if joint not in self._paths:
            path = [joint]
            while self.parents[path[-1]] >= 0:
                path.append(int(self.parents[path[-1]]))
            self._paths[joint] = np.array(path[::-1], dtype=np.int64)
        return self._paths[joint]

    def reach(self, effector: int | str = -1) -> float:
        """Return the greatest distance of the effector from the root [m]: its links' length."""
        return float(self.link_lengths[self.path(effector)].sum())

    def __repr__(self) -> str:
        return f"Skeleton({self.joint_count} joints, reach {self.reach():g} m)"


def checked_skeleton(skeleton: Skeleton) -> Skeleton:
    """Return the argument `skeleton` if it is a Skeleton."""
    if type(skeleton) is Skeleton:
        return skeleton
    return arguments.instance("skeleton", skeleton, Skeleton)


class Pose(NamedTuple):
    """Positions and rotations of all joints; leading axes are batch or frame.

    Attributes:
        positions: global positions [m], shape (..., joint, 3).
        rotations: global unit quaternions, w first, shape (..., joint, 4).
    """

    positions: FloatArray
    rotations: FloatArray


PoseArrays: TypeAlias = tuple[FloatArray | None, FloatArray | None] | None
# A pose in the records of joints, for kernels.
POSE_FIELDS = [("position", np.float64, 3), ("rotation", np.float64, 4)]


def pose_arrays(
    out: PoseArrays, q: FloatArray, *shape: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return q and arrays for positions, (*shape, 3), and rotations, (*shape, 4).

    They are those of `out`, new ones for None; q in their memory is copied.
    """
    if out is None:
        return q, np.empty((*shape, 3)), np.empty((*shape, 4))
    if not isinstance(out, tuple | list) or len(out) != 2:
        raise ValueError(f"out: expected a Pose or a pair of arrays, got {shown(out)}")
    positions = arguments.output("out.positions", out[0], (*shape, 3))
    rotations = arguments.output("out.rotations", out[1], (*shape, 4))
    if np.may_share_memory(positions, rotations):
        raise ValueError("out: expected two arrays, got arrays that share memory")
    if np.may_share_memory(q, positions) or np.may_share_memory(q, rotations):
        q = q.copy()
    return q, positions, rotations


def _checked_tree(parents: ArrayLike, offsets: ArrayLike) -> tuple[IndexArray, FloatArray]:
    offsets = np.array(arguments.coordinates("offsets", offsets, "joint", 3))
    count = len(offsets)
    if count == 0:
        raise ValueError("offsets: expected at least one joint, got none")
    links = np.linalg.norm(offsets, axis=-1)
    links[0] = 0.0
    arguments.sizes("offsets", links, "joint")
    parents = arguments.indices("parents", parents, count, minimum=-1, below=count)
    roots = np.flatnonzero(parents == -1)
    if len(roots) != 1:
        raise ValueError(f"parents: expected one root (parent -1), got {len(roots)}")
    late = np.flatnonzero(parents >= np.arange(count))
    if len(late):
        raise ValueError(
            f"parents: expected every parent before its child, "
            f"got parent {parents[late[0]]} for joint {late[0]}"
        )
    return parents, offsets


def _checked_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"joint{number}" for number in range(count))
    names = arguments.sequence("names", names, count, "a joint")
    for name in names:
        if not arguments.text("names", name):
            raise ValueError(f"names: expected {count} non-empty strings, got {shown(names)}")
    if len(set(names)) != count:
        repeated = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"names: expected distinct names, got {repeated!r} more than once")
    return names
