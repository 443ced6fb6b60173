"""From checked arguments to the kernels of a solver, and from what they fill to a solution."""

from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import LARGEST_COORDINATE, FloatArray, IndexArray, RecordArray, frozen
from ..articulation import Articulation, one_batch
from ..backend.compiled import Kernel
from ..backend.threads import in_slices
from ..model import coordinates_name
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .mechanism import TARGET
from .problem import CheckedTarget, IKSolution, check_numbers
from .reduce import prepare
from .result import EXCESS, FIGURES, ITERATIONS, MERIT, OUTCOME, RESIDUAL, RESIDUAL_ROTATION, Result
from .settings import Settings

# Targets in a slice of a batch: fewer are not worth a thread, on a chain and on a mechanism.
LEAST_ON_CHAINS, LEAST = 128, 16
OUTCOMES = {outcome.value: outcome for outcome in Outcome}
LARGEST_HISTORY = 10**9  # residuals; more fit no memory
NO_HISTORY = frozen(np.empty(0))
UNRECORDED = np.empty((1, 1))  # where kernels may write a history that nobody reads


def solve_checked(
    model: Skeleton | Articulation,
    start: ArrayLike,
    targets: list[CheckedTarget],
    settings: Settings,
) -> IKSolution:
    """Return what `solve_ik` does for targets that are checked but for their numbers.

    If the settings are chained, each solve starts from the one before.
    """
    if isinstance(model, Articulation) or len(targets) > 1 or targets[0].rotation is not None:
        return solve_on_mechanism(model, start, targets, settings)
    found = solve_on_chain(model, start, targets[0], settings)
    return _restarted(model, start, targets, found, settings) if settings.limits.restarts else found


def solve_on_chain(
    skeleton: Skeleton, start: ArrayLike, target: CheckedTarget, settings: Settings
) -> IKSolution:
    """Solve for one position on the chain of balls from the root to the effector."""
    count, name = skeleton.joint_count, "local_rotations"
    starts = arguments.floats(name, start, "...", count, 4)
    batch = batch_shape(starts.shape[:-2], [target], name)
    target_array = target.position[None]
    if batch:
        target_array = arguments.spread(target.position, (*batch, 3)).reshape(-1, 3)
    n, figures = len(target_array), np.empty((len(target_array), len(FIGURES)))
    local, positions = np.empty((n, count, 4)), np.empty((n, count, 3))
    history = _new_history(n, settings.limits.restarts + 1, settings)
    model = (*skeleton.arrays, skeleton.path_array(target.joint))
    rows = _rows(starts, batch, 2), target_array, local, positions, figures, history
    if not _run(settings.solver.chain, model, settings, rows, LEAST_ON_CHAINS):
        _raise_invalid(skeleton, start, [target], settings)
    return _solution(Result(local, positions, figures, history, local), batch, settings)


def solve_on_mechanism(
    model: Skeleton | Articulation,
    start: ArrayLike,
    targets: list[CheckedTarget],
    settings: Settings,
) -> IKSolution:
    """Solve for any targets on the mechanism of the joints that move their effectors."""
    name = coordinates_name(model)
    if isinstance(model, Skeleton):
        articulation = balls(model)
        starts = arguments.floats(name, start, "...", model.joint_count, 4)
        starts = starts.reshape(*starts.shape[:-2], 4 * model.joint_count)
    else:
        articulation = model
        starts = arguments.floats(name, start, "...", model.coordinate_count)
    effectors = tuple([one.joint for one in targets])
    oriented = tuple([one.rotation is not None for one in targets])
    restarts = settings.limits.restarts
    prepared = prepare(articulation, effectors, oriented, restarts, settings.seed)
    batch = batch_shape(starts.shape[:-1], targets, name)
    target_array, count = target_rows(targets, batch), articulation.joint_count
    n = len(target_array)
    result = Result(
        np.empty((n, count, 4)),
        np.empty((n, count, 3)),
        np.empty((n, len(FIGURES))),
        _new_history(n, 2 * restarts + 1, settings),
        np.empty((n, articulation.coordinate_count)),
    )
    rows = (_rows(starts, batch, 1), target_array, *result)
    if not _run(settings.solver.mechanism, prepared.flat, settings, rows, LEAST):
        _raise_invalid(model, start, targets, settings)
    if isinstance(model, Skeleton):
        local = result.coordinates.reshape(result.local.shape)
        result = result._replace(local=local, coordinates=local)
    return _solution(result, batch, settings)


def _run(
    kernel: Kernel,
    model: tuple[Any, ...],
    settings: Settings,
    rows: tuple[np.ndarray, ...],
    least: int,
) -> bool:
    """Run a kernel on starts, targets and results; return whether all numbers were valid.

    Solves that do not depend on one another are spread over the cores.
    """
    count = len(rows[1])
    if count < 2 * least or settings.limits.chained:
        return kernel(*model, settings.numbers, *rows)
    valid = in_slices(
        kernel,
        count,
        lambda part: (*model, settings.numbers, *[_part(row, part) for row in rows]),
        least=least,
    )
    return all(valid)


def _part(rows: np.ndarray, part: slice) -> np.ndarray:
    """Return a part of the rows, or the only one, which serves all targets."""
    return rows if len(rows) == 1 else rows[part]


def _raise_invalid(
    model: Skeleton | Articulation,
    start: ArrayLike,
    targets: list[CheckedTarget],
    settings: Settings,
) -> NoReturn:
    """Raise a ValueError that names the number which a kernel has refused.

    Raises:
        FloatingPointError: if it is of a frame from which the next one starts.
    """
    check_numbers(targets)
    name = coordinates_name(model)
    if isinstance(model, Articulation):
        model.checked(name, start)
    else:
        rotation.unit(name, start)
    if settings.limits.chained:
        raise FloatingPointError(f"track: a frame left the numbers up to {LARGEST_COORDINATE:g}")
    raise ValueError(f"{name}: expected quaternions within 1e-6 of unit length, got one just off")


