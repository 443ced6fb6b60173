"""From checked settings and targets to the kernels of a solver, and from results to a solution."""

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import FLOAT64, LARGEST_COORDINATE, FloatArray, frozen, is_plain
from ..articulation import Articulation, balls
from ..backend.threads import in_slices
from ..model import coordinates_name, effector_of
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .mechanism import TARGET_WIDTH
from .problem import CheckedTarget, IKSolution, Settings, Target, check_numbers
from .reach import least_distance
from .reduce import IKProblem, prepare, prepare_chain
from .restarts import Limits
from .result import FIGURE_COUNT, ITERATIONS, MERIT, OUTCOME, Result, result_on, result_size

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
FREE_TARGET = np.array([0.0, 0.0, 0.0, *IDENTITY, 1.0])  # a row of `target_rows`
# A problem, and the memory of its results.
Results: TypeAlias = tuple[IKProblem, FloatArray]


def solve_plain(
    model: Any, start: Any, target: Any, effector: Any, settings: Settings
) -> IKSolution | None:
    """Return the solution for a single start and target, as `solve_checked` does, in less time.

    None where start and target are not float64 arrays, their numbers are not valid, or the target
    has a weight.
    """
    position, Q, joint = target, None, effector
    if type(target) is Target and effector is None:
        position, Q, joint, weight = target
        if type(weight) is not float or weight != 1.0:
            return None
    if settings.record or not is_plain(position, (3,)):
        return None
    joint, oriented, is_skeleton = effector_of(model, joint), Q is not None, type(model) is Skeleton
    if is_skeleton:
        if oriented or settings.limits.restarts or not is_plain(start, (model.joint_count, 4)):
            return None
        problem, kernel = prepare_chain(model, joint), settings.solver.chain
        start, row = start.ravel(), position
    else:
        if not is_plain(start, (model.coordinate_count,)) or (oriented and not is_plain(Q, (4,))):
            return None
        restarts, kernel = settings.limits.restarts, settings.solver.mechanism
        problem = prepare(model, (joint,), (oriented,), restarts, settings.seed)
        row = FREE_TARGET.copy()
        row[:3] = position
        if oriented:
            row[3:7] = Q
    joints, coordinates = problem.joints, problem.coordinates
    end = 7 * joints + FIGURE_COUNT
    memory: Any = np.empty(end + coordinates + 1)  # see `result_on`
    if not kernel(problem.memory, settings.numbers, start, row, memory, 0, 1):
        return None
    if not is_skeleton:
        prove_unreachable(model, problem, row, memory, settings.limits)
    memory.setflags(False)  # by its name it takes four times as long
    # views of an array take longer in its own words
    pose = np.ndarray((joints, 4), FLOAT64, memory)
    x = np.ndarray((joints, 3), FLOAT64, memory, 8 * 4 * joints)
    residual, angle, steps, outcome, merit, excess = memory[7 * joints : end].tolist()
    q = pose if is_skeleton else memory[end : end + coordinates]
    return tuple.__new__(  # in half the time of the constructor
        IKSolution,
        (pose, x, residual, int(steps), OUTCOMES[outcome], NO_HISTORY, angle, q, merit, excess),
    )


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
    name = coordinates_name(model)
    shape = (model.joint_count, 4) if isinstance(model, Skeleton) else (model.coordinate_count,)
    starts = arguments.floats(name, start, "...", *shape)
    batch = batch_shape(starts.shape[: -len(shape)], targets, name)
    if starts.ndim > len(shape):
        starts = arguments.spread(starts, (*batch, *shape))
    if isinstance(model, Skeleton) and len(targets) == 1 and targets[0].rotation is None:
        results = _solve_chains(model, starts.reshape(-1), targets, batch, settings)
    else:
        rows = target_rows(targets, batch)
        results = _solve_mechanisms(model, starts.reshape(-1), targets, rows, settings)
    if results is None:
        raise refusal(model, start, targets, settings)
    return _solution(*results, batch, isinstance(model, Skeleton), settings.record)


