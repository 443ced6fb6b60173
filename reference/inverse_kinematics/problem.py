"""The targets of a solve, its settings and its solution; the solvers by name."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, IndexArray, shown
from ..articulation import Articulation
from ..backend.compiled import Kernel
from ..model import effector_of
from ..skeleton import Skeleton
from . import ccd, fabrik, jacobian, levenberg_marquardt
from .reduce import FURTHER_STARTS
from .restarts import Limits

# The defaults of `solve_ik`: iterations of an attempt, and of an attempt towards a target out of
# reach. Then restarts of the default Levenberg-Marquardt, for one effector and for several; with
# several a restart redraws the failing limbs.
MAX_ITERATIONS, FAR_ITERATIONS, RESTARTS, LIMB_RESTARTS = 100, 2000, 20, 100
# The phases of each solver, the first of which is the plain method; of others 1.
PHASE_COUNTS = {"levenberg_marquardt": 1 + FURTHER_STARTS}
# All integers up to this are floats.
LARGEST_COUNT = 2**53


class _TargetFields(NamedTuple):
    position: ArrayLike
    rotation: ArrayLike | None = None
    effector: int | str | None = None
    weight: float = 1.0


class Target(_TargetFields):
    """The position, and perhaps the rotation, for a joint to reach; both are copied.

    Attributes:
        position: global position [m], shape (3,), or (..., 3) for a batch.
        rotation: global rotation, shape (4,) or (..., 4); None for a free rotation.
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
        """Copy the arrays; the function that uses the target checks them."""
        x, Q = arguments.snapshot(position), arguments.snapshot(rotation)
        return super().__new__(cls, x, Q, effector, weight)


class IKSolution(NamedTuple):
    """A solver's result; a batch has leading axes everywhere.

    Attributes:
        local_rotations: the pose, shape (..., joint, 4).
        positions: all joints' global positions in this pose [m], shape (..., joint, 3).
        residual: distance from effector to target [m], by forward kinematics of the pose; the
            largest of several.
        iterations: the number of iterations made.
        outcome: how the solve ended; for a batch an integer array of Outcome values.
        history: residuals [m] before and after each iteration, shape (..., iterations + 1) if
            recorded, else empty. In a batch each row repeats its last residual to the longest.
        residual_rotation: angle from effector to target [rad], the largest of several; 0 where all
            rotations are free.
        coordinates: the pose in the form of the start: the coordinates of an Articulation, (...,
            coordinate), or the local rotations of a Skeleton.
        merit: the cost by which attempts are compared [m]: the root of the sum over targets of
            weight (distance² + (lever angle)²). The heaviest weight counts as 1, the lever is half
            the reach, and the angle is left out where the rotation is free.
        excess: `residual` less a lower bound by geometry [m]: the distance beyond all links and
            slides. On a Skeleton with a single position also the distance inside the inner radius
            that the longest link leaves; else 0.
    """

    local_rotations: FloatArray
    positions: FloatArray
    residual: float | FloatArray
    iterations: int | IndexArray
    outcome: Any  # Outcome | IndexArray, which type checkers cannot tell apart
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


def checked_targets(
    model: Skeleton | Articulation, target: Any, effector: int | str | None
) -> list[CheckedTarget]:
    """Return the targets of all effectors, their numbers not yet checked.

    Raises:
        ValueError: if the argument is no position or target, or a joint does not exist. Also if two
            targets are for the same joint, or target and argument name different joints.
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
    """Return whether an argument is a sequence with a Target."""
    if isinstance(target, Target) or not isinstance(target, list | tuple):
        return False
    return any(isinstance(x, Target) for x in target)


def _checked(
    model: Skeleton | Articulation, target: Any, effector: int | str | None
) -> CheckedTarget:
    if not isinstance(target, Target):
        raise ValueError(f"target: expected only Targets beside others, got {shown(target)}")
    joint = effector_of(model, effector if target.effector is None else target.effector)
    if effector is not None and joint != model.index(effector, "effector"):
        raise ValueError(
            f"effector: expected that of the target, {target.effector!r}, got {shown(effector)}"
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


def check_single(targets: list[CheckedTarget]) -> list[CheckedTarget]:
    """Return the targets; a ValueError for a batch."""
    for target in targets:
        arguments.check_shape("target", target.position, 3)
        if target.rotation is not None:
            arguments.check_shape("rotation", target.rotation, 4)
    return targets


def single_targets(model: Any, target: Any, effector: Any) -> list[CheckedTarget]:
    """Return the targets of a single pose, all numbers checked."""
    return check_single(check_numbers(checked_targets(model, target, effector)))


class IKSolver(NamedTuple):
    """A solver's two kernels; its pickle holds the name."""

    name: str  # in IK_SOLVERS
    chain: Kernel  # for one position to reach by a chain of unlimited balls
    mechanism: Kernel  # for all other problems

    def __reduce__(self) -> tuple[Any, ...]:
        return _solver, (self.name,)


