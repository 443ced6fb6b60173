"""Following a curve frame by frame, and coherently."""

from collections.abc import Sequence
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, rotation, trajectory
from .arguments import FloatArray, IndexArray
from .articulation import Articulation
from .inverse_kinematics import (
    IKSolution,
    Outcome,
    Settings,
    Target,
    balls,
    batch_of,
    checked_settings,
    goals_of,
    solve_targets,
)
from .inverse_kinematics.mechanism import Mechanism, take_coordinates
from .inverse_kinematics.problem import Wanted, check_numbers, checked_targets
from .inverse_kinematics.reduce import prepare
from .skeleton import Skeleton, checked_skeleton

# A frame that is nearer to its target than this, over the reach, or than this angle [rad], has met
# it, whatever the tolerance.
MET = 1e-6


def track(
    skeleton: Skeleton | Articulation,
    curve: ArrayLike | Target | Sequence[Target],
    solver: str = "ccd",
    start: ArrayLike | None = None,
    effector: int | str = -1,
    warm: bool = True,
    *,
    coherent: bool = False,
    closed: bool = False,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int = 100,
    record: bool = False,
) -> IKSolution:
    """Return the poses in which the effector follows a curve, a frame a point.

    A coherent motion is first solved frame by frame. Then all its frames are changed together until
    the sum of the squared jumps between neighbours, over hinges [rad], rotation vectors of balls
    [rad] and ways over the reach, cannot be lowered by a small change, with every effector on its
    target and every joint within its limits: it is the nearest to the last frame that leaves no
    frame worse off. Frames whose target is not reached are drawn to it as near as they come. The
    first pose is as free as the others; `start` only says where the search begins. In the end every
    frame that is not within the tolerance yet is solved once more from there.

    Args:
        skeleton: the tree; an Articulation for joints of other kinds and for limits.
        curve: the effector's global position in each frame [m], shape (frame, 3); or a Target whose
            position is that, and its rotation (frame, 4), or several for several effectors.
        solver: a name in IK_SOLVERS.
        start: the pose to start from: local rotations, shape (joint, 4), identities if None; of an
            Articulation coordinates, (coordinate,), neutral ones if None.
        effector: the joint that follows, by index or name.
        warm: start each frame from the last one's solution, which keeps neighbouring frames alike;
            if False, each starts from `start`, and the joints may jump from frame to frame.
        coherent: make the motion coherent.
        closed: count the jump from the last frame to the first as well, so that the motion ends
            where it began and can be repeated without drift; for coherent motions only.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: the most to make in a frame.
        record: keep the residuals of all iterations in `history`; not of those over all frames.

    Returns:
        IKSolution with the frames as leading axis. The iterations of a coherent motion are those of
        both solves of each frame and those over all frames.

    Raises:
        ValueError: as `solve_ik` does, and if the curve is not of that shape or has no points, or a
            motion is to be closed but not coherent.
    """
    if arguments.boolean("closed", closed) and not arguments.boolean("coherent", coherent):
        raise ValueError("closed: expected False where coherent is False, got True")
    if not isinstance(skeleton, Articulation):
        checked_skeleton(skeleton)
    wanted = _along(skeleton, curve, effector)
    settings = checked_settings(
        solver,
        tolerance,
        tolerance_rotation,
        max_iterations,
        0,
        0,
        record,
        arguments.boolean("warm", warm),
    )
    motion = _solved(skeleton, _start(skeleton, start), wanted, settings)
    if not coherent:
        return motion
    q, reached, steps = _smoothed(skeleton, motion, wanted, closed)
    return _settled(skeleton, motion, wanted, q, reached, steps, settings)


def _along(
    skeleton: Skeleton | Articulation,
    curve: ArrayLike | Target | Sequence[Target],
    effector: int | str,
) -> list[Wanted]:
    """Return what is wanted of each effector, in so many frames."""
    if not _has_targets(curve):
        curve = arguments.coordinates("curve", cast(ArrayLike, curve), "frame", 3)
    wanted = checked_targets(skeleton, curve, effector)
    batch = batch_of((), wanted)
    if len(batch) != 1:
        came = arguments.shape((*batch, 3))
        raise ValueError(f"curve: expected shape (frame, 3), got {came}")
    if batch[0] == 0:
        raise ValueError("curve: expected at least one point, got none")
    return [_spread(one, *batch) for one in check_numbers(wanted)]


