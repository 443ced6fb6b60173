"""What is asked of a solver, and what it answers."""

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
    """Where a joint is wanted; position and rotation are copied.

    Attributes:
        position: global position [m], shape (3,), or (..., 3) for a batch.
        rotation: global rotation, shape (4,) or (..., 4); None if any will do.
        effector: the joint, by index or name; None for the default of `solve_ik`.
        weight: how much its squared error counts beside those of other targets.
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
    """A solver's answer; a batch has leading axes everywhere.

    Attributes:
        local_rotations: the pose found, shape (..., joint, 4).
        positions: all joints' global positions in that pose [m], shape (..., joint, 3).
        residual: distance from effector to target [m], by forward kinematics of the pose; the
            largest of several.
        iterations: how many were made.
        outcome: how it ended; for a batch an integer array of Outcome values.
        history: residuals [m] before and after each iteration, shape (..., iterations + 1) if
            recorded, else empty. In a batch each row repeats its last residual to the longest.
        residual_rotation: angle from effector to target [rad], the largest of several; 0 where no
            rotation is asked for.
        coordinates: the pose found as what was given for a start: the coordinates of an
            Articulation, (..., coordinate), or the local rotations of a Skeleton.
        merit: what says which of several attempts is best [m], the root of the sum over targets of
            weight (distance² + (lever angle)²), the heaviest weight taken as 1, the angle only
            where a rotation is asked for, the lever half the reach.
        excess: how far `residual` is above the least that geometry proves possible [m]: the
            distance beyond all links and slides, and on a Skeleton with one position also that to
            the inner radius which the longest link leaves; above 0 where nothing is proven.
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
        """Return the target with its position and its rotation, if it has one, changed."""
        Q = None if self.rotation is None else change(self.rotation)
        return self._replace(position=change(self.position), rotation=Q)


def checked_targets(
    model: Skeleton | Articulation, target: Any, effector: int | str | None
) -> list[CheckedTarget]:
    """Return the targets of all effectors, their numbers not yet checked.

    Raises:
        ValueError: if it is no position or target; if there is no such joint, two targets are for
            the same one, or target and argument name different ones.
    """
    if isinstance(target, Target):
        return [_checked(model, target, effector)]
    if isinstance(target, np.ndarray) or not are_targets(target):
        joint, position = effector_of(model, effector), arguments.floats("target", target, "...", 3)
        return [CheckedTarget(joint, position, None, 1.0)]
    targets = [_checked(model, one, effector) for one in target]
    joints = [one.joint for one in targets]
    if len(set(joints)) < len(joints):
        twice = next(joint for joint in joints if joints.count(joint) > 1)
        raise ValueError(f"target: expected one an effector, got two for joint {twice}")
    return targets


def are_targets(target: Any) -> TypeGuard[Sequence[Target]]:
    """Return whether it is a sequence that holds a Target."""
    return isinstance(target, list | tuple) and any(isinstance(one, Target) for one in target)


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
    for one in targets:
        arguments.coordinates("target", one.position, "...", 3)
        if one.rotation is not None:
            one = one._replace(rotation=rotation.unit("rotation", one.rotation))
        checked.append(one)
    return checked