def _solve_chains(
    skeleton: Any, starts: FloatArray, targets: list[CheckedTarget], batch: tuple[int, ...],
    settings: Settings,
) -> Results | None:  # fmt: skip
    """Return the results on a chain of unlimited balls; None if some number is not valid."""
    (target,) = targets
    positions = arguments.spread(target.position, (*batch, 3)).reshape(-1)
    problem = prepare_chain(skeleton, target.joint)
    memory = run(problem, starts, positions, settings)
    if memory is None:
        return None
    if settings.limits.restarts:
        first = result_on(memory, len(positions) // 3, problem.joints, 0)
        _restart(skeleton, starts, targets, target_rows(targets, batch), first, settings)
    return problem, memory


def _solve_mechanisms(
    model: Any, starts: FloatArray, targets: list[CheckedTarget], rows: FloatArray,
    settings: Settings,
) -> Results | None:  # fmt: skip
    """Return the results for rows of targets; None if some number is not valid."""
    articulation = balls(model) if isinstance(model, Skeleton) else model
    effectors = tuple([target.joint for target in targets])
    oriented = tuple([target.rotation is not None for target in targets])
    restarts, seed = settings.limits.restarts, settings.seed
    problem = prepare(articulation, effectors, oriented, restarts, seed)
    memory = run(problem, starts, rows, settings)
    if memory is None:
        return None
    prove_unreachable(articulation, problem, rows, memory, settings.limits)
    return problem, memory


def run(
    problem: IKProblem, starts: FloatArray, targets: FloatArray, settings: Settings
) -> FloatArray | None:
    """Return the results of a kernel, see `result_on`; None if some number is not valid.

    Starts and targets are one after the other in a row; a single start is for all targets.
    """
    is_chain, limits = problem.mechanism is None, settings.limits
    n = len(targets) // (3 if is_chain else TARGET_WIDTH * len(problem.effectors))
    columns = 1
    if settings.record:  # a chain leaves room for the restarts of its mechanism
        rounds = (1 + limits.restarts) * (4 if is_chain and limits.restarts else 2)
        columns += rounds * max(limits.max_iterations, limits.far_iterations)
        if n * columns > LARGEST_HISTORY:
            raise ValueError(
                f"max_iterations: expected at most {LARGEST_HISTORY:,} residuals to record, got "
                f"{n} times {columns}"
            )
    memory = np.empty(n * result_size(problem.joints, problem.coordinates, columns))
    kernel = settings.solver.chain if is_chain else settings.solver.mechanism
    constants = problem.memory, settings.numbers, starts, targets, memory
    minimum = SLICE_ON_CHAINS if is_chain else SLICE_ON_MECHANISMS
    if n < 2 * minimum or limits.chained:
        valid = kernel(*constants, 0, n)
    else:
        valid = all(
            in_slices(kernel, n, lambda part: (*constants, part.start, part.stop), minimum=minimum)
        )
    return memory if valid else None


def prove_unreachable(
    model: Articulation, problem: IKProblem, targets: FloatArray, memory: FloatArray,
    limits: Limits,
) -> None:  # fmt: skip
    """Change the outcomes of failed solves, where the first shell of an effector is the proof.

    Targets are rows as of `target_rows`; the memory is that of results.
    """
    n = len(targets) // (TARGET_WIDTH * len(problem.effectors))
    begin = 7 * n * problem.joints
    if n == 1 and memory.item(begin + OUTCOME) not in PROVEN:
        return
    figures = memory[begin : begin + FIGURE_COUNT * n].reshape(n, FIGURE_COUNT)
    for i, outcome in enumerate(figures[:, OUTCOME].tolist()):
        if outcome in PROVEN:
            rows = targets.reshape(n, -1, TARGET_WIDTH)[i].tolist()
            for joint, oriented, row in zip(problem.effectors, problem.oriented, rows, strict=True):
                Q = row[3:7] if oriented else None
                gap, lever = least_distance(model, joint, row[:3], Q, False)
                if gap > limits.tolerance + lever * limits.tolerance_rotation:
                    figures[i, OUTCOME] = PROVEN[outcome]


def refusal(
    model: Skeleton | Articulation, start: ArrayLike, targets: list[CheckedTarget],
    settings: Settings,
) -> Exception:  # fmt: skip
    """Raise, or return, the error of numbers that a kernel has refused."""
    name = coordinates_name(model)
    check_numbers(targets)
    if isinstance(model, Articulation):
        model.checked(name, start)
    else:
        rotation.unit(name, start)
    if settings.limits.chained:
        return FloatingPointError(f"track: a frame left the numbers up to {LARGEST_COORDINATE:g}")
    return ValueError(f"{name}: expected quaternions within 1e-6 of unit length, got one just off")


def target_rows(targets: list[CheckedTarget], batch: tuple[int, ...]) -> FloatArray:
    """Return targets as a row of records TARGET, effector by effector, the largest weight 1."""
    heaviest = max([target.weight for target in targets])
    rows = np.empty((*batch, TARGET_WIDTH * len(targets)))
    for effector, (_, x, Q, weight) in enumerate(targets):
        at = TARGET_WIDTH * effector
        rows[..., at : at + 3] = x
        rows[..., at + 3 : at + 7] = IDENTITY if Q is None else Q
        rows[..., at + 7] = weight / heaviest
    return rows.reshape(-1)


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


def _restart(
    skeleton: Skeleton, starts: FloatArray, targets: list[CheckedTarget], rows: FloatArray,
    first: Result, settings: Settings,
) -> None:  # fmt: skip
    """Put restarts in place of worse results, where a target in reach is not reached.

    A start on a chain of unlimited balls has already had the iterations of all attempts. Towards a
    target out of reach every start comes to the same nearest point.
    """
    unsolved = np.flatnonzero(~np.isin(first.figures[:, OUTCOME], FINAL_OUTCOMES))
    if not len(unsolved):
        return
    n = len(first.figures)
    if starts.size > first.local[0].size:
        starts = starts.reshape(n, -1)[unsolved].reshape(-1)
    remaining = rows.reshape(n, -1)[unsolved].reshape(-1)
    results = _solve_mechanisms(skeleton, starts, targets, remaining, settings)
    assert results is not None, "both kernels accept the same starts and targets"
    problem, memory = results
    more = result_on(memory, len(unsolved), problem.joints, problem.coordinates)
    counts = first.figures[unsolved, ITERATIONS].astype(np.int64)
    if settings.record:  # the residuals of the first results, then those of their restarts
        for row, count, residuals in zip(unsolved, counts, more.history, strict=True):
            first.history[row, count + 1 : count + len(residuals)] = residuals[1:]
    iterations = counts + more.figures[:, ITERATIONS]
    is_better = (more.figures[:, OUTCOME] == Outcome.CONVERGED) | (
        more.figures[:, MERIT] < first.figures[unsolved, MERIT]
    )
    better = unsolved[is_better]
    for values, replacements in zip(first[:3], more[:3], strict=True):
        values[better] = replacements[is_better]
    first.figures[unsolved, ITERATIONS] = iterations


def _solution(
    problem: IKProblem, memory: FloatArray, batch: tuple[int, ...], is_skeleton: bool, record: bool
) -> IKSolution:
    """Return the results as a solution in the shape of the batch, all read-only."""
    joints, coordinates = problem.joints, problem.coordinates
    result, history = result_on(memory, math.prod(batch), joints, coordinates), NO_HISTORY
    count = result.figures[:, ITERATIONS].astype(np.int64)
    if record:  # up to the longest, each continued by its last residual
        row = np.arange(int(count.max(initial=0)) + 1)
        history = np.take_along_axis(result.history, np.minimum(row, count[:, None]), axis=1)
        history = frozen(history.reshape(*batch, len(row)))

    def shaped(values: Any) -> Any:
        return frozen(values.reshape(batch + values.shape[1:]))

    local = shaped(result.local)
    residual, angle, _, outcome, merit, excess = map(shaped, result.figures.T.copy())
    steps, outcome = shaped(count), shaped(result.figures[:, OUTCOME].astype(np.int64))
    if not batch:
        residual, angle, merit, excess = map(float, (residual, angle, merit, excess))
        steps, outcome = int(steps), OUTCOMES[int(outcome)]
    q = local if is_skeleton else shaped(result.coordinates)
    return IKSolution(
        local, shaped(result.positions), residual, steps, outcome, history, angle, q, merit, excess
    )
