"""A pose from any solver, checked by forward kinematics.

In single precision quaternions deviate from unit length by 1e-5 after some hundred products. They
are normalised; the deviation is reported beside the distances.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, frozen
from ..articulation import Articulation, joint_excess
from ..inverse_kinematics.problem import Target, single_targets
from ..kinematics import forward_kinematics
from ..model import Model, checked_model, coordinates_name
from ..skeleton import Pose, Skeleton


@dataclass(frozen=True, eq=False)
class PoseJudgement:
    """Errors of a pose claimed to bring effectors to targets.

    Attributes:
        distance: from effector to target [m], the largest of several.
        angle: from the effector's to the target's rotation [rad], the largest of several; 0 where
            the rotation is free.
        distances: from each effector to its target [m], (target,).
        angles: likewise [rad], (target,).
        norm_deviation: the largest difference of a quaternion's length from 1, as passed.
        limit_excess: how far each joint is beyond its limits [rad, of slides m], (joint,).
        position_errors: distance between each joint's position as passed and by forward kinematics
            [m], (joint,); None unless both pose and positions were passed.
        length_errors: difference between each link's length by the positions passed and in the
            model [m], (joint,). 0 for the root and for sliding links; None without positions.
        positions: of all joints by forward kinematics of the normalised pose, or as passed [m],
            (joint, 3).
        names: of the joints.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
    """

    distance: float
    angle: float
    distances: FloatArray
    angles: FloatArray
    norm_deviation: float
    limit_excess: FloatArray
    position_errors: FloatArray | None
    length_errors: FloatArray | None
    positions: FloatArray
    names: tuple[str, ...]
    tolerance: float
    tolerance_rotation: float

    @property
    def reached(self) -> bool:
        """Whether every effector is on its target, within the tolerances."""
        return self.distance <= self.tolerance and self.angle <= self.tolerance_rotation

    @property
    def position_error(self) -> float | None:
        """The largest of the position errors [m], None if there are none."""
        return None if self.position_errors is None else float(self.position_errors.max())

    @property
    def length_error(self) -> float | None:
        """The largest of the length errors [m], None if there are none."""
        return None if self.length_errors is None else float(self.length_errors.max())

    @property
    def summary(self) -> str:
        """The findings in a few sentences."""
        verb = "is" if self.reached else "is not"
        angle = f" and {self.angle:.2g} rad" if self.angle else ""
        sentences = [
            f"The target {verb} reached: the effector is {self.distance:.2g} m{angle} off."
        ]
        count, worst = int((self.limit_excess > 0.0).sum()), int(self.limit_excess.argmax())
        if count:
            sentences.append(
                f"{count} joints are beyond their limits, {self.names[worst]} by "
                f"{self.limit_excess[worst]:.2g}."
            )
        if self.position_error is not None:
            sentences.append(
                f"The positions given are up to {self.position_error:.2g} m from where the "
                f"rotations put the joints, and change a link's length by up to "
                f"{self.length_error:.2g} m."
            )
        if self.norm_deviation:
            sentences.append(f"Quaternions are up to {self.norm_deviation:.2g} off unit length.")
        return " ".join(sentences)


def judge_pose(
    model: Model,
    pose: ArrayLike | None,
    target: ArrayLike | Target | Sequence[Target],
    effector: int | str | None = None,
    *,
    positions: ArrayLike | None = None,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
) -> PoseJudgement:
    """Return the errors of a pose: from its targets, of its limits, of positions passed with it.

    `pose` holds the local rotations of a Skeleton, (joint, 4), w first, or the coordinates q of an
    Articulation, (coordinate,). Quaternions have any length but zero. None judges only `positions`,
    the global positions of all joints [m], (joint, 3). All other arguments are as for `solve_ik`.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion has no length,
            an effector does not exist, or a pose is needed but missing.
    """
    model = checked_model(model, "model")
    targets = single_targets(model, target, effector)
    tree = model if isinstance(model, Skeleton) else model.skeleton
    x = None
    if positions is not None:
        x = arguments.coordinates("positions", positions, tree.joint_count, 3)
    excess, deviation = np.zeros(tree.joint_count), 0.0
    if pose is not None:
        unit, deviation = _normalised(model, pose)
        placed = forward_kinematics(model, unit)
        if isinstance(model, Articulation):
            for joint in range(model.joint_count):
                excess[joint] = joint_excess(model.joints, joint, unit)
    elif x is None or any(goal.rotation is not None for goal in targets):
        raise ValueError("pose: expected rotations or coordinates, got None")
    else:
        placed = Pose(frozen(np.array(x)), np.full((tree.joint_count, 4), np.nan))
    distances, angles = [], []
    for goal in targets:
        distances.append(float(np.linalg.norm(placed.positions[goal.joint] - goal.position)))
        Q = placed.rotations[goal.joint]
        angles.append(0.0 if goal.rotation is None else float(rotation.angle(Q, goal.rotation)))
    errors = lengths = None
    if x is not None:
        lengths = frozen(_length_errors(model, tree, x))
        errors = None if pose is None else frozen(np.linalg.norm(x - placed.positions, axis=-1))
    return PoseJudgement(
        max(distances), max(angles), frozen(np.array(distances)), frozen(np.array(angles)),
        deviation, frozen(excess), errors, lengths, placed.positions, tree.names,
        arguments.number("tolerance", tolerance, minimum=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, minimum=0.0),
    )  # fmt: skip


def _normalised(model: Skeleton | Articulation, pose: ArrayLike) -> tuple[FloatArray, float]:
    """Return the pose with unit quaternions, and the largest deviation of their lengths from 1."""
    name = coordinates_name(model)
    if isinstance(model, Skeleton):
        quaternions = arguments.array(name, pose, model.joint_count, 4)
        unit, deviations = rotation.normalise(quaternions, name)
        return unit, float(deviations.max())
    unit = arguments.coordinates(name, pose, model.coordinate_count).copy()
    unit[model.quaternions], deviations = rotation.normalise(unit[model.quaternions], name)
    return unit, float(deviations.max(initial=0.0))


def _length_errors(model: Skeleton | Articulation, tree: Skeleton, x: FloatArray) -> FloatArray:
    """Return how much positions change the lengths of rigid links [m], (joint,)."""
    kinds = ("ball",) * tree.joint_count if isinstance(model, Skeleton) else model.kinds
    rigid = [joint for joint in range(1, tree.joint_count) if kinds[joint] not in ("slide", "free")]
    errors = np.zeros(tree.joint_count)
    lengths = np.linalg.norm(x[rigid] - x[tree.parents[rigid]], axis=-1)
    errors[rigid] = np.abs(lengths - tree.link_lengths[rigid])
    return errors
