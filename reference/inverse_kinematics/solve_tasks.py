"""Levenberg-Marquardt on tasks: exact tasks are met, the others approached as far as possible.

An augmented Lagrangian (Rockafellar 1973) holds the exact tasks: multipliers u shift their
residuals r. Where the minimum of the sum of squares of r + u and of the other residuals does not
meet the exact tasks, u grows by r. The damping follows the gain (Nielsen 1999).
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from ..arguments import FloatArray, frozen, shown
from ..articulation import Articulation
from ..backend.compiled import Kernel
from ..model import Model, checked_model, effector_of
from ..outcome import Outcome
from .bounded_step import TaskSystem, damped_step, new_system, take_step
from .mechanism import (
    EFFECTOR,
    ConfigurationData,
    Mechanism,
    new_data,
)
from .problem import RESTARTS, Target
from .tasks import Configuration, FrameTask, IKTask, configuration

# The default, twice that of `solve_ik`: exact tasks take several descents.
MAX_ITERATIONS = 200
# The first damping and the largest, over the largest diagonal entry of J J' at first.
FIRST_DAMPING, LARGEST_DAMPING = 1e-3, 1e12
# An attempt settles where a step promises to lower the cost by less than the first share, or the
# second between two updates of the multipliers. The second share halves the iterations, and costs
# are half a per cent higher at most.
SETTLED, SETTLED_BETWEEN = 1e-8, 1e-3
# At a minimum a step at the first damping promises to lower the cost by no more than the first
# share. Where a descent with exact tasks has settled, the second share counts: ten times the
# remainder of nine in ten descents. In this step errors of exact tasks count HELD times as much.
MINIMUM, MINIMUM_BETWEEN, HELD = 1e-6, 1e-2, 1e4
# A step counts if the cost falls by this share of what was promised.
ACCEPTED = 1e-3
# If an update of the multipliers leaves more than PROGRESS of the error, exact tasks count PENALTY
# times as much, at most PENALTIES times.
PROGRESS, PENALTY, PENALTIES = 0.1, 10.0, 6
# Factors of exact residuals while the others are approached. Without a factor the others may lead
# away for good, with a large one to dearer minima. The second is tried if the first lowers no cost.
STRENGTHS = 1.0, 30.0


class TaskSolution(NamedTuple):
    """The configuration returned by `solve_tasks`.

    Attributes:
        coordinates: within the limits, (coordinate,).
        errors: the largest entry of each task's residual [m or rad], (task,).
        cost: the sum of weight |residual|² of the tasks not exact.
        iterations: of all attempts.
        outcome: CONVERGED if every exact task is met, and the others are met or at a local minimum.
            Otherwise STALLED, or ITERATION_LIMIT if more iterations may do better. `errors` show
            which tasks are met.
    """

    coordinates: FloatArray
    errors: FloatArray
    cost: float
    iterations: int
    outcome: Outcome


class _Evaluation(NamedTuple):
    """A configuration with weighted residuals of all tasks."""

    q: FloatArray
    r: FloatArray  # (row,)
    J: FloatArray  # (row, freedom)
    errors: FloatArray  # the largest entry of each task's residual, (task,)


def solve_tasks(
    model: Model,
    q: ArrayLike,
    tasks: Sequence[IKTask | Target],
    *,
    tolerance: float = 1e-4,
    max_iterations: int = MAX_ITERATIONS,
    restarts: int = RESTARTS,
    seed: int = 0,
) -> TaskSolution:
    """Return coordinates within the limits that meet the exact tasks, near the others' minimum.

    Args:
        model: an Articulation, or a Robot read from a file.
        q: the start, brought within the limits, (coordinate,).
        tasks: of `plumbob.tasks`, own classes with the members of `IKTask`, and Targets.
        tolerance: the largest entry of a residual that counts as met [m or rad].
        max_iterations: of each attempt.
        restarts: number of further attempts from random configurations, until the exact tasks are
            met.
        seed: of the configurations.

    Raises:
        ValueError: if an argument is not valid, or the joint of a task does not exist.
    """
    articulation = checked_model(model, "model")
    if not isinstance(articulation, Articulation):
        raise ValueError("model: expected an Articulation or a Robot, got a Skeleton")
    start = arguments.floats("q", q, articulation.coordinate_count)
    start = articulation.clamp(articulation.checked("q", start))
    problem = TaskProblem(articulation, start, tasks)
    tolerance = arguments.number("tolerance", tolerance, minimum=0.0)
    limit = arguments.count("max_iterations", max_iterations, minimum=0)
    restarts = arguments.count("restarts", restarts, minimum=0)
    rng = np.random.default_rng(arguments.integer("seed", seed, minimum=0))
    best, total = None, 0
    for row in _starts(articulation, start, restarts, rng):
        solution = _attempt(problem, row, tolerance, limit)
        total += solution.iterations
        if best is None or problem.misses(solution) < problem.misses(best):
            best = solution
        if problem.misses(best) <= tolerance:
            break
    assert best is not None, "the start is the first attempt"
    return best._replace(iterations=total)


def _starts(
    model: Articulation, q: FloatArray, restarts: int, rng: np.random.Generator
) -> Iterator[FloatArray]:
    yield q
    for _ in range(restarts):
        yield model.random(rng)


class TaskProblem:
    """The tasks of a model, and the arrays of its kernels."""

    def __init__(
        self, model: Articulation, q: FloatArray, tasks: Sequence[IKTask | Target]
    ) -> None:
        if isinstance(tasks, Target) or not isinstance(tasks, Sequence) or not tasks:
            raise ValueError(f"tasks: expected a list of at least one task, got {shown(tasks)}")
        self.model, self.tasks = model, [_as_task(model, task) for task in tasks]
        n, freedoms = model.joint_count, model.freedom_count
        self.mechanism = Mechanism(
            model.joints, np.arange(model.coordinate_count), np.zeros(0, EFFECTOR),
            np.zeros((n, 0), dtype=bool), np.zeros((n, n), dtype=bool), 1.0, freedoms, 0,
        )  # fmt: skip
        self.data: ConfigurationData = new_data(self.mechanism)
        start = configuration(model, q)
        sizes = [len(_evaluated(task, start, "row")[0]) for task in self.tasks]
        self.system: TaskSystem = new_system(sum(sizes), freedoms)
        self.exact = np.repeat([task.exact for task in self.tasks], sizes)
        self.root = np.sqrt(np.repeat([task.weight for task in self.tasks], sizes))
        self.is_exact = np.array([task.exact for task in self.tasks])
        self.sizes = sizes

    def at(self, q: FloatArray) -> _Evaluation:
        """Return the weighted residuals at q."""
        current = configuration(self.model, q)
        pairs = zip(self.tasks, self.sizes, strict=True)
        parts = [_evaluated(task, current, size) for task, size in pairs]
        residuals, derivatives = zip(*parts, strict=True)
        errors = np.array([np.abs(residual).max(initial=0.0) for residual in residuals])
        r, J = np.concatenate(residuals), np.concatenate(derivatives)
        return _Evaluation(q, self.root * r, self.root[:, None] * J, errors)

    def step(
        self, state: _Evaluation, e: FloatArray, scale: FloatArray, damping: float
    ) -> tuple[FloatArray, float]:
        """Return coordinates after a damped step within the limits, and the promised decrease."""
        system, data = self.system, self.data
        system.e[:], system.J[:], data.q[:] = e, (scale[:, None] * state.J).T, state.q
        _step(self.mechanism, data, system, damping)
        left = e - scale * (state.J @ system.step)
        _move(self.mechanism, data, system)
        return data.q.copy(), float(e @ e - left @ left)

    def is_met(self, state: _Evaluation, tolerance: float) -> bool:
        """Return whether every exact task is met."""
        return bool((state.errors[self.is_exact] <= tolerance).all())

    def cost(self, state: _Evaluation) -> float:
        """Return the weighted sum of squares of the tasks not exact."""
        return float(np.sum(state.r[~self.exact] ** 2))

    def is_minimum(self, state: _Evaluation, tolerance: float, share: float) -> bool:
        """Return whether motions within limits and exact tasks lower the cost at most by `share`.

        `share` is relative to the cost. Met tasks have nothing left to lower.
        """
        if (state.errors[~self.is_exact] <= tolerance).all():
            return True
        unit, unit_exact = (_unit(state.J[rows]) for rows in (~self.exact, self.exact))
        scale = np.where(self.exact, HELD * (unit / unit_exact) ** 0.5, 1.0)
        e = np.where(self.exact, 0.0, -state.r)
        _, promised = self.step(state, e, scale, FIRST_DAMPING * unit)
        return promised <= share * self.cost(state)

    def misses(self, solution: TaskSolution) -> float:
        """Return the largest error of an exact task."""
        return float(solution.errors[self.is_exact].max(initial=0.0))


def _attempt(problem: TaskProblem, q: FloatArray, tolerance: float, limit: int) -> TaskSolution:
    """Return the solution from a start: first the exact tasks, then all tasks together.

    If these end away from the exact tasks, the exact tasks are met again from there.
    """
    exact = problem.exact.astype(float)
    state, count, stalled = _descend(problem, q, exact, tolerance, limit)
    others_follow = problem.is_met(state, tolerance) and not problem.exact.all()
    for strength in STRENGTHS if others_follow else ():
        scale = np.where(problem.exact, strength, 1.0)
        end, more, stalled = _descend(problem, state.q, scale, tolerance, limit - count)
        count += more
        if not problem.is_met(end, tolerance):
            end, more, stalled = _descend(problem, end.q, exact, tolerance, limit - count)
            count += more
        if problem.is_met(end, tolerance) and problem.cost(end) < problem.cost(state):
            state = end
            break
    share = MINIMUM_BETWEEN if stalled and problem.exact.any() else MINIMUM
    outcome = Outcome.STALLED if stalled else Outcome.ITERATION_LIMIT
    if problem.is_met(state, tolerance) and problem.is_minimum(state, tolerance, share):
        outcome = Outcome.CONVERGED
    q, errors = frozen(state.q), frozen(state.errors)
    return TaskSolution(q, errors, problem.cost(state), count, outcome)


def _descend(
    problem: TaskProblem, q: FloatArray, scale: FloatArray, tolerance: float, limit: int
) -> tuple[_Evaluation, int, bool]:
    """Minimise the scaled residuals from q; if other tasks exist, hold the exact tasks.

    Returns:
        The end; the iterations; and whether it has settled.
    """
    state, scale, shift = problem.at(q), scale.copy(), np.zeros(len(scale))
    exact, missed, penalties = problem.exact, np.inf, 0
    is_single = not scale[~exact].any()
    settled = SETTLED if is_single or not exact.any() else SETTLED_BETWEEN
    unit = _unit(state.J)
    damping, growth = FIRST_DAMPING * unit, 2.0
    for count in range(limit):
        if is_single and problem.is_met(state, tolerance):
            return state, count, True
        e = -scale * (state.r + shift)
        moved, promised = problem.step(state, e, scale, damping)
        square, new = float(e @ e), problem.at(moved)
        gain = square - float(np.sum((scale * (new.r + shift)) ** 2))
        ratio = gain / promised if promised > 0.0 else 0.0
        if ratio > ACCEPTED:
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
            growth, state = 2.0, new
        else:
            damping, growth = damping * growth, 2.0 * growth
        if promised > settled * square and damping < LARGEST_DAMPING * unit:
            continue
        if is_single or problem.is_met(state, tolerance) or penalties == PENALTIES:
            return state, count + 1, True
        before, missed = missed, float(np.linalg.norm(state.r[exact]))
        shift[exact] += state.r[exact]
        if missed > PROGRESS * before:
            scale[exact] *= PENALTY**0.5
            shift /= PENALTY
            penalties += 1
    return state, limit, False


def _unit(J: FloatArray) -> float:
    """Return the largest diagonal entry of J J', 1 if nothing moves the residuals."""
    return float(np.sum(J**2, axis=1).max(initial=0.0)) or 1.0


def _as_task(model: Articulation, task: IKTask | Target) -> IKTask:
    """Return a task; of a Target the placement of its effector."""
    if isinstance(task, Target):
        frame = effector_of(model, task.effector)
        return FrameTask(frame, task.position, task.rotation, weight=task.weight)
    if isinstance(task, type) or not callable(getattr(task, "evaluate", None)):
        raise ValueError(f"tasks: expected tasks and Targets, got {shown(task)}")
    arguments.number("weight", getattr(task, "weight", None), above=0.0)
    arguments.boolean("exact", getattr(task, "exact", None))
    return task


def _evaluated(
    task: IKTask, current: Configuration, size: int | str
) -> tuple[FloatArray, FloatArray]:
    """Return the residual of a task, of a size, and its derivative; both are checked."""
    parts = task.evaluate(current)
    if not isinstance(parts, tuple) or len(parts) != 2:
        raise ValueError(f"evaluate: expected a residual and its derivative, got {shown(parts)}")
    r = arguments.array("residual", parts[0], size)
    return r, arguments.array("derivative", parts[1], len(r), current.model.freedom_count)


_step = Kernel(damped_step, label="solve_tasks, step")
_move = Kernel(take_step, label="solve_tasks, move")
