"""Every solver's answer to one step of a swinging cloth, held against Newton's and certified."""

import copy
import functools
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.mass_spring.exact_step import ExactStep, exact_step
from plumbob.crosscheck.mass_spring.steps import balance_residual
from plumbob.reference import STEP_SOLVERS
from plumbob.reference.arguments import FloatArray
from plumbob.reference.implicit_euler.certificate import Certificate, certify
from plumbob.reference.implicit_euler.objective import Objective

from ...harness.block import Block, Measured, Scale
from ...peers import registry
from ..cloth.measurement import TOLERANCE, integrator_of
from ..cloth.problem import FRAME, HEAVY_STIFFNESSES, ClothSwing, mid_swing
from .values import Certified

SUITE = "newton"
# Iterations that are usual where steps have to be quick, and more than those of a quick solver.
USUAL, SLOW = 10, 1000
# From this stiffness on [N/m] the slow solvers also start beside Newton's answer, every coordinate
# off by about so much [m].
STIFF, BESIDE = 1e5, 1e-6
FROM_Y, FROM_BESIDE = "y", "beside Newton’s answer"
# Particles a side; a scale of so many random targets is full.
QUICK, FULL, _FULL = 10, 30, 2000


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield, for each stiffness, every solver's limit and ten local/global iterations."""
    size = FULL if scale.targets >= _FULL else QUICK
    for stiffness in HEAVY_STIFFNESSES:
        for solver, known in registry.step_solvers().items():
            limit = known.certified
            yield _block(size, stiffness, solver, FROM_Y, limit)
            if stiffness >= STIFF and limit >= SLOW:
                yield _block(size, stiffness, solver, FROM_BESIDE, limit)
        yield _block(size, stiffness, "local_global", FROM_Y, USUAL)


def _block(size: int, stiffness: float, solver: str, start: str, limit: int) -> Block:
    settings = {"h": FRAME, "start": start, "iterations": limit, "tolerance": TOLERANCE}
    measure = partial(certified_step, size, stiffness, solver, start, limit)
    facts = {"stiffness": stiffness}
    return Block(SUITE, f"swing/k{stiffness:g}", solver, measure, settings, size, facts)


def certified_step(size: int, stiffness: float, solver: str, start: str, limit: int) -> Measured:
    """Solve the step; keep what is known of the answer, and how far it is from Newton's."""
    problem = mid_swing(stiffness, size)
    newton, objective = newtons_answer(problem), Objective(problem.system, problem.start, problem.h)
    x, iterations = (
        _solved(problem, solver, limit)
        if start == FROM_Y
        else _solved_from_beside(problem, solver, limit)
    )
    known, here, apart = certify(objective, x), objective.evaluate(x), np.linalg.norm(x - newton.x)
    same = known.shares_minimiser(newton.certificate, float(apart))
    return Measured(
        Certified(
            size=size,
            iterations=iterations,
            residual=known.residual,
            at_floor=here.at_floor,
            balance=balance_residual(problem.system, problem.start, x, problem.h),
            distance=known.distance,
            curvature=known.curvature,
            lipschitz=known.lipschitz,
            newton_step=known.newton_step,
            apart=float(apart),
            error=newton.exact.error(x, objective.y),
            above=here.value - newton.value,
            covered=known.covered,
            same=same is True,
            different=same is False,
        ),
        {"coverage": known.coverage.name, "why": known.coverage.sentence},
    )


class Converged(NamedTuple):
    """Newton's answer x, the same to 25 digits, its certificate, and g there."""

    x: FloatArray
    exact: ExactStep
    certificate: Certificate
    value: float


@functools.cache
def newtons_answer(problem: ClothSwing) -> Converged:
    """Return what Newton's method comes to, iterated far beyond the rounding floor."""
    integrator = integrator_of(problem, tolerance=0.0, max_iterations=50)
    x, objective = (
        integrator.step(problem.start).state.positions,
        Objective(problem.system, problem.start, problem.h),
    )
    exact = exact_step(problem.system, problem.start, problem.h, x)
    return Converged(x, exact, certify(objective, x), objective.value(x))


def _solved(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    result = integrator_of(problem, solver, TOLERANCE, limit).step(problem.start)
    return result.state.positions, result.iterations


def _solved_from_beside(problem: ClothSwing, solver: str, limit: int) -> tuple[FloatArray, int]:
    """Return what the solver comes to, and after how many iterations, from beside the answer.

    Solvers start where the objective starts; the residual stays that of the step from y.
    """
    objective = Objective(problem.system, problem.start, problem.h)
    moved = copy.copy(objective)
    noise = np.random.default_rng(20130).standard_normal(objective.y.shape)
    noise[problem.system.pinned] = 0.0
    moved.start = objective.evaluate(newtons_answer(problem).x + BESIDE * noise)
    iterates = STEP_SOLVERS[solver](problem.system, problem.h).iterates(moved)
    for k, iterate in enumerate(iterates):
        if k == limit or iterate.at_floor or objective.residual(iterate) <= TOLERANCE:
            break
    return iterate.positions, k
