"""Inverse kinematics: local rotations or coordinates that bring effectors to targets."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, IndexArray, frozen
from ..articulation import Articulation, one_batch
from ..backend.compiled import Kernel, bind
from ..backend.threads import in_slices
from ..model import Model, checked_model, coordinates_name
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .alone import NO_HISTORY, finished, solve_alone
from .batch import (
    EXCESS,
    FIGURES,
    ITERATIONS,
    MERIT,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_ROTATION,
    Solved,
    iterate,
    iterate_periods,
    solve_batch,
    solve_given,
)
from .ccd import ccd_sweep, ccd_update
from .damped_least_squares import damped_least_squares_sweep, damped_least_squares_update
from .fabrik import fabrik_sweep, fabrik_update
from .jacobian_transpose import jacobian_transpose_sweep, jacobian_transpose_update
from .levenberg_marquardt import levenberg_marquardt_sweep, levenberg_marquardt_update
from .mechanism import ROTATION, WEIGHT
from .problem import (
    IKSolution,
    Target,
    Wanted,
    are_targets,
    check_numbers,
    checked_targets,
)
from .reduce import prepare
from .restarts import Answers, answer_batch, answer_given, attempt, attempts

__all__ = ["IK_SOLVERS", "IKSolution", "Outcome", "Target", "solve_ik"]


class IKSolver(NamedTuple):
    """A solver's two kernels.

    Attributes:
        chain: for one position to reach by a chain of unlimited balls.
        mechanism: for all else.
    """

    chain: Kernel
    mechanism: Kernel


def _solver(name, sweep, update) -> IKSolver:
    periods = bind(iterate_periods, iterate=bind(iterate, sweep=sweep))
    chains = bind(solve_batch, iterate_periods=periods)
    many = bind(attempts, attempt=bind(attempt, update=update))
    mechanisms = bind(answer_batch, attempts=many)
    return IKSolver(
        Kernel(bind(solve_given, solve_batch=chains), label=f"{name} for chains"),
        Kernel(bind(answer_given, answer_batch=mechanisms), label=f"{name} for mechanisms"),
    )


_SWEEPS_AND_UPDATES = {
    "ccd": (ccd_sweep, ccd_update),
    "fabrik": (fabrik_sweep, fabrik_update),
    "levenberg_marquardt": (levenberg_marquardt_sweep, levenberg_marquardt_update),
    "damped_least_squares": (damped_least_squares_sweep, damped_least_squares_update),
    "jacobian_transpose": (jacobian_transpose_sweep, jacobian_transpose_update),
}
IK_SOLVERS = {name: _solver(name, *kernels) for name, kernels in _SWEEPS_AND_UPDATES.items()}


# Targets in a slice of a batch: fewer are not worth a thread, on a chain and on a mechanism.
LEAST_ON_CHAINS, LEAST = 128, 16
# The defaults of `solve_ik`: iterations of an attempt, the same towards a target out of reach, and
# restarts where the solver is left to us and is not FABRIK.
MAX_ITERATIONS, FAR_ITERATIONS, RESTARTS = 100, 2000, 20


class Settings(NamedTuple):
    """Settings of a solve, checked."""

    solver: IKSolver
    tolerance: float
    tolerance_rotation: float
    max_iterations: int
    far_iterations: int
    restarts: int
    seed: int
    record: bool
    chained: bool = False


def solve_ik(
    skeleton: Model,
    local_rotations: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    solver: str | None = None,
    effector: int | str | None = None,
    *,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int | None = None,
    restarts: int | None = None,
    seed: int = 0,
    record: bool = False,
) -> IKSolution:
    """Return the pose that brings effectors to targets, from a start pose.

    The root of a Skeleton turns but does not move. Joints that move no effector keep their
    rotation, as does an effector whose own rotation is not asked for. An answer is always given;
    `outcome` says what it is. A start that is stuck, such as a straight chain whose target lies on
    its own line, is first bent, always in the same way. Limits are kept; a start outside of them
    is brought within.

    Restarts never make an answer worse: what is reached with fewer is reached with more, and where
    none reaches the target the merit does not grow with their number. It is no greater either than
    that of one attempt given (1 + restarts) `max_iterations` at once. Attempts within the
    tolerances are equally good. To that end an attempt that was given up early is finished if no
    other reaches the target, and the first goes on for as many iterations as all may make: up to
    (1 + 2 restarts) `max_iterations` in all, for one position on a Skeleton (2 + 3 restarts).

    Args:
        skeleton: the tree; an Articulation for joints of other kinds and for limits, or a Robot
            read from a file.
        local_rotations: the start, unit quaternions, shape (..., joint, 4); of an Articulation its
            coordinates q, (..., coordinate).
        target: global position [m], shape (..., 3), a Target, or several for several effectors.
            Leading axes broadcast with those of the start: a batch.
        solver: a name in IK_SOLVERS. By default FABRIK for one position on a Skeleton, which it
            reaches soonest, and else Levenberg-Marquardt.
        effector: the joint that is to reach a position given without one, by index or name. By
            default the last joint of a Skeleton, and the only tip of an Articulation.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: the most to make, of each attempt; by default 100, but 2,000 where geometry
            proves the target out of reach, so that most solves settle: within the tolerance of
            the nearest point, or with no more progress.
        restarts: how many further attempts to make from random poses, until one reaches the target.
            By default 20 where the solver is the default Levenberg-Marquardt, else 0.
        seed: of those poses.
        record: keep the residuals of all iterations in `history`.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion is further than
            1e-6 from unit length, a number is out of range, a name unknown, or an Articulation has
            several tips and no effector is named.
    """
    if solver is None:
        solver, most = default_solver(skeleton, target)
        restarts = most if restarts is None else restarts
    settings = checked_settings(
        solver, tolerance, tolerance_rotation, max_iterations,
        0 if restarts is None else restarts, seed, record,
    )  # fmt: skip
    alone = solve_alone(skeleton, local_rotations, target, effector, settings)
    return alone or solve_targets(skeleton, local_rotations, target, effector, settings)


def default_solver(model: Any, target: Any) -> tuple[str, int]:
    """Return the solver and the restarts that suit a model and its target."""
    one = target[0] if are_targets(target) and len(target) == 1 else target
    several = are_targets(one)
    posed = isinstance(one, Target) and one.rotation is not None
    if isinstance(model, Skeleton) and not (several or posed):
        return "fabrik", 0
    return "levenberg_marquardt", RESTARTS


def checked_settings(*given: Any) -> Settings:
    """Return the settings, of which the same are often asked for again.

    Raises:
        ValueError: if one is out of range or unknown.
    """
    try:
        return _known_settings(*given)
    except TypeError:  # one has no hash, and so is no number or name
        return _settings(*given)


def _settings(
    solver: Any, tolerance: Any, tolerance_rotation: Any, max_iterations: Any,
    restarts: Any, seed: Any, record: bool, chained: bool = False,
) -> Settings:  # fmt: skip
    near, far = MAX_ITERATIONS, FAR_ITERATIONS
    if max_iterations is not None:
        near = far = arguments.integer("max_iterations", max_iterations, least=0)
    return Settings(
        IK_SOLVERS[arguments.choice("solver", solver, IK_SOLVERS)],
        arguments.number("tolerance", tolerance, least=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, least=0.0),
        near,
        far,
        arguments.integer("restarts", restarts, least=0),
        arguments.integer("seed", seed, least=0),
        arguments.boolean("record", record),
        chained,
    )


_known_settings = functools.lru_cache(maxsize=64, typed=True)(_settings)


def solve_targets(
    model: Model,
    start: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    effector: int | str | None,
    settings: Settings,
) -> IKSolution:
    """Return what `solve_ik` does; if chained, each solve starts from the one before."""
    model = checked_model(model)
    wanted = checked_targets(model, target, effector)
    if isinstance(model, Articulation) or len(wanted) > 1 or wanted[0].rotation is not None:
        return _solve_mechanisms(model, start, wanted, settings)
    found = _solve_chains(model, start, wanted[0], settings)
    return _restarted(model, start, wanted, found, settings) if settings.restarts else found


def _solve_chains(
    skeleton: Skeleton, start: ArrayLike, wanted: Wanted, settings: Settings
) -> IKSolution:
    starts = arguments.floats("local_rotations", start, "...", skeleton.joint_count, 4)
    batch = _batch_shape("local_rotations", starts.shape[:-2], wanted.position.shape[:-1])
    targets = arguments.spread(wanted.position, (*batch, 3)).reshape(-1, 3)
    periods = settings.restarts + 1
    solved = Solved(
        np.empty((len(targets), skeleton.joint_count, 4)),
        np.empty((len(targets), skeleton.joint_count, 3)),
        np.empty((len(targets), len(FIGURES))),
        _history(len(targets), periods, settings),
    )
    fine = _run(
        settings.solver.chain,
        (*skeleton.arrays, skeleton.path_array(wanted.joint)),
        (_in_turn(starts, batch, 2), targets),
        (
            settings.tolerance, settings.max_iterations, settings.far_iterations, periods,
            settings.chained,
        ),
        solved,
        LEAST_ON_CHAINS,
    )  # fmt: skip
    if not fine:  # raise, or the lengths were on the very edge of the tolerance
        check_numbers([wanted])
        return _solve_chains(skeleton, rotation.unit("local_rotations", start), wanted, settings)
    return _solution(solved.local, solved.local, solved, batch, settings)


def _restarted(
    skeleton: Skeleton,
    start: ArrayLike,
    wanted: list[Wanted],
    found: IKSolution,
    settings: Settings,
) -> IKSolution:
    """Return the better of what one start and restarts find, where that is not reached or nearest.

    One start on a chain of unlimited balls has already had the iterations of all attempts.
    """
    settled = [int(Outcome.CONVERGED), int(Outcome.UNREACHABLE)]
    if np.isin(found.outcome, settled).all():
        return found
    more = _solve_mechanisms(skeleton, start, wanted, settings)
    open_ = ~np.isin(found.outcome, settled)
    reached = np.asarray(more.outcome) == Outcome.CONVERGED
    better = open_ & (reached | (np.asarray(more.merit) < found.merit))
    iterations = found.iterations + np.where(open_, more.iterations, 0)
    rows = [_chosen(better, a, b) for a, b in zip(found, more, strict=True)]
    best = IKSolution(*rows)._replace(history=_joined(found, more, open_, settings))
    if np.ndim(found.outcome) == 0:
        return best._replace(
            residual=float(best.residual), residual_rotation=float(best.residual_rotation),
            merit=float(best.merit), excess=float(best.excess),
            outcome=Outcome(int(best.outcome)), iterations=int(iterations),
        )  # fmt: skip
    return best._replace(iterations=frozen(iterations))


def _chosen(better: np.ndarray, one: Any, other: Any) -> Any:
    """Return rows of the other where it is better, read-only; a history is joined elsewhere."""
    one, other = np.asarray(one), np.asarray(other)
    if one.shape != other.shape:
        return one
    where = better.reshape(better.shape + (1,) * (one.ndim - better.ndim))
    return frozen(np.where(where, other, one))


def _joined(
    found: IKSolution, more: IKSolution, open_: np.ndarray, settings: Settings
) -> FloatArray:
    """Return the residuals of one start and then those of its restarts."""
    if not settings.record:
        return NO_HISTORY
    made, further = np.asarray(found.iterations), np.where(open_, more.iterations, 0)
    count = np.arange(int((made + further).max(initial=0)) + 1)
    first = np.minimum(count, made[..., None])
    second = np.clip(count - made[..., None], 0, further[..., None])
    one = np.take_along_axis(found.history, first, axis=-1)
    return frozen(np.where(second > 0, np.take_along_axis(more.history, second, axis=-1), one))


def _solve_mechanisms(
    model: Skeleton | Articulation, start: ArrayLike, wanted: list[Wanted], settings: Settings
) -> IKSolution:
    articulation = balls(model) if isinstance(model, Skeleton) else model
    if isinstance(model, Skeleton):
        rotations = arguments.floats("local_rotations", start, "...", model.joint_count, 4)
        start = rotations.reshape(*rotations.shape[:-2], 4 * model.joint_count)
    name = coordinates_name(model)
    starts = arguments.floats(name, start, "...", articulation.coordinate_count)
    effectors = tuple([one.joint for one in wanted])
    oriented = tuple([one.rotation is not None for one in wanted])
    prepared = prepare(articulation, effectors, oriented, settings.restarts, settings.seed)
    batch = batch_of(starts.shape[:-1], wanted, name)
    goals = goals_of(wanted, batch)
    answers = _no_answers(len(goals), articulation, settings)
    fine = _run(
        settings.solver.mechanism,
        prepared.flat,
        (_in_turn(starts, batch, 1), goals),
        (
            settings.tolerance, settings.tolerance_rotation, settings.max_iterations,
            settings.far_iterations, prepared.restarts, prepared.tips, settings.chained,
        ),
        answers,
        LEAST,
    )  # fmt: skip
    if not fine:  # likewise
        wanted = check_numbers(wanted)
        again = articulation.checked(name, starts)
        if isinstance(model, Skeleton):
            again = again.reshape(*again.shape[:-1], model.joint_count, 4)
        return _solve_mechanisms(model, again, wanted, settings)
    if isinstance(model, Skeleton):
        local = answers.q.reshape(answers.local.shape)
        return _solution(local, local, answers, batch, settings)
    return _solution(answers.local, answers.q, answers, batch, settings)


def _run(
    kernel: Kernel,
    model: tuple[Any, ...],
    given: tuple[FloatArray, FloatArray],
    rest: tuple[Any, ...],
    filled: Solved | Answers,
    least: int,
) -> bool:
    """Run a kernel on starts and targets, on all cores where they do not depend on one another."""
    count, chained = len(given[1]), rest[-1]
    if chained or count < 2 * least:
        return kernel(*model, *given, *rest, *filled)
    return all(
        in_slices(
            kernel,
            count,
            lambda part: (
                *model, *[_part(rows, part) for rows in given],
                *rest, *[_part(rows, part) for rows in filled],
            ),
            least=least,
        )
    )  # fmt: skip


def _part(rows: FloatArray, part: slice) -> FloatArray:
    """Return a part of the rows, or the only one, which serves all targets."""
    return rows if len(rows) == 1 else rows[part]


def _no_answers(count: int, articulation: Articulation, settings: Settings) -> Answers:
    return Answers(
        np.empty((count, articulation.coordinate_count)),
        np.empty((count, articulation.joint_count, 4)),
        np.empty((count, articulation.joint_count, 3)),
        np.empty((count, len(FIGURES))),
        _history(count, 2 * settings.restarts + 1, settings),
    )


def balls(skeleton: Skeleton) -> Articulation:
    """Return the skeleton as an Articulation of unlimited balls, made once and kept by it."""
    kept = skeleton.__dict__
    if "balls" not in kept:
        kept["balls"] = Articulation(skeleton, "ball")
    return kept["balls"]


def goals_of(wanted: list[Wanted], batch: tuple[int, ...]) -> FloatArray:
    """Return what the kernels want to know of the targets, (target, effector, 8).

    Weights count beside one another, so that the largest may be one.
    """
    heaviest = max(one.weight for one in wanted)
    goals = np.empty((*batch, len(wanted), 8))
    for e, one in enumerate(wanted):
        goal = goals[..., e, :]
        goal[..., :ROTATION] = one.position
        goal[..., ROTATION:WEIGHT] = IDENTITY if one.rotation is None else one.rotation
        goal[..., WEIGHT] = one.weight / heaviest
    return goals.reshape(-1, len(wanted), 8)


def _batch_shape(name: str, starts: tuple[int, ...], targets: tuple[int, ...]) -> tuple[int, ...]:
    if not starts or not targets:
        return starts or targets
    try:
        return np.broadcast_shapes(starts, targets)
    except ValueError:
        raise ValueError(
            f"target: expected leading axes that broadcast with those of {name}, "
            f"{arguments.shape(starts)}, got {arguments.shape(targets)}"
        ) from None


def batch_of(starts: tuple[int, ...], wanted: list[Wanted], name: str) -> tuple[int, ...]:
    """Return the leading axes of starts and targets, broadcast against one another.

    The name is that of the starts, for the error.
    """
    batch = starts
    for one in wanted:
        if one.position.ndim == 1 and (one.rotation is None or one.rotation.ndim == 1):
            continue
        batch = _batch_shape(name, batch, one.position.shape[:-1])
        if one.rotation is not None:
            batch = _batch_shape(name, batch, one.rotation.shape[:-1])
    return batch


def _in_turn(starts: FloatArray, batch: tuple[int, ...], axes: int) -> FloatArray:
    """Return the starts as rows that the targets of a batch take in turn."""
    if starts.ndim > axes:
        starts = arguments.spread(starts, (*batch, *starts.shape[-axes:]))
    return one_batch(starts, axes)


def _history(targets: int, attempts: int, settings: Settings) -> FloatArray:
    most = attempts * max(settings.max_iterations, settings.far_iterations)
    return np.empty((targets, most + 1) if settings.record else (1, 1))


def _repeated(history: FloatArray, iterations: IndexArray) -> FloatArray:
    """Return the rows up to the longest, each continued by its last residual."""
    count = np.arange(int(iterations.max(initial=0)) + 1)
    return np.take_along_axis(history, np.minimum(count, iterations[:, None]), axis=1)


def _solution(
    local: FloatArray,
    coordinates: FloatArray,
    solved: Solved | Answers,
    batch: tuple[int, ...],
    settings: Settings,
) -> IKSolution:
    """Return what the kernel filled in as a solution, in the shape of the batch."""
    figures, history = solved.figures, NO_HISTORY
    if settings.record:
        history = _repeated(solved.history, figures[:, ITERATIONS].astype(np.int64))
    if batch:
        return IKSolution(
            _shaped(local, batch), _shaped(solved.positions, batch),
            _shaped(figures[:, RESIDUAL].copy(), batch),
            _shaped(figures[:, ITERATIONS].astype(np.int64), batch),
            _shaped(figures[:, OUTCOME].astype(np.int64), batch),
            _shaped(history, batch) if settings.record else NO_HISTORY,
            _shaped(figures[:, RESIDUAL_ROTATION].copy(), batch),
            _shaped(coordinates, batch),
            _shaped(figures[:, MERIT].copy(), batch),
            _shaped(figures[:, EXCESS].copy(), batch),
        )  # fmt: skip
    one = frozen(history[0]) if settings.record else NO_HISTORY
    return finished(local, solved.positions, figures, one, coordinates)


def _shaped(values: Any, batch: tuple[int, ...]) -> Any:
    return frozen(values.reshape(batch + values.shape[1:]))
