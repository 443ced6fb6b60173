"""Inverse kinematics of the ten-ball chain, target by target from random starts."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from plumbob.crosscheck.engines import SKELETON_ENGINES, SkeletonEngine
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import IK_SOLVERS, solve_ik

from ...peers import registry
from ...peers.ik.levenberg_marquardt import ReferenceKinematics, levenberg_marquardt
from ...problems.chains import chain_targets
from ..chain.measurement import MAX_ITERATIONS, TOLERANCE, SolverLimits
from .case import COMPILED, OURS, PLAIN, Case, Work

STRATA = ("near", "far")
TARGETS = 50
# Plain Python takes milliseconds a solve; the first targets of the same set are enough.
FEW_TARGETS = 5
LIMITS = SolverLimits(TOLERANCE, MAX_ITERATIONS)._asdict()
LOOP = "levenberg_marquardt"


def cases() -> Iterator[Case]:
    """Yield our solvers at both speeds and as one batch, and one loop on all three kinematics."""
    for stratum in STRATA:
        for solver in IK_SOLVERS:
            work = Work(f"ik/{stratum}/{solver}", "ik", stratum, registry.find(solver).label)
            yield Case(work, COMPILED, partial(one_by_one, stratum, solver, TARGETS), TARGETS)
            few = partial(one_by_one, stratum, solver, FEW_TARGETS)
            yield Case(work, PLAIN, few, FEW_TARGETS, backend="python")
            calls = f"{TARGETS} targets a call"
            batch = work._replace(problem=f"{work.problem}/{calls}", title=f"{work.title}, {calls}")
            yield Case(batch, COMPILED, partial(at_once, stratum, solver), TARGETS)
        for name in (OURS, *SKELETON_ENGINES):
            work = Work(f"ik/{stratum}/{LOOP}", "ik", stratum, registry.find(LOOP).label)
            yield Case(work, name, partial(by_loop, stratum, name), TARGETS)


def one_by_one(stratum: str, solver: str, count: int) -> Callable[[], Any]:
    """Return a call that solves the first targets, each by a call of its own."""
    problem = chain_targets(stratum, TARGETS)
    pairs = list(zip(problem.starts[:count], problem.targets[:count], strict=True))

    def run() -> None:
        for start, target in pairs:
            solve_ik(problem.skeleton, start, target, solver, **LIMITS)

    return run


def at_once(stratum: str, solver: str) -> Callable[[], Any]:
    """Return a call that solves all targets as one batch."""
    problem = chain_targets(stratum, TARGETS)
    ask = (problem.skeleton, problem.starts, problem.targets, solver)
    return partial(solve_ik, *ask, **LIMITS)


def by_loop(stratum: str, name: str) -> Callable[[], Any]:
    """Return a call that solves all targets by Levenberg-Marquardt on someone's kinematics."""
    problem = chain_targets(stratum, TARGETS)
    kinematics: dict[str, type[SkeletonEngine] | type[ReferenceKinematics]] = {
        OURS: ReferenceKinematics,
        **SKELETON_ENGINES,
    }
    engine: Any = kinematics[name](problem.skeleton)
    starts = coordinates(engine, problem.starts)
    effector = problem.skeleton.joint_count - 1

    def run() -> None:
        for q, target in zip(starts, problem.targets, strict=True):
            levenberg_marquardt(engine, q, target, effector, **LIMITS)

    return run
