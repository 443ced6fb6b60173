"""From arguments to the kernels of a solver, and from their results to a solution.

`solve_checked` accepts anything. For a single start and target its own steps take as long as the
kernel, a third of a call on a chain of ten balls. `solve_plain` has fewer steps for float64 arrays
of the right shape, and leaves all else to `solve_checked`.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import (
    FLOAT64,
    LARGEST_COORDINATE,
    SMALLEST_POSITIVE,
    FloatArray,
    RecordArray,
    frozen,
    is_plain,
)
from ..articulation import Articulation, one_batch
from ..backend.compiled import Kernel
from ..backend.threads import in_slices
from ..model import coordinates_name, effector_of
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .mechanism import TARGET
from .problem import CheckedTarget, IKSolution, Settings, Target, check_numbers
from .reach import least_distance
from .reduce import prepare, store_prepared
from .restarts import FIGURES, ITERATIONS, MERIT, OUTCOME, Limits, Result

# Targets in a slice of a batch: fewer are not worth a thread, on a chain and on a mechanism.
SLICE_ON_CHAINS, SLICE_ON_MECHANISMS = 128, 16
OUTCOMES = {outcome.value: outcome for outcome in Outcome}
# Outcomes after which a chain is not restarted.
FINAL_OUTCOMES = [outcome for outcome in Outcome if outcome.unreachable or outcome.solved]
# Outcomes of failed solves, and their outcomes where a shell of reach proves every pose too far.
PROVEN = {
    Outcome.STALLED.value: Outcome.UNREACHABLE.value,
    Outcome.ITERATION_LIMIT.value: Outcome.UNREACHABLE_UNSETTLED.value,
}
LARGEST_HISTORY = 10**9  # residuals; more fit no memory
NO_HISTORY = frozen(np.empty(0))
UNRECORDED = np.empty((1, 1))  # where kernels may write a history that is not read
NAMES = (int, str, type(None))


def solve_plain(
    model: Any, start: Any, target: Any, effector: Any, settings: Settings
) -> IKSolution | None:
    """Return the solution for a single start and target, or None.

    None where the arguments are no float64 arrays of the right shape, or not valid.
    """
    position: Any = target
    rotation: Any = None
    if type(target) is Target:
        if effector is not None:
            return None
        position, rotation, effector, weight = target
        if type(weight) is not float or not SMALLEST_POSITIVE <= weight <= LARGEST_COORDINATE:
            return None
    if settings.record or type(effector) not in NAMES or not is_plain(position, (3,)):
        return None
    if type(model) is Skeleton and rotation is None and not settings.limits.restarts:
        count = model.joint_count
        if not is_plain(start, (count, 4)):
            return None
        joint = count - 1 if effector is None else model.index(effector, "effector")
        arrays = (*model.arrays, model.path_array(joint))
        filled = run(
            settings.solver.chain, arrays, start[None], position[None], count, None, settings
        )
        return _single_solution(NO_HISTORY, *filled) if filled else None
    is_valid = type(model) is Articulation and (rotation is None or is_plain(rotation, (4,)))
    if not is_valid or not is_plain(start, (model.coordinate_count,)):
        return None
    key = effector, rotation is not None, settings.limits.restarts, settings.seed
    prepared = model.mechanisms.get(key)
    if prepared is None:
        prepared = prepare(model, (effector_of(model, effector),), (key[1],), *key[2:])
        store_prepared(model, key, prepared)
    targets = np.empty((1, 1), TARGET)
    row = targets.view(FLOAT64)[0]  # of its fields one after the other
    row[:3], row[3:7], row[7] = position, IDENTITY if rotation is None else rotation, 1.0
    filled = run(
        settings.solver.mechanism, (prepared.model,), start[None], targets, model.joint_count,
        model.coordinate_count, settings,
    )  # fmt: skip
    if filled and filled[2].item(OUTCOME) in PROVEN:
        joints = (effector_of(model, effector),)
        prove_unreachable(model, joints, (key[1],), targets, filled[2], settings.limits)
    return _single_solution(NO_HISTORY, *filled) if filled else None


def prove_unreachable(
    model: Articulation, joints: tuple[int, ...], oriented: tuple[bool, ...],
    targets: RecordArray, figures: FloatArray, limits: Limits,
) -> None:  # fmt: skip
    """Change the outcomes of failed solves, where the first shell of an effector is the proof.

    Targets are records TARGET, (target, effector); `figures` is that of Result.
    """
    for i, outcome in enumerate(figures[:, OUTCOME].tolist()):
        if outcome in PROVEN:
            pairs = zip(joints, oriented, targets[i].tolist(), strict=True)
            for joint, is_oriented, (x, Q, _) in pairs:
                gap, lever = least_distance(model, joint, x, Q if is_oriented else None, False)
                if gap > limits.tolerance + lever * limits.tolerance_rotation:
                    figures[i, OUTCOME] = PROVEN[outcome]


def solve_checked(
    model: Skeleton | Articulation,
    start: ArrayLike,
    targets: list[CheckedTarget],
    settings: Settings,
) -> IKSolution:
    """Return the solution for targets that are checked except for their numbers.

    If the settings are chained, each solve starts from the solution before.

    Raises:
        ValueError: naming a number which a kernel has refused.
        FloatingPointError: if a frame is wrong from which the next frame starts.
    """
    is_skeleton, name = isinstance(model, Skeleton), coordinates_name(model)
    shape = (model.joint_count, 4) if isinstance(model, Skeleton) else (model.coordinate_count,)
    starts = arguments.floats(name, start, "...", *shape)
    batch = batch_shape(starts.shape[: -len(shape)], targets, name)
    starts = _rows(starts, batch, len(shape))
    on_chain = is_skeleton and len(targets) == 1 and targets[0].rotation is None
    rows: np.ndarray
    if on_chain:
        rows = arguments.spread(targets[0].position, (*batch, 3)).reshape(-1, 3)
    else:
        rows = target_rows(targets, batch)
    result = _run_checked(model, starts, targets, rows, settings)
    if result is None:
        check_numbers(targets)
        if isinstance(model, Articulation):
            model.checked(name, start)
        else:
            rotation.unit(name, start)
        if settings.limits.chained:
            limit = f"{LARGEST_COORDINATE:g}"
            raise FloatingPointError(f"track: a frame left the numbers up to {limit}")
        raise ValueError(
            f"{name}: expected quaternions within 1e-6 of unit length, got one just off"
        )
    if on_chain and settings.limits.restarts:
        rows = target_rows(targets, batch)
        result = _restarted(model, starts, targets, rows, result, settings)
    return _solution(result, batch, settings)


def _run_checked(
    model: Skeleton | Articulation,
    starts: FloatArray,
    targets: list[CheckedTarget],
    rows: np.ndarray,
    settings: Settings,
) -> Result | None:
    """Return the result of a kernel for rows of starts and targets; None if some is not valid."""
    count = model.joint_count
    if isinstance(model, Skeleton) and rows.dtype == FLOAT64:
        arrays = (*model.arrays, model.path_array(targets[0].joint))
        filled = run(settings.solver.chain, arrays, starts, rows, count, None, settings)
        return Result(*filled) if filled else None
    articulation = balls(model) if isinstance(model, Skeleton) else model
    effectors = tuple([target.joint for target in targets])
    oriented = tuple([target.rotation is not None for target in targets])
    restarts, seed = settings.limits.restarts, settings.seed
    arrays = prepare(articulation, effectors, oriented, restarts, seed).model
    width = articulation.coordinate_count
    starts = starts.reshape(len(starts), width)
    filled = run(settings.solver.mechanism, (arrays,), starts, rows, count, width, settings)
    if not filled:
        return None
    result = Result(*filled)
    prove_unreachable(articulation, effectors, oriented, rows, result.figures, settings.limits)
    if articulation is model:
        return result
    local = result.coordinates.reshape(result.local.shape)
    return result._replace(local=local, coordinates=local)


def run(
    kernel: Kernel,
    arrays: tuple[Any, ...],
    starts: FloatArray,
    targets: np.ndarray,
    joints: int,
    coordinates: int | None,
    settings: Settings,
) -> tuple[FloatArray, ...]:
    """Return the fields of Result as a kernel fills them; none if some number is not valid.

    `arrays` are the model's, read by the kernel. The starts are rows, (target, ...), or a single
    row for all targets. The targets are positions [m], (target, 3), of a mechanism records TARGET,
    (target, effector). `coordinates` is how many a solution on a mechanism has, None on a chain.
    """
    n, history = len(targets), UNRECORDED
    local, positions = np.empty((n, joints, 4)), np.empty((n, joints, 3))
    figures = np.empty((n, len(FIGURES)))
    if settings.record:
        rounds = settings.limits.restarts * (1 if coordinates is None else 2) + 1
        columns = rounds * max(settings.limits.max_iterations, settings.limits.far_iterations)
        if n * columns > LARGEST_HISTORY:
            raise ValueError(
                f"max_iterations: expected at most {LARGEST_HISTORY:,} residuals to record, got "
                f"{n} times {columns}"
            )
        history = np.empty((n, columns + 1))
    rows: tuple[np.ndarray, ...]
    if coordinates is None:
        q, slice_length = local, SLICE_ON_CHAINS
        rows = starts, targets, local, positions, figures, history
    else:
        q, slice_length = np.empty((n, coordinates)), SLICE_ON_MECHANISMS
        rows = starts, targets, local, positions, figures, history, q
    if n < 2 * slice_length or settings.limits.chained:
        valid = kernel(*arrays, settings.numbers, *rows)
    else:

        def arguments_of(part: slice) -> tuple[Any, ...]:
            parts = [values if len(values) == 1 else values[part] for values in rows]
            return (*arrays, settings.numbers, *parts)

        valid = all(in_slices(kernel, n, arguments_of, minimum=slice_length))
    return (local, positions, figures, history, q) if valid else ()


def balls(skeleton: Skeleton) -> Articulation:
    """Return the skeleton as an Articulation of unlimited balls, cached by the skeleton."""
    cache = skeleton.__dict__
    if "balls" not in cache:
        cache["balls"] = Articulation(skeleton, "ball")
    return cache["balls"]


def target_rows(targets: list[CheckedTarget], batch: tuple[int, ...]) -> RecordArray:
    """Return targets as records TARGET, (target, effector), the largest weight 1."""
    count, heaviest = len(targets), max([target.weight for target in targets])
    rows = np.empty((*batch, count), TARGET)
    for effector, target in enumerate(targets):
        rows["position"][..., effector, :] = target.position
        rows["rotation"][..., effector, :] = (
            IDENTITY if target.rotation is None else target.rotation
        )
        rows["weight"][..., effector] = target.weight / heaviest
    return rows.reshape(-1, count)


def batch_shape(
    starts: tuple[int, ...], targets: list[CheckedTarget], name: str
) -> tuple[int, ...]:
    """Return the leading axes of starts, called `name` in errors, and targets, broadcast."""
    batch = starts
    for target in targets:
        for values in (target.position, target.rotation):
            if values is not None and values.ndim > 1:
                batch = arguments.broadcast(
                    "target", batch, values.shape[:-1], f"those of {name}, "
                )
    return batch


def _rows(starts: FloatArray, batch: tuple[int, ...], axes: int) -> FloatArray:
    """Return the starts as rows: a row for each target of a batch, or a single row."""
    if starts.ndim == axes:
        return starts[None]
    return one_batch(arguments.spread(starts, (*batch, *starts.shape[-axes:])), axes)


def _restarted(
    skeleton: Any,
    starts: FloatArray,
    targets: list[CheckedTarget],
    rows: np.ndarray,
    first: Result,
    settings: Settings,
) -> Result:
    """Return the better of first results and restarts, where a target in reach is not reached.

    A start on a chain of unlimited balls has already had the iterations of all attempts. Towards a
    target out of reach every start comes to the same nearest point.
    """
    unsolved = np.flatnonzero(~np.isin(first.figures[:, OUTCOME], FINAL_OUTCOMES))
    if not len(unsolved):
        return first
    starts = starts[unsolved] if len(starts) > 1 else starts
    more = _run_checked(skeleton, starts, targets, rows[unsolved], settings)
    assert more is not None, "both kernels accept the same starts and targets"
    history, counts = first.history, first.figures[unsolved, ITERATIONS].astype(np.int64)
    if settings.record:  # the residuals of the first results, then those of their restarts
        columns = np.empty((len(history), more.history.shape[1] - 1))
        history = np.concatenate([history, columns], axis=1)
        for row, count, residuals in zip(unsolved, counts, more.history, strict=True):
            history[row, count + 1 : count + len(residuals)] = residuals[1:]
    iterations = counts + more.figures[:, ITERATIONS]
    is_better = (more.figures[:, OUTCOME] == Outcome.CONVERGED) | (
        more.figures[:, MERIT] < first.figures[unsolved, MERIT]
    )
    better = unsolved[is_better]
    for values, replacements in zip(first[:3], more[:3], strict=True):
        values[better] = replacements[is_better]
    first.figures[unsolved, ITERATIONS] = iterations
    return first._replace(history=history)


def _solution(result: Result, batch: tuple[int, ...], settings: Settings) -> IKSolution:
    """Return the results as a solution in the shape of the batch."""
    local, positions, figures, history, q = result
    if settings.record:  # up to the longest, each continued by its last residual
        iterations = figures[:, ITERATIONS].astype(np.int64)
        count = np.arange(int(iterations.max(initial=0)) + 1)
        history = np.take_along_axis(history, np.minimum(count, iterations[:, None]), axis=1)
    if not batch:
        return _single_solution(frozen(history[0]) if settings.record else NO_HISTORY, *result)

    def shaped(values: Any) -> Any:
        return frozen(values.reshape(batch + values.shape[1:]))

    residual, angle, steps, outcome, merit, excess = figures.T.copy()
    return IKSolution(
        shaped(local), shaped(positions), shaped(residual), shaped(steps.astype(np.int64)),
        shaped(outcome.astype(np.int64)), shaped(history) if settings.record else NO_HISTORY,
        shaped(angle), shaped(q), shaped(merit), shaped(excess),
    )  # fmt: skip


def _single_solution(
    shown_history: FloatArray,
    local: FloatArray,
    positions: FloatArray,
    figures: FloatArray,
    _history: FloatArray,
    coordinates: FloatArray,
) -> IKSolution:
    """Return the solution of the only target, with its history."""
    pose, x = local[0], positions[0]
    pose.setflags(False)  # by its name it takes twice as long
    x.setflags(False)
    q = pose
    if coordinates is not local:
        q = coordinates[0]
        q.setflags(False)
    residual, angle, iterations, outcome, merit, excess = figures.tolist()[0]
    return IKSolution(
        pose, x, residual, int(iterations), OUTCOMES[outcome], shown_history, angle, q, merit,
        excess,
    )  # fmt: skip
