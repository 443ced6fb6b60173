"""Steps of the lab's cloth from mid-swing: the same work by us and by MuJoCo."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mujoco
import numpy as np

from plumbob.crosscheck.engines import MujocoMassSpring
from plumbob.reference import ImplicitEuler, State, symplectic_euler
from plumbob.reference.implicit_euler.factor_cache import global_factor
from plumbob.reference.sparse import CholeskyFactor

from ...harness import metrics
from ...problems.cloth_swing import MIDDLE, ClothSwing, cloth_swing, converged_motion, motion
from .case import COMPILED, PLAIN, TIGHT, TimedCase, TimedWork, copying

FACTORS = (1, 100)
SUBSTEPS = ITERATIONS = 10
# Particles along a side of a larger cloth, whose factor exceeds the nearest caches.
LARGE = 50
# Newton's motion of more particles than this would take longer than all the timing.
MANY_PARTICLES = 1000
MUJOCO, DEFAULT = "MuJoCo", mujoco.MjOption()

# Sets a problem up and returns the call to be timed.
Starter = Callable[[ClothSwing], Callable[[], Any]]


def cases() -> Iterator[TimedCase]:
    """Yield a frame of 1/60 s by four methods, at two stiffnesses, and of a larger cloth."""
    for factor in FACTORS:
        problem = cloth_swing(factor)
        for title, (reference, engines) in WORKS.items():
            work = _work(f"x{factor:g}", f"stiffness × {factor:g}", title)
            yield TimedCase(work, COMPILED, partial(reference, problem))
            yield TimedCase(work, PLAIN, partial(reference, problem), backend="python")
            for name, engine in engines.items():
                error = partial(step_error, engine, problem) if len(engines) > 1 else None
                yield TimedCase(work, name, partial(engine, problem), error=error)
        yield solving(_work(f"x{factor:g}", f"stiffness × {factor:g}", LOCAL_GLOBAL), problem)
    large, group = cloth_swing(1, LARGE), f"{LARGE} × {LARGE} particles"
    work = _work(group, group, LOCAL_GLOBAL)
    yield TimedCase(work, COMPILED, partial(local_global, large))
    yield solving(work, large)


def _work(name: str, group: str, title: str) -> TimedWork:
    return TimedWork(f"cloth/{name}/{title}", "cloth", group, title)


def stepping(problem: ClothSwing, **settings: Any) -> Callable[[], Any]:
    """Return a step of implicit Euler, factorised beforehand."""
    integrator = ImplicitEuler(problem.system, h=problem.h, **settings)
    return partial(integrator.step, moving(problem))


def substeps(problem: ClothSwing) -> Callable[[], Any]:
    """Return a frame of explicit substeps."""
    start = moving(problem)

    def run() -> State:
        state = start
        for _ in range(SUBSTEPS):
            state = symplectic_euler(problem.system, state, h=problem.h / SUBSTEPS)
        return state

    return run


def mujoco_steps(
    problem: ClothSwing, integrator: str, count: int, is_tight: bool = False
) -> Callable[[], MujocoMassSpring]:
    """Return a frame of MuJoCo's steps, from and to its own state, without conversions.

    Tolerance and iterations are MuJoCo's defaults, or the cross-check's.
    """
    engine = MujocoMassSpring(problem.system, h=problem.h / count, integrator=integrator)
    option = engine.model.opt
    option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    if not is_tight:
        option.tolerance, option.iterations = DEFAULT.tolerance, DEFAULT.iterations
    engine.write(moving(problem))
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    start = np.empty(mujoco.mj_stateSize(engine.model, kind))
    mujoco.mj_getState(engine.model, engine.data, start, kind)

    def run() -> MujocoMassSpring:
        mujoco.mj_setState(engine.model, engine.data, start, kind)
        mujoco.mj_step(engine.model, engine.data, count)
        return engine

    return run


def step_error(engine: Callable[..., Any], problem: ClothSwing) -> float:
    """Return the error of MuJoCo's linearised step relative to its length, by a direct solve."""
    exact = stepping(problem, solver="gauss_newton")().state.positions
    start = moving(problem).positions
    return metrics.relative_error(engine(problem)().read().positions, exact, start)


def moving(problem: ClothSwing) -> State:
    """Return a state in mid-swing; a large cloth gets there by a few iterations a step."""
    if problem.system.particle_count <= MANY_PARTICLES:
        return converged_motion(problem)[MIDDLE]
    integrator = ImplicitEuler(
        problem.system, h=problem.h, solver="local_global", max_iterations=ITERATIONS
    )
    return motion(problem.start, MIDDLE, integrator)[-1]


def solving(work: TimedWork, problem: ClothSwing) -> TimedCase:
    """Return a copy of the bytes read by the triangular solves: L twice an iteration.

    A nonzero has eight bytes; the nonzeros of a block share indices.
    """
    factor = global_factor(problem.system, problem.h)
    assert isinstance(factor, CholeskyFactor)
    return copying(work, 8 * factor.entries, passes=2 * ITERATIONS)


LOCAL_GLOBAL = f"implicit Euler, {ITERATIONS} local-global iterations"
local_global: Starter = partial(
    stepping, solver="local_global", tolerance=0.0, max_iterations=ITERATIONS
)
discrete = partial(mujoco_steps, integrator="discrete", count=1)
WORKS: dict[str, tuple[Starter, dict[str, Starter]]] = {
    LOCAL_GLOBAL: (local_global, {}),
    "implicit Euler, Newton to 1e-10": (stepping, {}),
    "implicit Euler, linearised once": (
        partial(stepping, solver="gauss_newton"),
        {MUJOCO: discrete, TIGHT: partial(discrete, is_tight=True)},
    ),
    f"symplectic Euler, {SUBSTEPS} substeps": (
        substeps,
        {MUJOCO: partial(mujoco_steps, integrator="Euler", count=SUBSTEPS)},
    ),
}
