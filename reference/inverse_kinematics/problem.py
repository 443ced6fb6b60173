"""What is asked of a solver, and what it answers."""

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from .. import arguments
from ..arguments import FloatArray, IndexArray
from ..outcome import Outcome
from ..skeleton import Skeleton


class Target(NamedTuple):
    """Where a joint is wanted.

    Attributes:
        position: global position [m], shape (3,), or (..., 3) for a batch.
        effector: the joint, by index or name.
    """

    position: ArrayLike
    effector: int | str = -1


class IKSolution(NamedTuple):
    """A solver's answer; a batch has leading axes everywhere.

    Attributes:
        local_rotations: the pose found, shape (..., joint, 4).
        positions: all joints' global positions in that pose [m], shape (..., joint, 3).
        residual: distance from effector to target [m], by forward kinematics of the pose.
        iterations: how many were made.
        outcome: how it ended; for a batch an integer array of Outcome values.
        history: residuals [m] before and after each iteration, shape (..., iterations + 1) if
            recorded, else empty. In a batch each row repeats its last residual to the longest.
    """

    local_rotations: FloatArray
    positions: FloatArray
    residual: float | FloatArray
    iterations: int | IndexArray
    outcome: Outcome | IndexArray
    history: FloatArray


def checked_target(skeleton: Skeleton, target: Any, effector: int | str) -> tuple[FloatArray, int]:
    """Return the target's position, (..., 3), and the effector's index.

    Raises:
        ValueError: if it is no position or target, several targets, or not finite; if there is no
            such joint, or the target and the argument name different ones.
    """
    if isinstance(target, list | tuple) and target and isinstance(target[0], Target):
        if len(target) > 1:
            raise ValueError(f"target: expected one target, got {len(target)}")
        target = target[0]
    joint = skeleton.index(effector, "effector")
    if isinstance(target, Target):
        if effector != -1 and joint != skeleton.index(target.effector, "effector"):
            raise ValueError(
                f"effector: expected that of the target, {target.effector!r}, got {effector!r}"
            )
        joint, target = skeleton.index(target.effector, "effector"), target.position
    return arguments.coordinates("target", target, "...", 3), joint
