"""Tasks of a model, solved once, or prepared for many starts and targets."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments
from ..arguments import LARGEST_COORDINATE, FloatArray, frozen, shown
from ..articulation import Articulation
from ..backend.compiled import Kernel
from ..backend.threads import ArraysOfThread
from ..model import Model, checked_model, effector_of
from ..outcome import Outcome
from ..quaternion import made_unit
from ..rotation import unit
from .descent import (
    DescentOperations,
    TaskState,
    attempt_merit,
    draw_tasks,
    exact_errors,
    keep,
    leave,
    meet,
    new_state,
    place,
    place_tasks,
    solve,
    solve_from,
    step,
)
from .problem import PHASE_COUNTS, RESTARTS, Target
from .reduce import further_shares, random_poses
from .restarts import Operations
from .solve import OUTCOMES
from .solve_mechanism import shift_mechanism
from .task_errors import (
    CENTRE_OF_MASS,
    FRAME,
    LOOK_AT,
    OWN,
    POSTURE,
    Residuals,
    evaluation_kernel,
    task_arrays,
)
from .tasks import BuiltInTask, Configuration, FrameTask, IKTask, configuration

# The default, twice that of `solve_ik`: exact tasks take several descents.
MAX_ITERATIONS = 200
PHASES = PHASE_COUNTS["levenberg_marquardt"]
# The target of each kind of task.
TARGETS = {FRAME: "position", LOOK_AT: "target", CENTRE_OF_MASS: "position", POSTURE: "coordinates"}


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


class PreparedTasks(ArraysOfThread):
    """The tasks of a model for many starts and targets, solved into the same arrays every time.

    Each thread that shares the object has arrays and targets of its own, as `prepare_tasks` made
    them, and so has a copy.

    Attributes:
        coordinates: of the last solution, a read-only view of an array that the next call fills,
            NaN before the first call, (coordinate,).
        errors: likewise, the largest entry of each task's residual [m or rad], (task,).
        cost: the sum of weight |residual|² of the tasks not exact.
        iterations: of all attempts.
    """

    def __init__(
        self, model: Articulation, tasks: tuple[IKTask, ...], settings: tuple[Any, ...]
    ) -> None:
        """Allocate the arrays of a thread; `prepare_tasks` checks the arguments."""
        self._problem = model, tasks, settings
        kinds = [_kind(task) for task in tasks]
        factors = [_factors(model, task) for task in tasks]
        restarts, shares = random_poses(model, *settings[2:4]), further_shares(model.joint_count)
        shares = shares[: settings[4] - 1]
        arrays = task_arrays(model, tasks, kinds, factors)
        self._state = state = new_state(model, arrays, restarts, shares)
        plain = tuple(tuple(part) if isinstance(part, tuple) else part for part in state)
        self._solve = partial(_solve.in_force, plain)
        if OWN in kinds:
            attempting = Operations(
                _meet.in_force, self._attempt_error, attempt_merit, leave, _place.in_force,
                draw_tasks, shift_mechanism,
            )  # fmt: skip
            descending = DescentOperations(self._evaluate, _step.in_force, _keep.in_force)
            self._solve = partial(_solve_own, attempting, descending, state)
        self._q, self._errors = np.full_like(state.best.q, np.nan), np.full(len(kinds), np.nan)
        self.coordinates, self.errors = frozen(self._q), frozen(self._errors)
        self.cost, self.iterations = np.nan, 0

    def __call__(self, q: ArrayLike) -> Outcome:
        """Solve from a start, (coordinate,), brought within the limits; return the outcome.

        Raises:
            ValueError: if the start is not valid. The solution is then not defined.
        """
        row, best = arguments.floats("q", q, len(self._q)), self._state.best
        model, _, (tolerance, limit, *_) = self._problem
        count, outcome, error, cost = self._solve(row, tolerance, limit)
        if count < 0:  # raise, or the lengths were within rounding of the tolerance
            count, outcome, error, cost = self._solve(model.checked("q", row), tolerance, limit)
        if not error <= LARGEST_COORDINATE:
            bound = f"at most {LARGEST_COORDINATE:g}"
            raise ValueError(f"residual: expected numbers of {bound}, got {error:g}")
        self._q[:], self._errors[:] = best.q, best.errors
        self.cost, self.iterations = cost, count
        return OUTCOMES[outcome]

    def set_target(
        self, task: int, target: ArrayLike | None = None, rotation: ArrayLike | None = None
    ) -> None:
        """Give a task another target.

        Args:
            task: its index in the list.
            target: the position of a FrameTask or CentreOfMass [m], (3,); the point that LookAt
                looks at [m], (3,); the coordinates of a Posture; None to keep it.
            rotation: of a FrameTask, unit quaternion (4,); None to keep it.

        Raises:
            ValueError: if an argument is not valid, or the task has no such target.
        """
        arrays, records = self._state.tasks, self._state.tasks.records
        t = arguments.integer("task", task, minimum=0, below=len(records))
        if target is not None:
            name = TARGETS.get(int(records["kind"][t]))
            if name is None or (name == "position" and not records["has_position"][t]):
                raise ValueError(f"target: expected None for task {t}, got {shown(target)}")
            if name == "coordinates":
                target = arguments.floats("target", target, len(self._q))
                arrays.coordinates[t] = self._problem[0].checked("target", target)
            else:
                records[name][t] = arguments.coordinates("target", target, 3)
        if rotation is not None:
            if not records["has_rotation"][t]:
                raise ValueError(f"rotation: expected None for task {t}, got {shown(rotation)}")
            numbers = arguments.floats("rotation", rotation, 4)
            Q, is_unit = made_unit(numbers.tolist())
            records["rotation"][t] = Q if is_unit else unit("rotation", numbers)

    def _attempt_error(self, state: TaskState, _target: Any) -> tuple[float, ...]:
        """Evaluate all tasks; return the errors of those to meet."""
        self._evaluate(state, state.current)
        errors: tuple[float, ...] = exact_errors(state)
        return errors

    def _evaluate(self, state: TaskState, evaluation: Residuals) -> None:
        """Evaluate all tasks at the data, those of the user in Python."""
        evaluation_kernel(state, evaluation)
        model, tasks, _ = self._problem
        current = configuration(model, evaluation.q.copy())
        for t, (task, record) in enumerate(zip(tasks, state.tasks.records, strict=True)):
            if record["kind"] == OWN:
                rows = slice(record["row"], record["row"] + record["size"])
                r, J = _evaluated(task, current, int(record["size"]))
                root = record["weight"] ** 0.5
                evaluation.r[rows], evaluation.J[:, rows] = root * r, root * J.T
                evaluation.errors[t] = np.abs(r).max(initial=0.0)


def prepare_tasks(
    model: Model,
    tasks: Sequence[IKTask | Target],
    *,
    tolerance: float = 1e-4,
    max_iterations: int = MAX_ITERATIONS,
    restarts: int = RESTARTS,
    phases: int | None = None,
    seed: int = 0,
) -> PreparedTasks:
    """Return `solve_tasks` for many starts and targets: `prepare_tasks(model, tasks)(q)`.

    Arguments are as in `solve_tasks`. The kernel is of the backend now in force.

    Raises:
        ValueError: if an argument is not valid, or the joint of a task does not exist.
    """
    articulation = checked_model(model, "model")
    if not isinstance(articulation, Articulation):
        raise ValueError("model: expected an Articulation or a Robot, got a Skeleton")
    phases = PHASES if phases is None else phases
    settings = (
        arguments.number("tolerance", tolerance, minimum=0.0),
        arguments.count("max_iterations", max_iterations, minimum=0),
        arguments.count("restarts", restarts, minimum=0),
        arguments.integer("seed", seed, minimum=0),
        arguments.integer("phases", phases, minimum=1, below=PHASES + 1),
    )
    if isinstance(tasks, Target) or not isinstance(tasks, Sequence) or not tasks:
        raise ValueError(f"tasks: expected a list of at least one task, got {shown(tasks)}")
    parts = tuple(_as_task(articulation, task) for task in tasks)
    return PreparedTasks(articulation, parts, settings)


def solve_tasks(
    model: Model,
    q: ArrayLike,
    tasks: Sequence[IKTask | Target],
    *,
    tolerance: float = 1e-4,
    max_iterations: int = MAX_ITERATIONS,
    restarts: int = RESTARTS,
    phases: int | None = None,
    seed: int = 0,
) -> TaskSolution:
    """Return coordinates within the limits that meet the exact tasks, near the others' minimum.

    Args:
        model: an Articulation, or a Robot read from a file.
        q: the start, brought within the limits, (coordinate,).
        tasks: of `plumbob.tasks`, own classes with the members of `IKTask`, and Targets.
        tolerance: the largest entry of a residual that counts as met [m or rad].
        max_iterations: of each attempt to meet the exact tasks, over all its phases, and of the
            approach to the others.
        restarts: number of further attempts from random configurations, until the exact tasks are
            met.
        phases: starts tried beside the random ones, at most, as in `solve_ik`, 1 to 8; by default
            all.
        seed: of the configurations.

    Raises:
        ValueError: if an argument is not valid, or the joint of a task does not exist.
    """
    solve = prepare_tasks(
        model, tasks, tolerance=tolerance, max_iterations=max_iterations, restarts=restarts,
        phases=phases, seed=seed,
    )  # fmt: skip
    outcome = solve(q)
    return TaskSolution(solve.coordinates, solve.errors, solve.cost, solve.iterations, outcome)


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


def _kind(task: IKTask) -> int:
    """Return the kind of a task; a subclass with an `evaluate` of its own is a task of a user."""
    is_built_in = getattr(type(task), "evaluate", None) is BuiltInTask.evaluate
    return task.kind if isinstance(task, BuiltInTask) and is_built_in else OWN


def _factors(model: Articulation, task: IKTask) -> FloatArray:
    """Return the factors of the residual; a task of a user is evaluated once for its size."""
    if isinstance(task, BuiltInTask) and _kind(task) != OWN:
        return task.factors(model)
    residual, _ = _evaluated(task, configuration(model, model.neutral()), "row")
    return np.ones(len(residual))


def _evaluated(
    task: IKTask, current: Configuration, size: int | str
) -> tuple[FloatArray, FloatArray]:
    """Return the residual of a task, of a size, and its derivative; both are checked."""
    parts = task.evaluate(current)
    if not isinstance(parts, tuple) or len(parts) != 2:
        raise ValueError(f"evaluate: expected a residual and its derivative, got {shown(parts)}")
    r = arguments.array("residual", parts[0], size)
    return r, arguments.array("derivative", parts[1], len(r), current.model.freedom_count)


def _solve_own(
    attempting: Operations, descending: DescentOperations, state: TaskState, q: FloatArray,
    tolerance: float, limit: int,
) -> tuple[int, int, float, float]:  # fmt: skip
    """Solve from coordinates with tasks of a user, in the interpreter."""
    if not _begin(state, q):
        return -1, 0, 0.0, 0.0
    with np.errstate(all="ignore"):
        solution: tuple[int, int, float, float] = solve(
            attempting, descending, state, tolerance, limit
        )
        return solution


_solve = Kernel(solve_from, label="solve_tasks")
_meet = Kernel(meet, label="solve_tasks, attempt")
_step = Kernel(step, label="solve_tasks, step")
_begin = Kernel(place, label="solve_tasks, start")
_place = Kernel(place_tasks, label="solve_tasks, pose")
_keep = Kernel(keep, label="solve_tasks, copy")
