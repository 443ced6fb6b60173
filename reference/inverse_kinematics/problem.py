"""The targets of a solver and its solution."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, IndexArray
from ..articulation import Articulation
from ..model import effector_of
from ..outcome import Outcome
from ..skeleton import Skeleton


class _TargetFields(NamedTuple):
    position: ArrayLike
    rotation: ArrayLike | None = None
    effector: int | str | None = None
    weight: float = 1.0


class Target(_TargetFields):
    """The position, and perhaps the rotation, that a joint is to reach; both are copied.

    Attributes:
        position: global position [m], shape (3,), or (..., 3) for a batch.
        rotation: global rotation, shape (4,) or (..., 4); None if it is free.
        effector: the joint, by index or name; None for the default of `solve_ik`.
        weight: of its squared error, relative to other targets.
    """

    __slots__ = ()

    def __new__(
        cls,
        position: ArrayLike,
        rotation: ArrayLike | None = None,
        effector: int | str | None = None,
        weight: float = 1.0,
    ) -> "Target":
        """Copy the arrays; they are checked where the target is used."""
        x = arguments.snapshot("position", position)
        Q = arguments.snapshot("rotation", rotation)
        return super().__new__(cls, x, Q, effector, weight)


class IKSolution(NamedTuple):
    """A solver's result; a batch has leading axes everywhere.

    Attributes:
        local_rotations: the pose, shape (..., joint, 4).
        positions: all joints' global positions in that pose [m], shape (..., joint, 3).
        residual: distance from effector to target [m], by forward kinematics of the pose; the
            largest of several.
        iterations: the number of iterations made.
        outcome: how it ended; for a batch an integer array of Outcome values.
        history: residuals [m] before and after each iteration, shape (..., iterations + 1) if
            recorded, else empty. In a batch each row repeats its last residual to the longest.
        residual_rotation: angle from effector to target [rad], the largest of several; 0 where all
            rotations are free.
        coordinates: the pose in the form of the start: the coordinates of an Articulation, (...,
            coordinate), or the local rotations of a Skeleton.
        merit: the cost by which attempts are compared [m]: the root of the sum over targets of
            weight (distance² + (lever angle)²), the heaviest weight taken as 1, the angle only
            where the rotation is not free, the lever half the reach.
        excess: `residual` less a lower bound by geometry [m]: the distance beyond all links and
            slides, and on a Skeleton with a single position also inside the inner radius that
            the longest link leaves; else 0.
    """

    local_rotations: FloatArray
    positions: FloatArray
    residual: float | FloatArray
    iterations: int | IndexArray
    outcome: Outcome | IndexArray
    history: FloatArray
    residual_rotation: float | FloatArray
    coordinates: FloatArray
    merit: float | FloatArray
    excess: float | FloatArray


class CheckedTarget(NamedTuple):
    """A target, checked but for its numbers, which the kernels check."""

    joint: int  # the effector's index
    position: FloatArray  # [m], (..., 3)
    rotation: FloatArray | None  # (..., 4), or None
    weight: float  # greater than zero

    def mapped(self, change: Callable[[FloatArray], FloatArray]) -> "CheckedTarget":
        """Return the target with its position and any rotation changed."""
        Q = None if self.rotation is None else change(self.rotation)
        return self._replace(position=change(self.position), rotation=Q)


def checked_targets(
    model: Skeleton | Articulation, target: Any, effector: int | str | None
) -> list[CheckedTarget]:
    """Return the targets of all effectors, their numbers not yet checked.

    Raises:
        ValueError: if it is no position or target; if a joint does not exist, two targets are for
            the same joint, or target and argument name different joints.
    """
    if isinstance(target, Target):
        return [_checked(model, target, effector)]
    if isinstance(target, np.ndarray) or not are_targets(target):
        joint, position = effector_of(model, effector), arguments.floats("target", target, "...", 3)
        return [CheckedTarget(joint, position, None, 1.0)]
    targets = [_checked(model, element, effector) for element in target]
    joints = [checked.joint for checked in targets]
    if len(set(joints)) < len(joints):
        repeated = next(joint for joint in joints if joints.count(joint) > 1)
        raise ValueError(f"target: expected one an effector, got two for joint {repeated}")
    return targets


def are_targets(target: Any) -> TypeGuard[Sequence[Target]]:
    """Return whether an argument is a sequence that holds a Target."""
    return isinstance(target, list | tuple) and any(isinstance(x, Target) for x in target)


def _checked(
    model: Skeleton | Articulation, target: Any, effector: int | str | None
) -> CheckedTarget:
    if not isinstance(target, Target):
        raise ValueError(f"target: expected only Targets beside others, got {target!r:.80}")
    joint = effector_of(model, effector if target.effector is None else target.effector)
    if effector is not None and joint != model.index(effector, "effector"):
        raise ValueError(
            f"effector: expected that of the target, {target.effector!r}, got {effector!r}"
        )
    position = arguments.floats("target", target.position, "...", 3)
    quaternion = target.rotation
    if quaternion is not None:
        quaternion = arguments.floats("rotation", quaternion, "...", 4)
    weight = arguments.number("weight", target.weight, above=0.0)
    return CheckedTarget(joint, position, quaternion, weight)


def check_numbers(targets: list[CheckedTarget]) -> list[CheckedTarget]:
    """Return the targets with unit rotations; a ValueError if a number is not valid."""
    checked = []
    for target in targets:
        arguments.coordinates("target", target.position, "...", 3)
        if target.rotation is not None:
            target = target._replace(rotation=rotation.unit("rotation", target.rotation))
        checked.append(target)
    return checked
