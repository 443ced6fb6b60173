"""Inverse kinematics: local rotations or coordinates that bring effectors to targets."""

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FloatArray, frozen
from ..articulation import Articulation, one_batch
from ..backend.compiled import TwoSpeeds, bind
from ..backend.threads import in_slices
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .alone import NO_HISTORY, finished, solve_alone
from .batch import (
    ITERATIONS,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_ROTATION,
    Solved,
    iterate,
    solve_batch,
    solve_given,
)
from .ccd import ccd_sweep, ccd_update
from .damped_least_squares import damped_least_squares_sweep, damped_least_squares_update
from .fabrik import fabrik_sweep, fabrik_update
from .jacobian_transpose import jacobian_transpose_sweep, jacobian_transpose_update
from .levenberg_marquardt import levenberg_marquardt_sweep, levenberg_marquardt_update
from .mechanism import ROTATION, WEIGHT
from .problem import IKSolution, Target, Wanted, check_numbers, checked_targets
from .reduce import prepare
from .restarts import Answers, answer_batch, answer_given, attempt, attempts

__all__ = ["IK_SOLVERS", "IKSolution", "Outcome", "Target", "solve_ik"]


class IKSolver(NamedTuple):
    """A solver's two kernels.

    Attributes:
        chain: for one position to reach by a chain of unlimited balls.
        mechanism: for all else.
    """

    chain: TwoSpeeds
    mechanism: TwoSpeeds