def balls(skeleton: Skeleton) -> Articulation:
    """Return the skeleton as an Articulation of unlimited balls, made once and kept by it."""
    kept = skeleton.__dict__
    if "balls" not in kept:
        kept["balls"] = Articulation(skeleton, "ball")
    return kept["balls"]


def target_rows(targets: list[CheckedTarget], batch: tuple[int, ...]) -> RecordArray:
    """Return targets as the kernels take them, records TARGET, (target, effector).

    Weights count beside one another, so that the largest may be one.
    """
    count, heaviest = len(targets), max([one.weight for one in targets])
    rows = np.empty((*batch, count), TARGET)
    for e, one in enumerate(targets):
        rows["position"][..., e, :] = one.position
        rows["rotation"][..., e, :] = IDENTITY if one.rotation is None else one.rotation
        rows["weight"][..., e] = one.weight / heaviest
    return rows.reshape(-1, count)


def batch_shape(
    starts: tuple[int, ...], targets: list[CheckedTarget], name: str
) -> tuple[int, ...]:
    """Return the leading axes of starts and targets, broadcast against one another.

    The name is that of the starts, for the error.
    """
    batch = starts
    for one in targets:
        for values in (one.position, one.rotation):
            if values is not None and values.ndim > 1:
                batch = arguments.broadcast(
                    "target", batch, values.shape[:-1], f"those of {name}, "
                )
    return batch


def _rows(starts: FloatArray, batch: tuple[int, ...], axes: int) -> FloatArray:
    """Return the starts as rows, of which the targets of a batch use one after the other."""
    if starts.ndim == axes:
        return starts[None]
    return one_batch(arguments.spread(starts, (*batch, *starts.shape[-axes:])), axes)


def _new_history(targets: int, attempts: int, settings: Settings) -> FloatArray:
    """Return rows for the residuals of all iterations that attempts may make."""
    if not settings.record:
        return UNRECORDED
    most = attempts * max(settings.limits.max_iterations, settings.limits.far_iterations)
    if targets * most > LARGEST_HISTORY:
        raise ValueError(
            f"max_iterations: expected at most {LARGEST_HISTORY:,} residuals to record, got "
            f"{targets} times {most}"
        )
    return np.empty((targets, most + 1))


def _solution(result: Result, batch: tuple[int, ...], settings: Settings) -> IKSolution:
    """Return what the kernel filled in as a solution, in the shape of the batch."""
    local, positions, figures, history, coordinates = result
    if settings.record:
        history = _repeated(history, figures[:, ITERATIONS].astype(np.int64))
    if batch:
        return _solutions(result._replace(history=history), batch, settings)
    shown = frozen(history[0]) if settings.record else NO_HISTORY
    return single_solution(local, positions, figures, shown, coordinates)


def single_solution(
    local: FloatArray,
    positions: FloatArray,
    figures: FloatArray,
    history: FloatArray,
    coordinates: FloatArray,
) -> IKSolution:
    """Return the solution of one target from the rows of one that a kernel has filled in."""
    shown, shown_positions = local[0], positions[0]
    shown.setflags(False)  # by its name it takes twice as long
    shown_positions.setflags(False)
    shown_coordinates = shown
    if coordinates is not local:
        shown_coordinates = coordinates[0]
        shown_coordinates.setflags(False)
    residual, angle, iterations, outcome, merit, excess = figures.tolist()[0]
    return IKSolution(
        shown, shown_positions, residual, int(iterations), OUTCOMES[outcome], history, angle,
        shown_coordinates, merit, excess,
    )  # fmt: skip


def _solutions(result: Result, batch: tuple[int, ...], settings: Settings) -> IKSolution:
    """Return the solutions of a batch."""
    figures = result.figures.T.copy()
    return IKSolution(
        _shaped(result.local, batch),
        _shaped(result.positions, batch),
        _shaped(figures[RESIDUAL], batch),
        _shaped(figures[ITERATIONS].astype(np.int64), batch),
        _shaped(figures[OUTCOME].astype(np.int64), batch),
        _shaped(result.history, batch) if settings.record else NO_HISTORY,
        _shaped(figures[RESIDUAL_ROTATION], batch),
        _shaped(result.coordinates, batch),
        _shaped(figures[MERIT], batch),
        _shaped(figures[EXCESS], batch),
    )


def _repeated(history: FloatArray, iterations: IndexArray) -> FloatArray:
    """Return the rows up to the longest, each continued by its last residual."""
    count = np.arange(int(iterations.max(initial=0)) + 1)
    return np.take_along_axis(history, np.minimum(count, iterations[:, None]), axis=1)


def _shaped(values: Any, batch: tuple[int, ...]) -> Any:
    return frozen(values.reshape(batch + values.shape[1:]))


def _restarted(
    skeleton: Skeleton,
    start: ArrayLike,
    targets: list[CheckedTarget],
    found: IKSolution,
    settings: Settings,
) -> IKSolution:
    """Return the better of what one start and restarts find, where a target in reach is missed.

    One start on a chain of unlimited balls has already had the iterations of all attempts. Towards
    a target out of reach it has one nearest point to come to, and no start comes to another.
    """
    final_outcomes = [outcome for outcome in Outcome if outcome.unreachable or outcome.solved]
    if np.isin(found.outcome, final_outcomes).all():
        return found
    more = solve_on_mechanism(skeleton, start, targets, settings)
    open_ = ~np.isin(found.outcome, final_outcomes)
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
    if one.shape != other.shape or not one.size:
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
