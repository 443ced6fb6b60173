"""Convergence of implicit Euler's solvers on the lab's cloth, and the error of few iterations."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import exact_step
from plumbob.reference import ImplicitEuler, MassSpring, State
from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import damper_forces, lengths, spring_forces

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...peers import catalogue
from ...problems.cloth_swing import (
    FALLING,
    MIDDLE,
    STEPS,
    ClothSwing,
    H,
    cloth_swing,
    converged_motion,
    integrator_of,
    motion,
)
from . import DAMPERS, FEW, ONE_STEP

FACTORS = (1, 10, 100)
DAMPING = 0.2  # of the lab's own cloth; elsewhere it swings undamped
FEW_ITERATIONS = (1, 10, 100)
# Steps in which the two laws of dampers are compared [s], each half as long as the last.
HALVED = tuple(H / 2**i for i in range(-1, 6))


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield, for each stiffness: the iterations of a step, few iterations, dampers.

    The cloth is the same at every scale.
    """
    swing = {"h": H, "first": FALLING, "steps": STEPS}
    for factor in FACTORS:
        problem, block = cloth_swing(factor), partial(_block, factor)
        for solver in catalogue.followed_step_solvers():
            measure = partial(one_step, problem, solver.name, solver.followed)
            settings = {"h": H, "step": MIDDLE, "iterations": solver.followed}
            yield block(ONE_STEP, solver.name, measure, **settings)
        for count in FEW_ITERATIONS:
            measure = partial(few_iterations, problem, count)
            yield block(FEW, "local_global", measure, **swing, iterations=count)
        measure = partial(two_dampers, cloth_swing(factor, damping=DAMPING))
        settings = {"first": MIDDLE, "damping": DAMPING}
        settings |= {"longest": HALVED[0], "halvings": len(HALVED) - 1}
        yield block(DAMPERS, "newton", measure, **settings)


def _block(
    factor: float, task: str, solver: str, measure: Callable[[], Measured], **settings: Any
) -> Block:
    problem = f"{cloth_swing(factor).name}/{task}"
    facts = {"title": f"stiffness × {factor:g}", "task": task}
    return Block("cloth", problem, solver, measure, settings, facts=facts)


def one_step(problem: ClothSwing, solver: str, iterations: int) -> Measured:
    """Iterate a step from mid-swing; keep residual and error after each iteration."""
    state = converged_motion(problem)[MIDDLE]
    newton = integrator_of(problem, tolerance=0.0, max_iterations=50).step(state).state.positions
    exact = exact_step(problem.system, state, problem.h, newton)
    objective = integrator_of(problem).objective(state)
    iterates = ImplicitEuler(problem.system, h=problem.h, solver=solver).iterates(state)
    pairs = [
        (objective.residual(iterate), exact.error(iterate.positions, objective.y))
        for _, iterate in zip(range(iterations + 1), iterates, strict=False)
    ]
    return dict(zip(("residual", "error"), np.array(pairs).T, strict=True))


def few_iterations(problem: ClothSwing, iterations: int) -> Measured:
    """Compare steps of a few local/global iterations with converged steps.

    The error and distance are measured after a single step from each state of the converged motion.
    The drift is the distance between the converged motion and a motion of only truncated steps. The
    path is the distance of the converged motion from its start.
    """
    integrator = integrator_of(problem, "local_global", 0.0, iterations)
    start, *exact = converged = converged_motion(problem)[FALLING:]
    ends = [integrator.step(state).state for state in converged[:-1]]
    inertial = [integrator_of(problem).objective(state).y for state in converged[:-1]]
    errors = [
        metrics.relative_error(end.positions, x.positions, y)
        for end, x, y in zip(ends, exact, inertial, strict=True)
    ]
    motions = {
        "distance": ends,
        "drift": motion(start, STEPS, integrator)[1:],
        "path": [start] * STEPS,
    }
    distances = {
        name: np.array(
            [
                metrics.rms_distance(a.positions, b.positions)
                for a, b in zip(states, exact, strict=True)
            ]
        )
        for name, states in motions.items()
    }
    return {"error": np.array(errors), **distances}


def two_dampers(problem: ClothSwing, first: int = MIDDLE) -> Measured:
    """Take a step of each length from mid-swing; compare the two laws at its end."""
    state = motion(problem.start, first, integrator_of(problem))[-1]
    differences = []
    for h in HALVED:
        end = ImplicitEuler(problem.system, h=h).step(state).state
        rates = damper_forces(problem.system, end)
        offsets = step_damper_forces(problem.system, state, end, h) - rates
        differences.append(np.linalg.norm(offsets) / np.linalg.norm(rates))
    return {"h": np.array(HALVED), "difference": np.array(differences)}


def step_damper_forces(system: MassSpring, before: State, after: State, h: float) -> FloatArray:
    """Return the forces -(c/h) (l - l_n) u of a step's dampers at its end [N], (particle, 3)."""
    dampers = system.replaced(
        stiffnesses=system.dampings / h,
        rest_lengths=lengths(system, before.positions),
        tension_only=np.zeros(len(system.springs), dtype=bool),
    )
    return spring_forces(dampers, after.positions)
