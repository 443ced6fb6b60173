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

from ..cloth.measurement import MIDDLE, converged_motion, motion
from ..cloth.problem import ClothSwing, cloth_swing
from .case import COMPILED, PLAIN, Case, Work, copying

FACTORS = (1, 100)
SUBSTEPS = 10
ITERATIONS = 10
# A larger cloth, whose factor no longer fits into the nearest caches.
LARGE = 50
# Newton's motion of more particles than this would take longer than all the timing.
MANY = 1000
MUJOCO = "MuJoCo"

# Sets a problem up and returns the call to be timed.
Starter = Callable[[ClothSwing], Callable[[], Any]]


def cases() -> Iterator[Case]:
    """Yield one frame of 1/60 s by four methods, at two stiffnesses, and of a larger cloth."""
    for factor in FACTORS:
        problem = cloth_swing(factor)
        written = f"stiffness × {factor:g}"
        for title, (ours, theirs) in WORKS.items():
            work = Work(f"cloth/x{factor:g}/{title}", "cloth", written, title)
            yield Case(work, COMPILED, partial(ours, problem))
            yield Case(work, PLAIN, partial(ours, problem), backend="python")
            if theirs:
                yield Case(work, MUJOCO, partial(theirs, problem))
        work = Work(f"cloth/x{factor:g}/{LOCAL_GLOBAL}", "cloth", written, LOCAL_GLOBAL)
        yield solving(work, problem)
    large = cloth_swing(1, LARGE)
    group = f"{LARGE} × {LARGE} particles"
    work = Work(f"cloth/{group}/{LOCAL_GLOBAL}", "cloth", group, LOCAL_GLOBAL)
    yield Case(work, COMPILED, partial(local_global, large))
    yield solving(work, large)


def stepping(problem: ClothSwing, **settings: Any) -> Callable[[], Any]:
    """Return one step of implicit Euler, factorised beforehand."""
    integrator = ImplicitEuler(problem.system, h=problem.h, **settings)
    return partial(integrator.step, moving(problem))


def substeps(problem: ClothSwing) -> Callable[[], Any]:
    """Return one frame of explicit substeps."""

    def run() -> State:
        state = start
        for _ in range(SUBSTEPS):
            state = symplectic_euler(problem.system, state, h=problem.h / SUBSTEPS)
        return state

    start = moving(problem)
    return run


def mujoco_steps(problem: ClothSwing, integrator: str, count: int) -> Callable[[], Any]:
    """Return one frame of MuJoCo's steps, from and to its own state, without conversions."""
    engine = MujocoMassSpring(problem.system, h=problem.h / count, integrator=integrator)
    engine.model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    engine.write(moving(problem))
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    saved = np.empty(mujoco.mj_stateSize(engine.model, kind))
    mujoco.mj_getState(engine.model, engine.data, saved, kind)

    def run() -> MujocoMassSpring:
        mujoco.mj_setState(engine.model, engine.data, saved, kind)
        mujoco.mj_step(engine.model, engine.data, count)
        return engine

    return run


def moving(problem: ClothSwing) -> State:
    """Return a state in mid-swing; a large cloth gets there by a few iterations a step."""
    if problem.system.particle_count > MANY:
        integrator = ImplicitEuler(
            problem.system, h=problem.h, solver="local_global", max_iterations=ITERATIONS
        )
        return motion(problem.start, MIDDLE, integrator)[-1]
    return converged_motion(problem)[MIDDLE]


def solving(work: Work, problem: ClothSwing) -> Case:
    """Return a copy of what the triangular solves read, all of L twice an iteration."""
    return copying(work, factor_bytes(problem), passes=2 * ITERATIONS)


def factor_bytes(problem: ClothSwing) -> int:
    """Return the bytes of L of M + h² L: its nonzeros; a block of them shares its indices."""
    factor = global_factor(problem.system, problem.h)
    assert isinstance(factor, CholeskyFactor)
    return 8 * factor.entries


LOCAL_GLOBAL = f"implicit Euler, {ITERATIONS} local-global iterations"
# A fixed number of local/global iterations.
local_global: Starter = partial(
    stepping, solver="local_global", tolerance=0.0, max_iterations=ITERATIONS
)
WORKS: dict[str, tuple[Starter, Starter | None]] = {
    LOCAL_GLOBAL: (local_global, None),
    "implicit Euler, Newton to 1e-10": (stepping, None),
    "implicit Euler, linearised once": (
        partial(stepping, solver="gauss_newton"),
        partial(mujoco_steps, integrator="discrete", count=1),
    ),
    f"symplectic Euler, {SUBSTEPS} substeps": (
        substeps,
        partial(mujoco_steps, integrator="Euler", count=SUBSTEPS),
    ),
}
