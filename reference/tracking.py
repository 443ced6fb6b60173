"""Following a curve frame by frame."""

from numpy.typing import ArrayLike

from . import arguments, rotation
from .inverse_kinematics import IKSolution, solve_targets
from .skeleton import Skeleton, checked_skeleton


def track(
    skeleton: Skeleton,
    curve: ArrayLike,
    solver: str = "ccd",
    start: ArrayLike | None = None,
    effector: int | str = -1,
    warm: bool = True,
    *,
    tolerance: float = 1e-4,
    max_iterations: int = 100,
    record: bool = False,
) -> IKSolution:
    """Return the poses in which the effector follows a curve, a frame a point.

    Args:
        skeleton: the tree.
        curve: the effector's global position in each frame [m], shape (frame, 3).
        solver: a name in IK_SOLVERS.
        start: local rotations of the pose to start from, shape (joint, 4); identities if None.
        effector: the joint that follows, by index or name.
        warm: start each frame from the last one's solution, which keeps neighbouring frames alike;
            if False, each starts from `start`, and the joints may jump from frame to frame.
        tolerance: distance that counts as reached [m].
        max_iterations: the most to make in a frame.
        record: keep the residuals of all iterations in `history`.

    Returns:
        IKSolution with the frames as leading axis.

    Raises:
        ValueError: as `solve_ik` does, and if the curve is not of that shape or has no points.
    """
    points = arguments.array("curve", curve, "frame", 3)
    if len(points) == 0:
        raise ValueError("curve: expected at least one point, got none")
    count = checked_skeleton(skeleton).joint_count
    start = rotation.identity(count) if start is None else start
    start = arguments.floats("start", start, count, 4)
    return solve_targets(
        skeleton, start, points, solver, effector, tolerance, max_iterations, record, chained=warm
    )