def _solver(name: str) -> IKSolver:
    return IK_SOLVERS[name]


_KERNELS = {
    "ccd": (ccd.ON_CHAINS, ccd.ON_MECHANISMS),
    "fabrik": (fabrik.ON_CHAINS, fabrik.ON_MECHANISMS),
    "levenberg_marquardt": (levenberg_marquardt.ON_CHAINS, levenberg_marquardt.ON_MECHANISMS),
    "damped_least_squares": (jacobian.DAMPED_ON_CHAINS, jacobian.DAMPED_ON_MECHANISMS),
    "jacobian_transpose": (jacobian.TRANSPOSE_ON_CHAINS, jacobian.TRANSPOSE_ON_MECHANISMS),
    "anderson_ccd": (ccd.ANDERSON_ON_CHAINS, ccd.ANDERSON_ON_MECHANISMS),
}
IK_SOLVERS = {name: IKSolver(name, *kernels) for name, kernels in _KERNELS.items()}


@dataclass(frozen=True)
class Settings:
    """Settings of a solve, checked."""

    solver: IKSolver  # its kernels
    limits: Limits  # what the solve may leave and take
    seed: int  # of the restarts
    record: bool  # whether to keep the residuals of all iterations

    @functools.cached_property
    def numbers(self) -> FloatArray:
        """The limits as an array, for kernels."""
        return np.array(self.limits, dtype=np.float64)

    def limited(self, **limits: Any) -> "Settings":
        """Return the settings with some of its limits replaced."""
        return replace(self, limits=self.limits._replace(**limits))


def default_solver(model: Any, target: Any) -> tuple[str, int]:
    """Return the solver and the restarts that suit a model and its target."""
    target = target[0] if are_targets(target) and len(target) == 1 else target
    oriented = isinstance(target, Target) and target.rotation is not None
    if isinstance(model, Skeleton) and not (oriented or are_targets(target)):
        return "fabrik", 0
    return "levenberg_marquardt", LIMB_RESTARTS if are_targets(target) else RESTARTS


def checked_settings(*arguments: Any) -> Settings:
    """Return the settings, recent settings from a cache."""
    try:
        return _cached_settings(*arguments)
    except TypeError:  # some argument has no hash, and so is no number or name
        return _settings(*arguments)


def _settings(
    solver: Any, tolerance: Any, tolerance_rotation: Any, max_iterations: Any,
    restarts: Any, seed: Any, record: bool, phases: Any = None,
) -> Settings:  # fmt: skip
    within_reach, out_of_reach = MAX_ITERATIONS, FAR_ITERATIONS
    if max_iterations is not None:
        count = arguments.integer("max_iterations", max_iterations, minimum=0)
        within_reach = out_of_reach = min(count, LARGEST_COUNT)
    kernels = IK_SOLVERS[arguments.choice("solver", solver, IK_SOLVERS)]
    phase_count = PHASE_COUNTS.get(kernels.name, 1)
    if phases is not None:
        phase_count = arguments.integer("phases", phases, minimum=1, below=phase_count + 1)
    limits = Limits(
        arguments.number("tolerance", tolerance, minimum=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, minimum=0.0),
        within_reach,
        out_of_reach,
        arguments.count("restarts", restarts, minimum=0),
        False,
        phase_count,
    )
    seed = arguments.integer("seed", seed, minimum=0)
    return Settings(kernels, limits, seed, arguments.boolean("record", record))


_cached_settings = functools.lru_cache(maxsize=64, typed=True)(_settings)
