"""Implicit Euler: one definition of the step in `objective`, one file for each way to solve it."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST_COORDINATE, FloatArray, choice, frozen, instance, integer, number
from ..mass_spring import MassSpring, State
from ..outcome import Outcome
from .certificate import Certificate, certify
from .chebyshev import Chebyshev
from .gauss_newton import GaussNewton
from .lbfgs import LBFGS
from .local_global import LocalGlobal
from .newton import Newton
from .newton_cg import NewtonCG
from .objective import STARTS, Iterate, Objective


class StepSolver(Protocol):
    """A way to minimise g, prepared for one system and one step length."""

    default_iterations: int

    def __init__(self, system: MassSpring, h: float) -> None:
        """Prepare what stays the same from step to step."""

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the start, then the iterate after each iteration, without end.

        A solver that can do no more yields the very same iterate again.
        """
        ...


STEP_SOLVERS: dict[str, type[StepSolver]] = {
    "local_global": LocalGlobal,
    "chebyshev": Chebyshev,
    "lbfgs": LBFGS,
    "newton": Newton,
    "newton_cg": NewtonCG,
    "gauss_newton": GaussNewton,
}

# Progress has ended once the least residual is so many iterations old, and this share of them all:
# an accelerated solver's residual rises and falls, the longer the slower it converges.
PATIENCE, PATIENT_SHARE = 3, 0.25


@dataclass(frozen=True, eq=False)
class StepResult:
    """One step of implicit Euler and how well it was solved.

    Attributes:
        state: positions x and velocities (x - x_n) / h after the step.
        residual: |grad g(x)| / max(|grad g(y)|, floor), over the free particles; infinity if the
            very start overflowed or all went beyond 1e75, and then the state is the one before.
        iterations: how many were run.
        outcome: how the solve ended.
        at_floor: whether |grad g(x)| is within what rounding can leave of it.
        history: the residual before and after each iteration, shape (iterations + 1,).
        objectives: g before and after each iteration, shape (iterations + 1,) [kg m²].
    """

    state: State
    residual: float
    iterations: int
    outcome: Outcome
    at_floor: bool
    history: FloatArray
    objectives: FloatArray


