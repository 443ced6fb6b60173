"""Inverse kinematics of single targets, into the same arrays every time."""

import threading
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FLOAT64, boolean, floats, frozen, is_plain
from ..articulation import Articulation
from ..model import Model, checked_model, coordinates_name, effector_of
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .mechanism import TARGET
from .problem import Settings, Target, checked_settings, checked_targets, default_solver
from .reduce import prepare
from .restarts import FIGURES, OUTCOME
from .solve import OUTCOMES, PROVEN, UNRECORDED, prove_unreachable, solve_checked


class PreparedIK(threading.local):
    """Inverse kinematics of a model, a single target a call, into the same arrays every time.

    Each thread that shares the object has arrays of its own, NaN before its first call.

    Attributes:
        coordinates: of the last solution, read-only views of the arrays that the next call fills:
            the local rotations of a Skeleton, (joint, 4), or coordinates of an Articulation,
            (coordinate,).
        positions: of all joints in this pose [m], likewise, (joint, 3).
        figures: of IKSolution the residual, residual_rotation, iterations, outcome, merit and
            excess, likewise, (6,).
    """

    def __init__(
        self, model: Skeleton | Articulation, joint: int, oriented: bool, settings: Settings
    ):
        """Allocate the arrays of a thread; `prepare_ik` checks the arguments."""
        n, local = model.joint_count, np.full((1, model.joint_count, 4), np.nan)
        positions, figures = np.full((1, n, 3), np.nan), np.full((1, len(FIGURES)), np.nan)
        arrays: tuple[Any, ...]
        shape: tuple[int, ...]
        prove: Any = None
        if isinstance(model, Skeleton):
            shape, q, kernel = (n, 4), local, settings.solver.chain
            arrays = (*model.arrays, model.path_array(joint))
            targets: Any = np.empty((1, 3))
            row = targets[0]
            results: tuple[Any, ...] = local, positions, figures, UNRECORDED
        else:
            shape, kernel = (model.coordinate_count,), settings.solver.mechanism
            drawn = settings.limits.restarts, settings.seed
            arrays = (prepare(model, (joint,), (oriented,), *drawn).model,)
            targets, q = np.zeros((1, 1), TARGET), np.full((1, model.coordinate_count), np.nan)
            targets["rotation"], targets["weight"] = IDENTITY, 1.0
            row = targets.view(FLOAT64)[0, : 7 if oriented else 3]
            results = local, positions, figures, UNRECORDED, q
            request = model, (joint,), (oriented,), targets, figures, settings.limits
            prove = partial(prove_unreachable, *request)
        starts, self._arrays = np.empty((1, *shape)), (q, positions, figures)
        self._problem = model, joint, oriented, settings
        call = partial(kernel.in_force, *arrays, settings.numbers, starts, targets, *results)
        self.coordinates, self.positions = frozen(q[0]), frozen(positions[0])
        self.figures = frozen(figures[0])
        # one attribute, as a thread's attribute takes 0.05 µs
        self._work = call, shape, starts[0], row.shape, row, self.figures, prove

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what makes a copy, which has arrays of its own."""
        return type(self), self._problem

    def __call__(self, start: ArrayLike, target: ArrayLike) -> Outcome:
        """Solve for a target from a start; return the outcome.

        Args:
            start: local rotations, (joint, 4), or coordinates, (coordinate,).
            target: the effector's position [m], (3,); of an oriented effector also its rotation,
                (7,).

        Raises:
            ValueError: as `solve_ik` does. The solution is then not defined.
        """
        call, shape, start_row, target_shape, target_row, figures, prove = self._work
        if is_plain(start, shape) and is_plain(target, target_shape):
            start_row[...], target_row[...] = start, target
            if call():
                outcome = figures.item(OUTCOME)
                if outcome in PROVEN and prove is not None:
                    prove()
                    outcome = figures.item(OUTCOME)
                return OUTCOMES[outcome]
        self._solve_checked(start, target)
        return OUTCOMES[figures[OUTCOME]]

    def _solve_checked(self, start: ArrayLike, target: ArrayLike) -> None:
        """Solve by the route of `solve_ik`, which names what is wrong."""
        model, joint, _, settings = self._problem
        _, shape, _, target_shape, *_ = self._work
        q = floats(coordinates_name(model), start, *shape)
        values = floats("target", target, *target_shape)
        pose = Target(values[:3], values[3:] if len(values) > 3 else None, joint)
        solution = solve_checked(model, q, checked_targets(model, pose, None), settings)
        figures = (
            solution.residual, solution.residual_rotation, solution.iterations, solution.outcome,
            solution.merit, solution.excess,
        )  # fmt: skip
        results = solution.coordinates, solution.positions, figures
        for array, row in zip(self._arrays, results, strict=True):
            array[0] = row


def prepare_ik(
    model: Model,
    solver: str | None = None,
    effector: int | str | None = None,
    *,
    oriented: bool = False,
    tolerance: float = 1e-4,
    tolerance_rotation: float = 1e-4,
    max_iterations: int | None = None,
    restarts: int | None = None,
    phases: int | None = None,
    seed: int = 0,
) -> PreparedIK:
    """Return `solve_ik` for many single targets: `prepare_ik(model)(start, target)`.

    Arguments are as in `solve_ik`; `oriented` is whether targets have rotations. The kernel is of
    the backend now in force.

    Raises:
        ValueError: if an argument is not valid, or targets on a Skeleton are oriented or restarted.
    """
    checked, is_oriented = checked_model(model, "model"), boolean("oriented", oriented)
    if solver is None:
        likely = Target((0.0, 0.0, 0.0), IDENTITY if is_oriented else None)
        solver, default_restarts = default_solver(checked, likely)
        restarts = default_restarts if restarts is None else restarts
    settings = checked_settings(
        solver,
        tolerance,
        tolerance_rotation,
        max_iterations,
        0 if restarts is None else restarts,
        seed,
        False,
        phases,
    )
    if isinstance(checked, Skeleton) and (is_oriented or settings.limits.restarts):
        raise ValueError(
            "model: expected an Articulation for rotations or restarts, got a Skeleton"
        )
    return PreparedIK(checked, effector_of(checked, effector), is_oriented, settings)
