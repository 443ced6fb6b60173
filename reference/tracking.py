"""Following a curve: frame by frame, or by a smooth trajectory over all frames."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from . import arguments, rotation, trajectory
from .arguments import LARGEST_COORDINATE, FloatArray
from .articulation import Articulation
from .inverse_kinematics import problem
from .inverse_kinematics.reduce import prepare
from .inverse_kinematics.solve import balls, batch_shape, solve_checked, target_rows
from .model import Model, checked_model
from .outcome import Outcome
from .skeleton import Skeleton

# A frame within this distance of its target, over the reach, and within this angle [rad] is on its
# target, whatever the tolerance.
ON_TARGET = 1e-6


def track(
    skeleton: Model,
    curve: ArrayLike | problem.Target | Sequence[problem.Target],
    solver: str | None = None,
    start: ArrayLike | None = None,
    effector: int | str | None = None,
    warm: bool = True,
    *,
    coherent: bool = False,
    closed: bool = False,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int | None = None,
    record: bool = False,
) -> problem.IKSolution:
    """Return the poses in which the effector follows a curve, a frame for each of its points.

    A coherent motion is a smooth trajectory (`trajectory/`): solved frame by frame first, then in
    all frames together, until no small change lowers the sum of the squared displacements between
    neighbouring frames, over angles [rad], rotation vectors of balls [rad] and lengths over the
    reach, with every effector on its target and every joint within its limits. A penalty draws
    frames that do not reach their targets towards them. Every frame that is then not within the
    tolerance is solved once more from there.

    Args:
        skeleton: as for `solve_ik`.
        curve: the effector's global position in each frame [m], shape (frame, 3); or a Target whose
            position is that, and its rotation (frame, 4), or several for several effectors.
        solver: a name in IK_SOLVERS; by default CCD for one position on a Skeleton, and else
            Levenberg-Marquardt. There are no restarts from random poses, nor phases after the first
            of Levenberg-Marquardt: the motion would jump.
        start: the first pose: local rotations, shape (joint, 4), identities if None; of an
            Articulation coordinates, (coordinate,), neutral ones if None.
        effector: the joint that follows, by index or name; by default as for `solve_ik`.
        warm: start each frame from the solution before it, which keeps neighbouring frames alike;
            if False, each starts from `start`, and the joints may jump from frame to frame.
        coherent: make the motion a smooth trajectory, its first pose as free as the others.
        closed: count the displacement from the last frame to the first as well, so that the motion
            can be repeated without drift; needs coherent=True.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: of a frame; by default as for `solve_ik`.
        record: keep the residuals of the iterations of single frames in `history`.

    Returns:
        IKSolution with the frames as leading axis. A coherent motion counts the iterations of both
        solves of each frame and over all frames.

    Raises:
        ValueError: as `solve_ik` does, and if the curve is not of that shape or has no points, or a
            motion is to be closed but not coherent.
        FloatingPointError: if a coordinate of the motion exceeds 1e75.
    """
    if arguments.boolean("closed", closed) and not arguments.boolean("coherent", coherent):
        raise ValueError("closed: expected False where coherent is False, got True")
    model = checked_model(skeleton)
    targets = _along(model, curve, effector)
    if solver is None:
        solver, _ = problem.default_solver(model, curve)
        solver = "ccd" if solver == "fabrik" else solver
    chained = arguments.boolean("warm", warm)
    settings = problem.checked_settings(
        solver, tolerance, tolerance_rotation, max_iterations, 0, 0, record, 1
    )
    settings = replace(settings, limits=settings.limits._replace(chained=chained))
    motion = solve_checked(model, _start(model, start), targets, settings)
    if not coherent:
        return motion
    q, reached, steps = _smoothed(model, motion, targets, closed)
    return _finished(model, motion, targets, q, reached, steps, settings)


def _along(
    skeleton: Skeleton | Articulation,
    curve: ArrayLike | problem.Target | Sequence[problem.Target],
    effector: int | str | None,
) -> list[problem.CheckedTarget]:
    """Return the targets of all effectors, each spread over all frames."""
    if not (isinstance(curve, problem.Target) or problem.are_targets(curve)):
        curve = arguments.coordinates("curve", cast(ArrayLike, curve), "frame", 3)
    targets = problem.checked_targets(skeleton, curve, effector)
    batch = batch_shape((), targets, "start")
    if len(batch) != 1:
        got = arguments.shape((*batch, 3))
        raise ValueError(f"curve: expected shape (frame, 3), got {got}")
    if batch[0] == 0:
        raise ValueError("curve: expected at least one point, got none")
    return [
        target.mapped(lambda values: arguments.spread(values, (batch[0], values.shape[-1])))
        for target in problem.check_numbers(targets)
    ]


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


def _smoothed(
    skeleton: Skeleton | Articulation,
    motion: problem.IKSolution,
    targets: list[problem.CheckedTarget],
    closed: bool,
) -> tuple[FloatArray, np.ndarray, int]:
    """Return the smooth trajectory, the frames that reach their targets, and its Newton steps."""
    articulation = skeleton if isinstance(skeleton, Articulation) else balls(skeleton)
    effectors = tuple(target.joint for target in targets)
    oriented = tuple(target.rotation is not None for target in targets)
    mechanism = prepare(articulation, effectors, oriented).mechanism
    columns = mechanism.columns
    on_target = np.asarray(motion.residual) <= ON_TARGET * mechanism.reach
    on_target &= np.asarray(motion.residual_rotation) <= ON_TARGET
    reached, steps = on_target | (np.asarray(motion.outcome) == Outcome.CONVERGED), 0
    q = motion.coordinates.reshape(-1, articulation.coordinate_count).copy()
    if mechanism.freedoms:
        own, rows = np.ascontiguousarray(q[:, columns]), target_rows(targets, (len(q),))
        with contextlib.suppress(np.linalg.LinAlgError), np.errstate(all="ignore"):
            q[:, columns] = np.nan  # remains where the linear algebra meets infinity
            q[:, columns], steps = trajectory.smooth(mechanism, rows, own, reached, closed)
    if not np.abs(q).max(initial=0.0) <= LARGEST_COORDINATE:
        raise FloatingPointError(
            f"track: the smooth trajectory left the numbers up to {LARGEST_COORDINATE:g}"
        )
    return q.reshape(motion.coordinates.shape), reached, steps


def _finished(
    skeleton: Skeleton | Articulation,
    motion: problem.IKSolution,
    targets: list[problem.CheckedTarget],
    q: FloatArray,
    reached: np.ndarray,
    steps: int,
    settings: problem.Settings,
) -> problem.IKSolution:
    """Return the motion q with its residuals; frames that missed the tolerance are solved again."""
    limits = settings.limits._replace(chained=False)
    unchained = replace(settings, limits=limits, record=False)
    unmoved = replace(unchained, limits=limits._replace(max_iterations=0, far_iterations=0))
    last = solve_checked(skeleton, q, targets, unmoved)
    unsolved = np.flatnonzero(reached & (last.outcome != Outcome.CONVERGED))
    iterations = np.asarray(motion.iterations) + steps
    if len(unsolved):
        parts = [target.mapped(lambda values: values[unsolved]) for target in targets]
        solution = solve_checked(skeleton, q[unsolved], parts, unchained)
        q[unsolved] = solution.coordinates
        iterations[unsolved] += solution.iterations
        last = solve_checked(skeleton, q, targets, unmoved)
    outcome = np.where(reached | (last.outcome == Outcome.CONVERGED), last.outcome, motion.outcome)
    return last._replace(
        iterations=arguments.frozen(iterations),
        outcome=arguments.frozen(outcome),
        history=motion.history,
    )