def _has_targets(curve: Any) -> TypeGuard[Target | Sequence[Target]]:
    several = isinstance(curve, list | tuple) and any(isinstance(one, Target) for one in curve)
    return isinstance(curve, Target) or several


def _spread(one: Wanted, frames: int) -> Wanted:
    turn = one.rotation if one.rotation is None else arguments.spread(one.rotation, (frames, 4))
    return one._replace(position=arguments.spread(one.position, (frames, 3)), rotation=turn)


def _start(skeleton: Skeleton | Articulation, start: ArrayLike | None) -> FloatArray:
    if isinstance(skeleton, Articulation):
        if start is None:
            return skeleton.neutral()
        given = arguments.floats("start", start, skeleton.coordinate_count)
        skeleton.checked("start", given)
        return given
    count = skeleton.joint_count
    if start is None:
        return rotation.identity(count)
    given = arguments.floats("start", start, count, 4)
    rotation.unit("start", given)
    return given


def _solved(
    skeleton: Skeleton | Articulation,
    start: FloatArray,
    wanted: list[Wanted],
    settings: Settings,
) -> IKSolution:
    targets = [Target(one.position, one.rotation, one.joint, one.weight) for one in wanted]
    return solve_targets(skeleton, start, targets, -1, settings)


def _smoothed(
    skeleton: Skeleton | Articulation, motion: IKSolution, wanted: list[Wanted], closed: bool
) -> tuple[FloatArray, np.ndarray, int]:
    """Return the coherent motion, which frames meet their targets, and the steps over all."""
    articulation = skeleton if isinstance(skeleton, Articulation) else balls(skeleton)
    effectors = tuple(one.joint for one in wanted)
    oriented = tuple(one.rotation is not None for one in wanted)
    mechanism = prepare(articulation, effectors, oriented).mechanism
    columns = _columns(mechanism, articulation.coordinate_count)
    near = np.asarray(motion.residual) <= MET * mechanism.reach
    met = near & (np.asarray(motion.residual_rotation) <= MET)
    reached, steps = met | (np.asarray(motion.outcome) == Outcome.CONVERGED), 0
    q = motion.coordinates.reshape(-1, articulation.coordinate_count).copy()
    if mechanism.freedoms:
        own, goals = np.ascontiguousarray(q[:, columns]), goals_of(wanted, (len(q),))
        q[:, columns], steps = trajectory.smooth(mechanism, goals, own, reached, closed)
    return q.reshape(motion.coordinates.shape), reached, steps


def _columns(mechanism: Mechanism, count: int) -> IndexArray:
    """Return which of the articulation's coordinates are the mechanism's own."""
    own = np.empty(mechanism.coordinates)
    take_coordinates(mechanism, np.arange(count, dtype=np.float64), own)
    return own.astype(np.int64)


def _settled(
    skeleton: Skeleton | Articulation,
    motion: IKSolution,
    wanted: list[Wanted],
    q: FloatArray,
    reached: np.ndarray,
    steps: int,
    settings: Settings,
) -> IKSolution:
    """Return the motion q with its residuals, those of its frames solved again that need it."""
    alone = settings._replace(chained=False, record=False)
    still = alone._replace(max_iterations=0)
    last = _solved(skeleton, q, wanted, still)
    off = np.flatnonzero(reached & (last.outcome != Outcome.CONVERGED))
    iterations = np.asarray(motion.iterations) + steps
    if len(off):
        again = _solved(skeleton, q[off], [_part(one, off) for one in wanted], alone)
        q[off] = again.coordinates
        iterations[off] += again.iterations
        last = _solved(skeleton, q, wanted, still)
    outcome = np.where(reached | (last.outcome == Outcome.CONVERGED), last.outcome, motion.outcome)
    return last._replace(
        iterations=arguments.frozen(iterations),
        outcome=arguments.frozen(outcome),
        history=motion.history,
    )


def _part(one: Wanted, frames: IndexArray) -> Wanted:
    turn = one.rotation if one.rotation is None else one.rotation[frames]
    return one._replace(position=one.position[frames], rotation=turn)
