"""Implicit Euler: the step as a minimisation in `objective`, a file for each solver."""

from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import FloatArray, choice, count, frozen, instance, number
from ..backend.compiled import Kernel
from ..mass_spring import (
    MassSpring,
    State,
    check_particles,
    constant_forces,
    pin_targets,
)
from ..outcome import Outcome
from .certificate import Certificate, certify
from .gauss_newton import GaussNewton
from .lbfgs import LBFGS
from .local_global import Chebyshev, LocalGlobal
from .newton import Newton
from .newton_cg import NewtonCG
from .objective import STARTS, Iterate, Objective, begin_at
from .stopping import DIVERGED, GO_ON, outcome_at
from .terms import step_end


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

OUTCOMES = tuple(Outcome)
# Stands for no positions of pins and no start. Read-only as the arrays of states are: a kernel is
# compiled again for arguments of another type.
NOWHERE = frozen(np.empty((0, 3)))
# Positions and velocities at the end of a step, (2, particle, 3); residuals and values of g before
# and after each iteration, (2, iterations + 1), none on overflow; whether the gradient is at the
# floor; the outcome.
StepEnd = tuple[FloatArray, FloatArray, bool, int]


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
        solver: a name in `STEP_SOLVERS`: "newton", "newton_cg", "gauss_newton", "local_global",
            "chebyshev" or "lbfgs".
        tolerance: residual to stop at; 0 runs all iterations.
        max_iterations: most iterations in a step, at most 1e8; None means the solver's default.
        start: first iterate, "y", "x_n", or "explicit", the positions after h by stable steps of
            symplectic Euler, or y if more than 1,000 steps were needed. An explicit start saves
            iterations on stiff systems. None means y for all solvers but gauss_newton, which starts
            at x_n by definition.
            Residuals are relative to y in all cases.
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
        object.__setattr__(self, "_iteration_limit", count("max_iterations", limit, minimum=0))
        starts = ("x_n",) if self.solver == "gauss_newton" else STARTS
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
        end = self._in_one_kernel(state, external_forces, pin_positions)
        if end is None:
            with np.errstate(over="ignore", invalid="ignore"):  # overflow ends in DIVERGED
                end = self._minimised(self.objective(state, external_forces, pin_positions))
        return _result(state, *end)

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

    def _in_one_kernel(
        self, state: State, external_forces: ArrayLike | None, pin_positions: ArrayLike | None
    ) -> StepEnd | None:
        """Return the end of a step by `step_by`, or None if the solver has no such kernel.

        Newton has it; so has GaussNewton while pins stay.
        """
        if not isinstance(self._solver, Newton | GaussNewton):
            return None
        system = self.system
        check_particles(system, state)
        external = system.weights
        if external_forces is not None:
            external = constant_forces(system, external_forces)
        targets = NOWHERE
        if pin_positions is not None:
            targets = frozen(pin_targets(system, pin_positions))
        begin, stop = None, (self.tolerance, self._iteration_limit)
        if self.start != "y":
            start = self.start or STARTS[0]
            begin = begin_at(start, system, state, self.h, external_forces, pin_positions)
        motion = state.positions, state.velocities
        return self._solver.step(
            motion, external, targets, NOWHERE if begin is None else begin, self.h, stop
        )

    def _minimised(self, objective: Objective) -> StepEnd:
        """Return the end of a step by the solver's iterates."""
        last: Iterate | None = None
        residuals: list[float] = []
        objectives: list[float] = []
        best, outcome, stop = 0, GO_ON, (self.tolerance, self._iteration_limit)
        for iterate in self._solver.iterates(objective) if objective.inertial.finite else ():
            if not iterate.finite:
                break
            residuals.append(objective.residual(iterate))
            objectives.append(iterate.value)
            is_stuck, last, iteration = iterate is last, iterate, len(residuals) - 1
            if residuals[-1] < residuals[best]:
                best = iteration
            standing = residuals[-1], best, is_stuck, iterate.at_floor, iterate.at_rest
            outcome, _ = outcome_at(iteration, stop, *standing)
            if outcome != GO_ON:
                break
        x = objective.x_n if last is None else last.positions
        end = _step_end(objective.x_n, x, self.h, np.array([residuals, objectives]))
        at_floor = last is not None and last.at_floor
        return *end, at_floor, DIVERGED if outcome == GO_ON else outcome


def _result(
    state: State, end: FloatArray, history: FloatArray, at_floor: bool, outcome: int
) -> StepResult:
    """Return the result of a step from a state, the state itself on overflow."""
    if len(history[0]) == 0:
        infinite = frozen(np.array([np.inf]))
        return StepResult(state, np.inf, 0, Outcome.DIVERGED, False, infinite, infinite)
    result = object.__new__(StepResult)  # in half the time of the constructor
    residuals, objectives = history[0], history[1]
    result.__dict__.update(
        state=State.of(end[0], end[1]),
        residual=float(residuals[-1]),
        iterations=len(residuals) - 1,
        outcome=OUTCOMES[outcome],
        at_floor=at_floor,
        history=frozen(residuals),
        objectives=frozen(objectives),
    )
    return result


_step_end = Kernel(step_end)
