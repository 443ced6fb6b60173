"""Inverse kinematics of single targets, into the same arrays every time."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import boolean, floats, frozen, is_plain
from ..articulation import Articulation
from ..backend.threads import ArraysOfThread
from ..model import Model, checked_model, coordinates_name, effector_of
from ..outcome import Outcome
from ..quaternion import IDENTITY
from ..skeleton import Skeleton
from .problem import Settings, Target, checked_settings, checked_targets, default_solver
from .reduce import prepare, prepare_chain
from .result import OUTCOME, result_on, result_size
from .solve import FREE_TARGET, OUTCOMES, PROVEN, prove_unreachable, refusal


class PreparedIK(ArraysOfThread):
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
        prove: Any = None
        shape: tuple[int, ...] = (model.joint_count, 4)
        if isinstance(model, Skeleton):
            problem, kernel = prepare_chain(model, joint), settings.solver.chain
        else:
            restarts, kernel = settings.limits.restarts, settings.solver.mechanism
            problem = prepare(model, (joint,), (oriented,), restarts, settings.seed)
            shape = (model.coordinate_count,)
        length, sizes = 7 if oriented else 3, (problem.joints, problem.coordinates)
        start, memory = np.empty(shape), np.full(result_size(*sizes, 1), np.nan)
        target = FREE_TARGET[: 3 if isinstance(model, Skeleton) else None].copy()
        local, positions, figures, q, _ = [values[0] for values in result_on(memory, 1, *sizes)]
        if isinstance(model, Skeleton):
            q = local
        else:
            prove = partial(prove_unreachable, model, problem, target, memory, settings.limits)
        self._problem = model, joint, oriented, settings
        numbers = settings.numbers, start.reshape(-1), target, memory
        call = partial(kernel.in_force, problem.memory, *numbers, 0, 1)
        self.coordinates, self.positions = frozen(q), frozen(positions)
        self.figures = frozen(figures)
        # one attribute, as a thread's attribute takes 0.05 µs
        self._work = call, shape, start, (length,), target[:length], self.figures, prove

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
        return self._solve_checked(start, target)

    def _solve_checked(self, start: ArrayLike, target: ArrayLike) -> Outcome:
        """Solve for arguments of other types; name what is wrong with them."""
        model, joint, _, settings = self._problem
        _, shape, _, target_shape, *_ = self._work
        q = floats(coordinates_name(model), start, *shape)
        values = floats("target", target, *target_shape)
        if q is start and values is target:  # which the kernel has refused
            pose = Target(values[:3], values[3:] if len(values) > 3 else None, joint)
            raise refusal(model, q, checked_targets(model, pose, None), settings)
        return self(q, values)


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
        solver, tolerance, tolerance_rotation, max_iterations,
        0 if restarts is None else restarts, seed, False, phases,
    )  # fmt: skip
    if isinstance(checked, Skeleton) and (is_oriented or settings.limits.restarts):
        raise ValueError(
            "model: expected an Articulation for rotations or restarts, got a Skeleton"
        )
    return PreparedIK(checked, effector_of(checked, effector), is_oriented, settings)
