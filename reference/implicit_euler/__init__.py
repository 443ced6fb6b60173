"""Implicit Euler: the step as a minimisation in `objective`, a file for each solver."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST_COORDINATE, FloatArray, choice, frozen, instance, integer, number
from ..mass_spring import MassSpring, State
from ..outcome import Outcome
from .certificate import Certificate, certify
from .gauss_newton import GaussNewton
from .lbfgs import LBFGS
from .local_global import Chebyshev, LocalGlobal
from .newton import Newton
from .newton_cg import NewtonCG
from .objective import STARTS, Iterate, Objective


class StepMethod(Protocol):
    """A minimiser of g for a system and a step length."""

    default_iterations: int

    def __init__(self, system: MassSpring, h: float) -> None:
        """Compute the data shared by all steps, such as a factor or a sparsity pattern."""

    def iterates(self, objective: Objective) -> Iterator[Iterate]:
        """Yield the start, then the iterate after each iteration, without end.

        A solver that cannot improve an iterate yields the same object again.
        """
        ...


STEP_SOLVERS: dict[str, type[StepMethod]] = {
    "local_global": LocalGlobal,
    "chebyshev": Chebyshev,
    "lbfgs": LBFGS,
    "newton": Newton,
    "newton_cg": NewtonCG,
    "gauss_newton": GaussNewton,
}

# Stop early if the least residual is at least PATIENCE iterations and PATIENCE_RATIO of all
# iterations old. The residual of an accelerated solver oscillates, with a period that grows as its
# convergence slows down.
PATIENCE, PATIENCE_RATIO = 3, 0.25


@dataclass(frozen=True, eq=False)
class StepResult:
    """The result of a step of implicit Euler.

    Attributes:
        state: positions x and velocities (x - x_n) / h after the step.
        residual: |grad g(x)| / max(|grad g(y)|, floor), over the free particles; infinity if the
            start overflows or the result exceeds 1e75. The state is then the initial state.
        iterations: number of iterations.
        outcome: why the solver stopped. CONVERGED and AT_ROUNDING are about the gradient only and
            may stand at a saddle point, except for `newton`, which says SADDLE there.
        at_floor: whether |grad g(x)| is no more than rounding errors can cause.
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
    """An integrator that solves M v' = M v + h f(x'), x' = x + h v' in every step.

    Attributes:
        system: particles and springs.
        h: the step [s].
        solver: a name in `STEP_SOLVERS`.
        tolerance: residual to stop at; 0 runs all iterations.
        max_iterations: most iterations in a step; None means the solver's default.
        start: first iterate, "y" or "x_n"; None means y for all but gauss_newton, which starts at
            x_n by definition. Residuals are relative to y in both cases.
    """

    system: MassSpring
    _: KW_ONLY
    h: float = 1 / 60
    solver: str = "newton"
    tolerance: float = 1e-10
    max_iterations: int | None = None
    start: str | None = None
    _solver: StepMethod = field(init=False, repr=False)
    _iteration_limit: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Check the settings and prepare the solver.

        Raise a ValueError if a setting is out of range or unknown.
        """
        instance("system", self.system, MassSpring)
        object.__setattr__(self, "h", number("h", self.h, above=0))
        object.__setattr__(self, "tolerance", number("tolerance", self.tolerance, minimum=0))
        method = STEP_SOLVERS[choice("solver", self.solver, STEP_SOLVERS)]
        limit = method.default_iterations if self.max_iterations is None else self.max_iterations
        object.__setattr__(self, "_iteration_limit", integer("max_iterations", limit, minimum=0))
        starts = STARTS[1:] if self.solver == "gauss_newton" else STARTS
        start = starts[0] if self.start is None else choice("start", self.start, starts)
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "_solver", method(self.system, self.h))

    def step(
        self,
        state: State,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> StepResult:
        """Return the state one step later, with the residual and outcome of the solver.

        Args:
            state: positions and velocities at the start of the step.
            external_forces: [N], shape (particle, 3), besides gravity; constant during the step.
            pin_positions: positions of the pinned particles, in ascending order, at the end of the
                step [m], shape (pinned, 3); by default pins do not move. Their velocity in the
                result is their displacement over h.

        Raises:
            ValueError: if the state has another number of particles, or the external forces or pin
                positions have another shape or are not finite.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # overflow ends in DIVERGED
            objective = self.objective(state, external_forces, pin_positions)
            return self._solve(state, objective)

    def objective(
        self,
        state: State,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> Objective:
        """Return g of the step from this state; arguments and errors are as for `step`."""
        start = self.start or STARTS[0]
        return Objective(self.system, state, self.h, external_forces, pin_positions, start)

    def certify(
        self,
        state: State,
        result: StepResult | ArrayLike,
        external_forces: ArrayLike | None = None,
        pin_positions: ArrayLike | None = None,
    ) -> Certificate:
        """Return a proven bound on the distance from a result to the minimiser of g.

        `result` is a `StepResult` or positions, shape (particle, 3) [m]; the other arguments are
        the step's, which a result does not keep. The cost is about three iterations of Newton's
        method; `certificate` states the proof.
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

        `step` runs the same iterates and stops by tolerance and max_iterations.
        """
        return self._solver.iterates(self.objective(state, external_forces, pin_positions))

    def _solve(self, state: State, objective: Objective) -> StepResult:
        """Return the result of the last finite iterate, or the initial state on overflow."""
        last: Iterate | None = None
        residuals: list[float] = []
        objectives: list[float] = []
        best, outcome = 0, None
        for iterate in self._solver.iterates(objective) if objective.inertial.finite else ():
            if not iterate.finite:
                break
            residuals.append(objective.residual(iterate))
            objectives.append(iterate.value)
            is_stuck, last = iterate is last, iterate
            if residuals[-1] < residuals[best]:
                best = len(residuals) - 1
            outcome = self._outcome(objective, iterate, residuals, best, is_stuck)
            if outcome is not None:
                break
        if last is not None:
            velocities = last.positions - objective.x_n
            velocities /= objective.h
            if np.abs([last.positions, velocities]).max() <= LARGEST_COORDINATE:
                return StepResult(
                    state=State.of(last.positions, velocities),
                    residual=residuals[-1],
                    iterations=len(residuals) - 1,
                    outcome=Outcome.DIVERGED if outcome is None else outcome,
                    at_floor=last.at_floor,
                    history=frozen(np.array(residuals)),
                    objectives=frozen(np.array(objectives)),
                )
        infinite = frozen(np.array([np.inf]))
        return StepResult(state, np.inf, 0, Outcome.DIVERGED, False, infinite, infinite)

    def _outcome(
        self, objective: Objective, iterate: Iterate, residuals: list[float], best: int, stuck: bool
    ) -> Outcome | None:
        """Return the outcome if the solver stops at this iterate, else None.

        The floor is an upper bound, often a thousand times the actual rounding error. A gradient
        below the floor therefore stops the solver only if the start is at rest, or once the least
        residual, at index `best`, is no longer improved. Newton's method goes on from an indefinite
        Hessian as long as possible.
        """
        count = len(residuals) - 1
        final = count >= self._iteration_limit
        if self.tolerance > 0 or final:
            since, converged = count - best, residuals[-1] <= self.tolerance
            ended = stuck or (since >= PATIENCE and since >= PATIENCE_RATIO * count)
            at_rest = (ended and iterate.at_floor) or (count == 0 and iterate.at_rest)
            if converged or at_rest:
                newton = self._solver if isinstance(self._solver, Newton) else None
                if not (newton and newton.is_saddle(objective, iterate)):
                    return Outcome.CONVERGED if converged else Outcome.AT_ROUNDING
                if at_rest or stuck or final:
                    return Outcome.SADDLE
            if stuck:
                return Outcome.STALLED
        return Outcome.ITERATION_LIMIT if final else None
