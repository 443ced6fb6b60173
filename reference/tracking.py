"""Following a curve frame by frame."""

from collections.abc import Sequence
from typing import cast

from numpy.typing import ArrayLike

from . import arguments, rotation
from .arguments import FloatArray
from .articulation import Articulation
from .inverse_kinematics import problem
from .inverse_kinematics.solve import batch_shape, solve_checked
from .model import Model, checked_model
from .skeleton import Skeleton


def track(
    skeleton: Model,
    curve: ArrayLike | problem.Target | Sequence[problem.Target],
    solver: str | None = None,
    start: ArrayLike | None = None,
    effector: int | str | None = None,
    warm: bool = True,
    *,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int | None = None,
    record: bool = False,
) -> problem.IKSolution:
    """Return the poses in which the effector follows a curve, a frame for each of its points.

    Args:
        skeleton: as for `solve_ik`.
        curve: the effector's global position in each frame [m], shape (frame, 3). Or a Target with
            this position and a rotation (frame, 4), or several for several effectors.
        solver: a name in IK_SOLVERS; by default CCD for one position on a Skeleton, and else
            Levenberg-Marquardt. There are no restarts from random poses, nor phases after the first
            of Levenberg-Marquardt: the motion would jump.
        start: the first pose: local rotations, shape (joint, 4), identities if None; of an
            Articulation coordinates, (coordinate,), neutral ones if None.
        effector: the joint that follows, by index or name; by default as for `solve_ik`.
        warm: start each frame from the solution before, which keeps neighbouring frames alike. If
            False, each starts from `start`, and the joints may jump from frame to frame.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: of a frame; by default as for `solve_ik`.
        record: keep the residuals of the iterations of single frames in `history`.

    Returns:
        IKSolution with the frames as leading axis.

    Raises:
        ValueError: as `solve_ik` does, and if the curve has another shape or no points.
        FloatingPointError: if a coordinate of the motion exceeds 1e75.
    """
    model = checked_model(skeleton)
    targets = _along(model, curve, effector)
    if solver is None:
        solver, _ = problem.default_solver(model, curve)
        solver = "ccd" if solver == "fabrik" else solver
    chained = arguments.boolean("warm", warm)
    settings = problem.checked_settings(
        solver, tolerance, tolerance_rotation, max_iterations, 0, 0, record, 1
    )
    settings = settings.limited(chained=chained)
    return solve_checked(model, _start(model, start), targets, settings)


def _along(
    skeleton: Skeleton | Articulation,
    curve: ArrayLike | problem.Target | Sequence[problem.Target],
    effector: int | str | None,
) -> list[problem.CheckedTarget]:
    """Return the targets of all effectors, some of them for all frames."""
    if not (isinstance(curve, problem.Target) or problem.are_targets(curve)):
        curve = arguments.coordinates("curve", cast(ArrayLike, curve), "frame", 3)
    targets = problem.checked_targets(skeleton, curve, effector)
    batch = batch_shape((), targets, "start")
    if len(batch) != 1:
        got = arguments.shape((*batch, 3))
        raise ValueError(f"curve: expected shape (frame, 3), got {got}")
    if batch[0] == 0:
        raise ValueError("curve: expected at least one point, got none")
    return problem.check_numbers(targets)


def _start(model: Skeleton | Articulation, start: ArrayLike | None) -> FloatArray:
    """Return the start, checked but not made unit, or the default."""
    if isinstance(model, Articulation):
        q = model.neutral() if start is None else start
        q = arguments.floats("start", q, model.coordinate_count)
        model.checked("start", q)
        return q
    local = rotation.identity(model.joint_count) if start is None else start
    local = arguments.floats("start", local, model.joint_count, 4)
    rotation.unit("start", local)
    return local