@dataclass(frozen=True, eq=False)
class ImplicitEuler:
    """Steps of implicit Euler, velocities and positions at their ends: M v' = M v + h f(x').

    Attributes:
        system: the system that steps.
        h: the step [s].
        solver: one of `STEP_SOLVERS`.
        tolerance: the residual at which a step is solved; at 0 all iterations are run.
        max_iterations: the most iterations in a step; None means the solver's own number.
        start: where the iterations begin, "y" or "x_n"; None means y for all but gauss_newton,
            which begins at x_n by definition. Residuals are measured by y all the same.
    """

    system: MassSpring
    _: KW_ONLY
    h: float = 1 / 60
    solver: str = "newton"
    tolerance: float = 1e-10
    max_iterations: int | None = None
    start: str | None = None
    _solver: StepSolver = field(init=False, repr=False)
    _limit: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the settings and let the solver prepare itself.

        Raises:
            ValueError: naming the setting, if one is out of range or unknown.
        """
        instance("system", self.system, MassSpring)
        object.__setattr__(self, "h", number("h", self.h, above=0))
        object.__setattr__(self, "tolerance", number("tolerance", self.tolerance, least=0))
        method = STEP_SOLVERS[choice("solver", self.solver, STEP_SOLVERS)]
        limit = method.default_iterations if self.max_iterations is None else self.max_iterations
        object.__setattr__(self, "_limit", integer("max_iterations", limit, least=0))
        object.__setattr__(self, "start", _start(self.solver, self.start))
        object.__setattr__(self, "_solver", method(self.system, self.h))

    def step(
        self,
        state: State,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> StepResult:
        """Return the state one step later and how well the step was solved.

        Args:
            state: where the step starts.
            external_forces: [N], shape (particle, 3), besides gravity; they stay through the step.
            pin_positions: where the pinned particles, in ascending order, are at the end of the
                step [m], shape (pinned, 3); by default they stay. Their velocity in the result is
                their way over h.

        Raises:
            ValueError: if the state has another number of particles, or the external forces or pin
                positions have another shape or are not finite.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # overflow is an outcome here
            objective = self.objective(state, external_forces, pin_positions)
            last, outcome, history, objectives = self._solve(objective)
            return _result(state, objective, last, outcome, history, objectives)

    def objective(
        self,
        state: State,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> Objective:
        """Return g of the step from this state.

        Raises:
            ValueError: as for `step`.
        """
        start = self.start or STARTS[0]
        return Objective(self.system, state, self.h, external_forces, pin_positions, start)

    def certify(
        self,
        state: State,
        result: StepResult | ArrayLike,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> Certificate:
        """Return what is known for sure about the end of a step, given what `step` was given.

        `result` is what `step` returned, or anyone's positions, shape (particle, 3) [m]. It costs
        about as much as three iterations of Newton's method; `certificate` says how it is proven. A
        result keeps nothing of the step that it solves, so that motions stay small: this is why the
        state and the forces are asked for again.

        Raises:
            ValueError: as for `step`, or if the positions have a wrong shape or are not finite.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            objective = self.objective(state, external_forces, pin_positions)
        x = result.state.positions if isinstance(result, StepResult) else result
        return certify(objective, x)

    def iterates(
        self,
        state: State,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> Iterator[Iterate]:
        """Yield the solver's start and the iterate after each iteration, without end.

        `step` takes the same ones and stops by tolerance and max_iterations.

        Raises:
            ValueError: as for `step`.
        """
        return self._solver.iterates(self.objective(state, external_forces, pin_positions))

    def _solve(
        self, objective: Objective
    ) -> tuple[Iterate | None, Outcome, list[float], list[float]]:
        """Return the last finite iterate, the outcome, and residual and g of each iterate."""
        last: Iterate | None = None
        residuals: list[float] = []
        values: list[float] = []
        best = 0
        if not objective.inertial.finite:
            return last, Outcome.DIVERGED, residuals, values
        for iterate in self._solver.iterates(objective):
            if not iterate.finite:
                break
            residuals.append(objective.residual(iterate))
            values.append(iterate.value)
            stuck, last = iterate is last, iterate
            if residuals[-1] < residuals[best]:
                best = len(residuals) - 1
            outcome = self._outcome(iterate, residuals, best, stuck)
            if outcome is not None:
                return last, outcome, residuals, values
        return last, Outcome.DIVERGED, residuals, values

    def _outcome(
        self, iterate: Iterate, residuals: list[float], best: int, stuck: bool
    ) -> Outcome | None:
        """Return how the solve ends with this iterate, or None if it goes on.

        The floor is a bound, often a thousand times what rounding really leaves: to be within it
        ends a solve only where the least residual, the one at `best`, is no longer improved upon.
        A start at rest, though, is not iterated.
        """
        count = len(residuals) - 1
        final = count >= self._limit
        if self.tolerance > 0 or final:
            if residuals[-1] <= self.tolerance:
                return Outcome.CONVERGED
            since = count - best
            ended = stuck or (since >= PATIENCE and since >= PATIENT_SHARE * count)
            if (ended and iterate.at_floor) or (count == 0 and iterate.at_rest):
                return Outcome.AT_ROUNDING
            if stuck:
                return Outcome.STALLED
        return Outcome.ITERATION_LIMIT if final else None


def _start(solver: str, start: str | None) -> str:
    """Return where a solver begins.

    Raises:
        ValueError: if the start is unknown, or Gauss-Newton is to begin at y.
    """
    valid = STARTS[1:] if solver == "gauss_newton" else STARTS
    return valid[0] if start is None else choice("start", start, valid)


def _result(
    before: State,
    objective: Objective,
    last: Iterate | None,
    outcome: Outcome,
    residuals: list[float],
    values: list[float],
) -> StepResult:
    if last is not None:
        velocities = last.positions - objective.x_n
        velocities /= objective.h
        if np.abs([last.positions, velocities]).max() <= LARGEST_COORDINATE:
            return StepResult(
                state=State.of(last.positions, velocities),
                residual=residuals[-1],
                iterations=len(residuals) - 1,
                outcome=outcome,
                at_floor=last.at_floor,
                history=frozen(np.array(residuals)),
                objectives=frozen(np.array(values)),
            )
    nothing = frozen(np.array([np.inf]))
    return StepResult(before, np.inf, 0, Outcome.DIVERGED, False, nothing, nothing)
