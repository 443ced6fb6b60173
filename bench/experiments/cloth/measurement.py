"""The lab's cloth: how implicit Euler's solvers converge, and what one iteration leaves behind."""

import functools
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import exact_step
from plumbob.reference import ImplicitEuler, State
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import MassSpring, damper_forces, lengths, spring_forces

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...peers import registry
from . import DAMPERS, FEW, ONE_STEP, SWING
from .problem import DAMPING, FACTORS, ClothSwing, H, cloth_swing
from .values import Converged, Dampers, FewIterations, Iterated

# The cloth falls for three seconds; the steps of the next second are looked at.
FALLING = 180
STEPS = 60
TOLERANCE = 1e-10
# The step whose convergence is followed iteration by iteration.
MIDDLE = FALLING + STEPS // 2
FEW_ITERATIONS = (1, 10, 100)
# Steps in which the two laws of dampers are compared [s], each half the one before.
HALVED = tuple(H / 2**i for i in range(-1, 6))


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield, for each stiffness: consecutive Newton steps, one step's iterations, few iterations.

    The cloth is the same at every scale.
    """
    for factor in FACTORS:
        problem = cloth_swing(factor)
        title = {"title": f"stiffness × {factor:g}"}
        for task, name, solver, measure, settings in _measurements(problem, factor):
            facts = {**title, "task": task}
            yield Block("cloth", f"{problem.name}{name}", solver, measure, settings, facts=facts)


# Its task, name and solver, how it is measured, and with which settings.
_Measurement = tuple[str, str, str, Callable[[], Measured], dict[str, Any]]


def _measurements(problem: ClothSwing, factor: float) -> Iterator[_Measurement]:
    swinging = {"h": H, "first": FALLING, "steps": STEPS}
    settings = {**swinging, "tolerance": TOLERANCE}
    yield (SWING, "", "newton", partial(newton_steps, problem), settings)
    for solver in registry.followed_step_solvers():
        measure = partial(one_step, problem, solver.name, solver.followed)
        settings = {"h": H, "step": MIDDLE, "iterations": solver.followed}
        yield (ONE_STEP, "/one step", solver.name, measure, settings)
    for count in FEW_ITERATIONS:
        measure = partial(few_iterations, problem, count)
        settings = {**swinging, "iterations": count}
        yield (FEW, "/few iterations", "local_global", measure, settings)
    measure = partial(two_dampers, cloth_swing(factor, damping=DAMPING))
    settings = {"first": MIDDLE, "damping": DAMPING}
    settings |= {"longest": HALVED[0], "halvings": len(HALVED) - 1}
    yield (DAMPERS, "/dampers", "newton", measure, settings)


def newton_steps(problem: ClothSwing) -> Measured:
    """Take consecutive swinging steps by Newton; keep iterations and residual of each."""
    integrator = integrator_of(problem)
    results = [integrator.step(state) for state in converged_motion(problem)[FALLING:-1]]
    columns = zip(
        *((r.iterations, r.residual, r.outcome, r.at_floor) for r in results), strict=True
    )
    return Measured(Converged(*map(np.array, columns)))


def one_step(problem: ClothSwing, solver: str, iterations: int) -> Measured:
    """Iterate one step from mid-swing; keep residual and error after each iteration."""
    state = converged_motion(problem)[MIDDLE]
    newton = integrator_of(problem, tolerance=0.0, max_iterations=50).step(state).state.positions
    exact = exact_step(problem.system, state, problem.h, newton)
    objective = integrator_of(problem).objective(state)
    iterates = ImplicitEuler(problem.system, h=problem.h, solver=solver).iterates(state)
    pairs = [
        (objective.residual(iterate), exact.error(iterate.positions, objective.y))
        for _, iterate in zip(range(iterations + 1), iterates, strict=False)
    ]
    return Measured(Iterated(*np.array(pairs).T))


def few_iterations(problem: ClothSwing, iterations: int) -> Measured:
    """Compare steps of a few local/global iterations with converged ones.

    A step's error is that of one such step from each state of the converged motion. The drift is
    the distance between the converged motion and one that takes all its steps so; the path, that
    of the converged motion from where both began.
    """
    few = integrator_of(problem, "local_global", 0.0, iterations)
    start, *exact = true = converged_motion(problem)[FALLING:]
    after = [few.step(state).state for state in true[:-1]]
    inertial = [integrator_of(problem).objective(state).y for state in true[:-1]]
    errors = [
        metrics.relative_error(state.positions, x.positions, y)
        for state, x, y in zip(after, exact, inertial, strict=True)
    ]
    pairs = after, motion(start, STEPS, few)[1:], [start] * STEPS
    distances = (
        [metrics.rms_distance(a.positions, b.positions) for a, b in zip(states, exact, strict=True)]
        for states in pairs
    )
    return Measured(FewIterations(*map(np.array, (errors, *distances))))


def two_dampers(problem: ClothSwing, first: int = MIDDLE) -> Measured:
    """Take one step of each length after the first ones; compare the two laws at its end."""
    state, apart = motion(problem.start, first, integrator_of(problem))[-1], []
    for h in HALVED:
        end = ImplicitEuler(problem.system, h=h).step(state).state
        rates = damper_forces(problem.system, end)
        differences = step_damper_forces(problem.system, state, end, h)
        apart.append(np.linalg.norm(differences - rates) / np.linalg.norm(rates))
    return Measured(Dampers(np.array(HALVED), np.array(apart)))


def step_damper_forces(system: MassSpring, before: State, after: State, h: float) -> FloatArray:
    """Return the forces -(c/h) (l - l_n) u of a step's dampers at its end [N], (particle, 3)."""
    count = len(system.springs)
    dampers = system.replaced(
        stiffnesses=system.dampings / h,
        rest_lengths=lengths(system, before.positions),
        tension_only=np.zeros(count, dtype=bool),
    )
    return spring_forces(dampers, after.positions)


def integrator_of(
    problem: ClothSwing,
    solver: str = "newton",
    tolerance: float = TOLERANCE,
    max_iterations: int = 100,
) -> ImplicitEuler:
    """Return an integrator of a cloth, as it is one that solves every step to the end."""
    limits: dict[str, Any] = {"tolerance": tolerance, "max_iterations": max_iterations}
    return ImplicitEuler(problem.system, h=problem.h, solver=solver, **limits)


@functools.cache
def converged_motion(problem: ClothSwing) -> tuple[State, ...]:
    """Return the states of the four seconds by converged steps, the start first."""
    return tuple(motion(problem.start, FALLING + STEPS, integrator_of(problem)))


def motion(start: State, steps: int, integrator: ImplicitEuler) -> list[State]:
    """Return the states of consecutive steps, the start first."""
    states = [start]
    for _ in range(steps):
        states.append(integrator.step(states[-1]).state)
    return states
