"""Anyone's answer to an inverse-kinematics problem, checked by forward kinematics.

Answers in single precision hold quaternions that are off unit length by 1e-5 after some hundred
products. They are normalised, and how far they were off is reported beside the distances, not
instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, frozen
from ..articulation import Articulation, joint_excess
from ..inverse_kinematics.problem import CheckedTarget, Target, check_numbers, checked_targets
from ..kinematics import forward_kinematics
from ..model import Model, checked_model, coordinates_name
from ..skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class PoseJudgement:
    """What is known of a pose that is said to bring effectors to targets."""

    distance: float  # from effector to target [m], the largest of several
    # from the effector's to the target's rotation [rad], the largest of several; 0 where no
    # rotation is asked for
    angle: float
    distances: FloatArray  # from each effector to its target [m], (target,)
    angles: FloatArray  # likewise [rad], (target,)
    norm_deviation: float  # the largest difference of a quaternion's length from one, as given
    limit_excess: FloatArray  # how far each joint is beyond its limits [rad, of slides m], (joint,)
    # the largest distance between a joint's position as given and where the rotations put it [m];
    # None if no positions were given
    position_error: float | None
    # the largest difference between a link's length by the positions given and as the model has it
    # [m]; None if none were given. Links that slide are left out
    length_error: float | None
    # of all joints by forward kinematics of the normalised pose [m], (joint, 3)
    positions: FloatArray
    names: tuple[str, ...]  # of the joints
    tolerance: float  # distance that counts as reached [m]
    tolerance_rotation: float  # angle that does [rad]

    @property
    def reached(self) -> bool:
        """Whether every effector is on its target, within the tolerances."""
        return self.distance <= self.tolerance and self.angle <= self.tolerance_rotation

    @property
    def summary(self) -> str:
        """What was found, in a few sentences."""
        return " ".join([self._targets(), *self._limits(), *self._given(), self._norms()])

    def _targets(self) -> str:
        verb = "is" if self.reached else "is not"
        angle = f" and {self.angle:.2g} rad" if self.angle else ""
        return f"The target {verb} reached: the effector is {self.distance:.2g} m{angle} off."

    def _limits(self) -> list[str]:
        beyond = np.flatnonzero(self.limit_excess > 0.0)
        if not len(beyond):
            return []
        worst = int(self.limit_excess.argmax())
        return [
            f"{len(beyond)} joints are beyond their limits, {self.names[worst]} by "
            f"{self.limit_excess[worst]:.2g}."
        ]

    def _given(self) -> list[str]:
        if self.position_error is None:
            return []
        return [
            f"The positions given are up to {self.position_error:.2g} m from where the rotations "
            f"put the joints, and change a link's length by up to {self.length_error:.2g} m."
        ]

    def _norms(self) -> str:
        return f"Quaternions are up to {self.norm_deviation:.2g} off unit length."


def judge_pose(
    model: Model,
    pose: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    effector: int | str | None = None,
    *,
    positions: ArrayLike | None = None,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
) -> PoseJudgement:
    """Return how far a pose is from its targets, its limits, and the positions said to be its own.

    `pose` holds the local rotations of a Skeleton, (joint, 4), w first, or the coordinates q of an
    Articulation, (coordinate,), with quaternions of any length but zero; `positions` are the global
    ones of all joints that came with it [m], (joint, 3). The other arguments are as for `solve_ik`.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion has no length,
            or there is no such effector.
    """
    model = checked_model(model, "model")
    unit, deviation = _normalised(model, pose)
    targets = check_numbers(checked_targets(model, target, effector))
    found = forward_kinematics(model, unit)
    distances = [_distance(one, found.positions[one.joint]) for one in targets]
    angles = [_angle(one, found.rotations[one.joint]) for one in targets]
    tree = model if isinstance(model, Skeleton) else model.skeleton
    moved, stretched = _compared(model, tree, found.positions, positions)
    return PoseJudgement(
        max(distances), max(angles), frozen(np.array(distances)), frozen(np.array(angles)),
        deviation, frozen(_limit_excess(model, unit)), moved, stretched, found.positions,
        tree.names, arguments.number("tolerance", tolerance, least=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, least=0.0),
    )  # fmt: skip


def _normalised(model: Skeleton | Articulation, pose: ArrayLike) -> tuple[FloatArray, float]:
    """Return the pose with unit quaternions, and how far one was off at most."""
    name = coordinates_name(model)
    if isinstance(model, Skeleton):
        given = arguments.array(name, pose, model.joint_count, 4)
        unit, deviation = rotation.normalise(given, name)
        return unit, float(deviation.max())
    unit = arguments.coordinates(name, pose, model.coordinate_count).copy()
    worst = 0.0
    for joint, kind in enumerate(model.kinds):
        if kind in ("ball", "free"):
            end = model.coordinates_of(joint).stop
            unit[end - 4 : end], deviation = rotation.normalise(unit[end - 4 : end], name)
            worst = max(worst, float(deviation))
    return unit, worst


def _distance(target: CheckedTarget, position: FloatArray) -> float:
    if target.position.ndim != 1:
        raise ValueError(
            f"target: expected shape (3,), got {arguments.shape(target.position.shape)}"
        )
    return float(np.linalg.norm(position - target.position))


def _angle(target: CheckedTarget, Q: FloatArray) -> float:
    if target.rotation is None:
        return 0.0
    if target.rotation.ndim != 1:
        raise ValueError(
            f"rotation: expected shape (4,), got {arguments.shape(target.rotation.shape)}"
        )
    return float(rotation.angle(Q, target.rotation))


def _limit_excess(model: Skeleton | Articulation, q: FloatArray) -> FloatArray:
    if isinstance(model, Skeleton):
        return np.zeros(model.joint_count)
    return np.array([joint_excess(model.joints, j, q) for j in range(model.joint_count)])


def _compared(
    model: Skeleton | Articulation, tree: Skeleton, expected: FloatArray, given: Any
) -> tuple[float | None, float | None]:
    """Return how far positions given are off, and how much they change the links' lengths."""
    if given is None:
        return None, None
    x = arguments.coordinates("positions", given, tree.joint_count, 3)
    moved = np.linalg.norm(x - expected, axis=-1).max()
    kinds = ("ball",) * tree.joint_count if isinstance(model, Skeleton) else model.kinds
    rigid = [j for j in range(1, tree.joint_count) if kinds[j] not in ("slide", "free")]
    lengths = np.linalg.norm(x[rigid] - x[tree.parents[rigid]], axis=-1)
    return float(moved), float(np.abs(lengths - tree.link_lengths[rigid]).max(initial=0.0))