def _solver(name, sweep, update) -> IKSolver:
    chains = bind(solve_batch, iterate=bind(iterate, sweep=sweep))
    many = bind(attempts, attempt=bind(attempt, update=update))
    mechanisms = bind(answer_batch, attempts=many)
    return IKSolver(
        TwoSpeeds(bind(solve_given, solve_batch=chains), label=f"{name} for chains"),
        TwoSpeeds(bind(answer_given, answer_batch=mechanisms), label=f"{name} for mechanisms"),
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


class Settings(NamedTuple):
    """Settings of a solve, checked."""

    solver: IKSolver
    tolerance: float
    tolerance_rotation: float
    max_iterations: int
    restarts: int
    seed: int
    record: bool
    chained: bool = False


def solve_ik(
    skeleton: Skeleton | Articulation,
    local_rotations: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    solver: str = "fabrik",
    effector: int | str = -1,
    *,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int = 100,
    restarts: int = 0,
    seed: int = 0,
    record: bool = False,
) -> IKSolution:
    """Return the pose that brings effectors to targets, from a start pose.

    The root of a Skeleton turns but does not move. Joints that move no effector keep their
    rotation, as does an effector whose own rotation is not asked for. An answer is always given;
    `outcome` says what it is. A start that is stuck, such as a straight chain whose target lies on
    its own line, is first bent, always in the same way. Limits are kept; a start outside of them
    is brought within.

    Args:
        skeleton: the tree; an Articulation for joints of other kinds and for limits.
        local_rotations: the start, unit quaternions, shape (..., joint, 4); of an Articulation its
            coordinates, (..., coordinate).
        target: global position [m], shape (..., 3), a Target, or several for several effectors.
            Leading axes broadcast with those of the start: a batch.
        solver: a name in IK_SOLVERS.
        effector: the joint that is to reach a position given alone, by index or name.
        tolerance: distance that counts as reached [m].
        tolerance_rotation: angle that counts as reached [rad].
        max_iterations: the most to make, of each attempt.
        restarts: how many further attempts to make from random poses, until one reaches the target.
        seed: of those poses.
        record: keep the residuals of all iterations in `history`.

    Raises:
        ValueError: if an argument has another shape or is not finite, a quaternion is further than
            1e-6 from unit length, a number is out of range, or a name unknown.
    """
    settings = checked_settings(
        solver, tolerance, tolerance_rotation, max_iterations, restarts, seed, record
    )
    alone = solve_alone(skeleton, local_rotations, target, effector, settings)
    return alone or solve_targets(skeleton, local_rotations, target, effector, settings)


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
    return Settings(
        IK_SOLVERS[arguments.choice("solver", solver, IK_SOLVERS)],
        arguments.number("tolerance", tolerance, least=0.0),
        arguments.number("tolerance_rotation", tolerance_rotation, least=0.0),
        arguments.integer("max_iterations", max_iterations, least=0),
        arguments.integer("restarts", restarts, least=0),
        arguments.integer("seed", seed, least=0),
        record,
        chained,
    )


_known_settings = functools.lru_cache(maxsize=64, typed=True)(_settings)


def solve_targets(
    model: Skeleton | Articulation,
    start: ArrayLike,
    target: ArrayLike | Target | Sequence[Target],
    effector: int | str,
    settings: Settings,
) -> IKSolution:
    """Return what `solve_ik` does; if chained, each solve starts from the one before."""
    if not isinstance(model, Skeleton | Articulation):
        raise ValueError(
            f"skeleton: expected a Skeleton or an Articulation, got {type(model).__name__}"
        )
    wanted = checked_targets(model, target, effector)
    one_position = len(wanted) == 1 and wanted[0].rotation is None
    if isinstance(model, Skeleton) and one_position and not settings.restarts:
        return _solve_chains(model, start, wanted[0], settings)
    return _solve_mechanisms(model, start, wanted, settings)


def _solve_chains(
    skeleton: Skeleton, start: ArrayLike, wanted: Wanted, settings: Settings
) -> IKSolution:
    starts = arguments.floats("local_rotations", start, "...", skeleton.joint_count, 4)
    batch = _batch_shape(starts.shape[:-2], wanted.position.shape[:-1])
    targets = arguments.spread(wanted.position, (*batch, 3)).reshape(-1, 3)
    solved = Solved(
        np.empty((len(targets), skeleton.joint_count, 4)),
        np.empty((len(targets), skeleton.joint_count, 3)),
        np.empty((len(targets), 4)),
        _history(len(targets), settings.max_iterations, settings),
    )
    fine = _run(
        settings.solver.chain,
        (*skeleton.arrays, skeleton.path_array(wanted.joint)),
        (_in_turn(starts, batch, 2), targets),
        (settings.tolerance, settings.max_iterations, settings.chained),
        solved,
        LEAST_ON_CHAINS,
    )
    if not fine:  # raise, or the lengths were on the very edge of the tolerance
        check_numbers([wanted])
        return _solve_chains(skeleton, rotation.unit("local_rotations", start), wanted, settings)
    return _solution(solved.local, solved.local, solved, batch, settings)


def _solve_mechanisms(
    model: Skeleton | Articulation, start: ArrayLike, wanted: list[Wanted], settings: Settings
) -> IKSolution:
    articulation = balls(model) if isinstance(model, Skeleton) else model
    if isinstance(model, Skeleton):
        rotations = arguments.floats("local_rotations", start, "...", model.joint_count, 4)
        start = rotations.reshape(*rotations.shape[:-2], -1)
    starts = arguments.floats("local_rotations", start, "...", articulation.coordinate_count)
    effectors = tuple([one.joint for one in wanted])
    oriented = tuple([one.rotation is not None for one in wanted])
    prepared = prepare(articulation, effectors, oriented, settings.restarts, settings.seed)
    batch = batch_of(starts.shape[:-1], wanted)
    goals = goals_of(wanted, batch)
    answers = _no_answers(len(goals), articulation, settings)
    fine = _run(
        settings.solver.mechanism,
        prepared.flat,
        (_in_turn(starts, batch, 1), goals),
        (
            settings.tolerance, settings.tolerance_rotation, settings.max_iterations,
            prepared.restarts, prepared.tips, settings.chained,
        ),
        answers,
        LEAST,
    )  # fmt: skip
    if not fine:  # likewise
        wanted = check_numbers(wanted)
        again = articulation.checked("local_rotations", starts)
        if isinstance(model, Skeleton):
            again = again.reshape(*again.shape[:-1], -1, 4)
        return _solve_mechanisms(model, again, wanted, settings)
    if isinstance(model, Skeleton):
        local = answers.q.reshape(answers.local.shape)
        return _solution(local, local, answers, batch, settings)
    return _solution(answers.local, answers.q, answers, batch, settings)


def _run(
    kernel: TwoSpeeds,
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
        np.empty((count, 4)),
        _history(count, settings.max_iterations * (settings.restarts + 2), settings),
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


def _batch_shape(starts: tuple[int, ...], targets: tuple[int, ...]) -> tuple[int, ...]:
    if not starts or not targets:
        return starts or targets
    try:
        return np.broadcast_shapes(starts, targets)
    except ValueError:
        raise ValueError(
            f"target: expected leading axes that broadcast with those of local_rotations, "
            f"{arguments.shape(starts)}, got {arguments.shape(targets)}"
        ) from None


def batch_of(starts: tuple[int, ...], wanted: list[Wanted]) -> tuple[int, ...]:
    """Return the leading axes of starts and targets, broadcast against one another."""
    batch = starts
    for one in wanted:
        if one.position.ndim == 1 and (one.rotation is None or one.rotation.ndim == 1):
            continue
        batch = _batch_shape(batch, one.position.shape[:-1])
        if one.rotation is not None:
            batch = _batch_shape(batch, one.rotation.shape[:-1])
    return batch


def _in_turn(starts: FloatArray, batch: tuple[int, ...], axes: int) -> FloatArray:
    """Return the starts as rows that the targets of a batch take in turn."""
    if starts.ndim > axes:
        starts = arguments.spread(starts, (*batch, *starts.shape[-axes:]))
    return one_batch(starts, axes)


def _history(targets: int, iterations: int, settings: Settings) -> FloatArray:
    return np.empty((targets, iterations + 1) if settings.record else (1, 1))


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
        history = solved.history[:, : int(figures[:, ITERATIONS].max(initial=0.0)) + 1]
    if batch:
        return IKSolution(
            _shaped(local, batch), _shaped(solved.positions, batch),
            _shaped(figures[:, RESIDUAL].copy(), batch),
            _shaped(figures[:, ITERATIONS].astype(np.int64), batch),
            _shaped(figures[:, OUTCOME].astype(np.int64), batch),
            _shaped(history, batch) if settings.record else NO_HISTORY,
            _shaped(figures[:, RESIDUAL_ROTATION].copy(), batch),
            _shaped(coordinates, batch),
        )  # fmt: skip
    one = frozen(history[0]) if settings.record else NO_HISTORY
    return finished(local, solved.positions, figures, one, coordinates)


def _shaped(values: Any, batch: tuple[int, ...]) -> Any:
    return frozen(values.reshape(batch + values.shape[1:]))
