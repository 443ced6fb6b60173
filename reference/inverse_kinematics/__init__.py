"""Inverse kinematics: local rotations that bring an effector to a target."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import frozen
from ..compiled import TwoSpeeds, bind
from ..outcome import Outcome
from ..skeleton import Skeleton, checked_skeleton
from .batch import Solved, iterate, solve_batch
from .ccd import ccd_sweep
from .damped_least_squares import damped_least_squares_sweep
from .fabrik import fabrik_sweep
from .jacobian_transpose import jacobian_transpose_sweep
from .levenberg_marquardt import levenberg_marquardt_sweep
from .problem import IKSolution, Target, checked_target

__all__ = ["IK_SOLVERS", "IKSolution", "Outcome", "Target", "solve_ik"]


def _batch(sweep):
    return TwoSpeeds(bind(solve_batch, iterate=bind(iterate, sweep=sweep)))


IK_SOLVERS = {
    "ccd": _batch(ccd_sweep),
    "fabrik": _batch(fabrik_sweep),
    "levenberg_marquardt": _batch(levenberg_marquardt_sweep),
    "damped_least_squares": _batch(damped_least_squares_sweep),
    "jacobian_transpose": _batch(jacobian_transpose_sweep),
}


def solve_ik(
    skeleton: Skeleton,
    local_rotations: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    solver: str = "fabrik",
    effector: int | str = -1,
    *,
    tolerance: float = 1e-4,
    max_iterations: int = 100,
    record: bool = False,
) -> IKSolution:
    """Return local rotations that bring the effector to the target, from a start pose.

    The root turns but does not move. Joints off the path from the root to the effector keep their
    local rotation, as does the effector. An answer is always given; `outcome` says what it is. A
    straight chain whose target lies on its own line is first bent, always in the same way.

    Args:
        skeleton: the tree.
        local_rotations: the start, unit quaternions, shape (..., joint, 4).
        target: global position [m], shape (..., 3), or a Target. Leading axes broadcast with those
            of the start: a batch.
        solver: a name in IK_SOLVERS.
        effector: the joint that is to reach it, by index or name.
        tolerance: distance that counts as reached [m].
        max_iterations: the most to make.
        record: keep the residuals of all iterations in `history`.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion is further than
            1e-6 from unit length, a number is out of range, or a name unknown.
    """
    return solve_targets(
        skeleton, local_rotations, target, solver, effector, tolerance, max_iterations, record
    )


def solve_targets(
    skeleton, local_rotations, target, solver, effector, tolerance, max_iterations, record,
    chained=False,
):  # fmt: skip
    """Return what `solve_ik` does; if chained, each solve starts from the one before."""
    solve = IK_SOLVERS[arguments.choice("solver", solver, IK_SOLVERS)]
    count = checked_skeleton(skeleton).joint_count
    starts = arguments.floats("local_rotations", local_rotations, "...", count, 4)
    positions, effector = checked_target(skeleton, target, effector)
    tolerance = arguments.number("tolerance", tolerance, least=0.0)
    max_iterations = arguments.integer("max_iterations", max_iterations, least=0)
    batch = _batch_shape(starts.shape[:-2], positions.shape[:-1])
    targets = arguments.spread(positions, (*batch, 3)).reshape(-1, 3)
    if starts.ndim > 2:
        starts = arguments.spread(starts, (*batch, *starts.shape[-2:]))
    starts = starts.reshape(-1, *starts.shape[-2:])
    solved = _empty(len(targets), skeleton.joint_count, max_iterations if record else 0)
    bad = solve(
        skeleton.arrays, skeleton.path_array(effector), starts, targets,
        tolerance, max_iterations, chained, solved,
    )  # fmt: skip
    if bad >= 0:  # raise, or the lengths were on the very edge of the tolerance
        unit = rotation.unit("local_rotations", local_rotations)
        return solve_targets(
            skeleton, unit, target, solver, effector, tolerance, max_iterations, record, chained
        )
    return _solution(solved, batch, record)


def _batch_shape(starts: tuple[int, ...], targets: tuple[int, ...]) -> tuple[int, ...]:
    if not starts:
        return targets
    try:
        return np.broadcast_shapes(starts, targets)
    except ValueError:
        raise ValueError(
            f"target: expected leading axes that broadcast with those of local_rotations, "
            f"{arguments.shape(starts)}, got {arguments.shape(targets)}"
        ) from None


def _empty(targets: int, joints: int, recorded: int) -> Solved:
    return Solved(
        np.empty((targets, joints, 4)),
        np.empty((targets, joints, 3)),
        np.empty(targets),
        np.empty(targets, dtype=np.int64),
        np.empty(targets, dtype=np.int64),
        np.empty((targets, recorded + 1) if recorded else (1, 1)),
    )


def _solution(solved: Solved, batch: tuple[int, ...], record: bool) -> IKSolution:
    history = solved.history[:, : solved.iterations.max(initial=0) + 1] if record else np.empty(0)
    local, positions, residuals, iterations, outcomes = (
        frozen(values.reshape(batch + values.shape[1:])) for values in solved[:5]
    )
    if batch:
        history = history.reshape(*batch, -1) if record else history
        return IKSolution(local, positions, residuals, iterations, outcomes, frozen(history))
    return IKSolution(
        local, positions, float(residuals), int(iterations), Outcome(int(outcomes)),
        frozen(history.reshape(-1)),
    )  # fmt: skip
