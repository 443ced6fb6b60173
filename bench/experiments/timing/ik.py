"""Inverse kinematics of the ten-ball chain, target by target from random starts."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from plumbob.crosscheck.engines import SKELETON_ENGINES, SkeletonEngine
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import IK_SOLVERS, prepare_ik, solve_ik

from ...peers import catalogue
from ...peers.levenberg_marquardt import ReferenceKinematics, levenberg_marquardt
from ...problems.chains import chain_targets
from ..chain.measurement import MAX_ITERATIONS, TOLERANCE
from .case import COMPILED, PLAIN, PREPARED, TimedCase, TimedWork

STRATA = ("near", "far")
# Plain Python takes milliseconds a solve; the first targets of the same set are enough.
TARGETS, FEW_TARGETS = 50, 5
LIMITS: dict[str, Any] = {"tolerance": TOLERANCE, "max_iterations": MAX_ITERATIONS}
# The same method as a Python loop on three kinematics.
LOOP = "levenberg_marquardt"
KINEMATICS: dict[str, Callable[[Any], SkeletonEngine]] = {
    catalogue.OUR_KINEMATICS.name: ReferenceKinematics,
    **{
        loop.name: SKELETON_ENGINES[loop.engine]
        for loop in catalogue.LOOPS
        if loop.engine in SKELETON_ENGINES
    },
}


def cases() -> Iterator[TimedCase]:
    """Yield our solvers in all forms, and a Python loop on three kinematics."""
    for stratum in STRATA:
        for solver in IK_SOLVERS:
            work = _work(stratum, solver)
            single = partial(single_solves, stratum, solver)
            yield TimedCase(work, COMPILED, partial(single, TARGETS), TARGETS)
            prepared = partial(prepared_solves, stratum, solver)
            yield TimedCase(work, PREPARED, prepared, TARGETS)
            yield TimedCase(
                work, PLAIN, partial(single, FEW_TARGETS), FEW_TARGETS, backend="python"
            )
            calls = f"{TARGETS} targets a call"
            batch = work._replace(problem=f"{work.problem}/{calls}", title=f"{work.title}, {calls}")
            yield TimedCase(batch, COMPILED, partial(batch_solve, stratum, solver), TARGETS)
        for name in KINEMATICS:
            yield TimedCase(
                _work(stratum, LOOP), name, partial(loop_solves, stratum, name), TARGETS
            )


def _work(stratum: str, solver: str) -> TimedWork:
    return TimedWork(f"ik/{stratum}/{solver}", "ik", stratum, catalogue.find(solver).label)


def single_solves(stratum: str, solver: str, count: int) -> Callable[[], Any]:
    """Return a call that solves the first targets, each by its own call."""
    problem = chain_targets(stratum, TARGETS)
    pairs = list(zip(problem.starts[:count], problem.targets[:count], strict=True))

    def run() -> None:
        for start, target in pairs:
            solve_ik(problem.skeleton, start, target, solver, **LIMITS)

    return run


def prepared_solves(stratum: str, solver: str) -> Callable[[], Any]:
    """Return a call that solves all targets, each into the same arrays."""
    problem = chain_targets(stratum, TARGETS)
    pairs = list(zip(problem.starts, problem.targets, strict=True))
    solve = prepare_ik(problem.skeleton, solver, **LIMITS)

    def run() -> None:
        for start, target in pairs:
            solve(start, target)

    return run


def batch_solve(stratum: str, solver: str) -> Callable[[], Any]:
    """Return a call that solves all targets as a batch."""
    problem = chain_targets(stratum, TARGETS)
    batch = (problem.skeleton, problem.starts, problem.targets, solver)
    return partial(solve_ik, *batch, **LIMITS)


def loop_solves(stratum: str, name: str) -> Callable[[], Any]:
    """Return a call that solves all targets by Levenberg-Marquardt on named kinematics."""
    problem = chain_targets(stratum, TARGETS)
    engine: Any = KINEMATICS[name](problem.skeleton)
    starts = coordinates(engine, problem.starts)
    effector = problem.skeleton.joint_count - 1

    def run() -> None:
        for q, target in zip(starts, problem.targets, strict=True):
            levenberg_marquardt(engine, q, target, effector, **LIMITS)

    return run
