"""Inverse kinematics of a ten-ball chain, by us and on the kinematics of both engines."""

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.crosscheck.engines import SKELETON_ENGINES
from plumbob.crosscheck.engines.skeleton_engine import coordinates
from plumbob.reference import IK_SOLVERS, Skeleton, forward_kinematics, solve_ik
from plumbob.reference.arguments import FloatArray

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...harness.stopwatch import timed
from ...peers import registry
from ...peers.ik.levenberg_marquardt import levenberg_marquardt, within_reach
from . import BEYOND, CHAIN
from .problem import STRATA, TargetsForSkeleton, chain_targets

TOLERANCE = 1e-4
# Beyond reach it is the distance from the best answer there is; small, to see how straight it is.
BEYOND_TOLERANCE = 1e-6
MAX_ITERATIONS = 1000
# The residuals of so many iterations are kept for the figure.
HISTORY = 200


class Limits(NamedTuple):
    """When a solver stops: the distance that counts as reached [m], and the most iterations."""

    tolerance: float
    max_iterations: int


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every stratum for every solver of ours, and for one loop on each engine."""
    for stratum in STRATA:
        problem = chain_targets(stratum, scale.targets)
        facts = {"task": CHAIN, "stratum": stratum, "title": problem.title}
        tolerance = BEYOND_TOLERANCE if stratum == BEYOND else TOLERANCE
        yield from blocks_of(problem, problem.name, facts, tolerance)


def blocks_of(
    problem: TargetsForSkeleton, name: str, facts: dict[str, Any], tolerance: float = TOLERANCE
) -> Iterator[Block]:
    """Yield a batch of targets for every solver of ours, and for one loop on each engine."""
    limits, count = Limits(tolerance, MAX_ITERATIONS), len(problem.targets)
    for solver in IK_SOLVERS:
        measure = partial(solve_targets, problem, solver, limits, record=True)
        yield Block("ik", name, solver, measure, limits._asdict(), count, facts)
    for loop in registry.LOOPS:
        measure = partial(solve_with_engine, problem, loop.engine, limits)
        yield Block("ik", name, loop.name, measure, limits._asdict(), count, facts)


def solve_targets(
    problem: TargetsForSkeleton, solver: str, limits: Limits, record: bool = False
) -> Measured:
    """Solve all targets with a solver of ours; residuals are recomputed from the answers.

    `record` keeps residuals by iteration, and times.
    """
    asked = (problem.skeleton, problem.starts, problem.targets, solver)
    solution = solve_ik(*asked, **limits._asdict(), record=record)
    arrays = _answers(problem, limits, solution.local_rotations, solution.iterations)
    arrays["outcome"] = np.asarray(solution.outcome)
    if record:
        kept = metrics.convergence(solution.history[:, : HISTORY + 1])
        arrays |= {f"history_{name}": values for name, values in kept._asdict().items()}
        arrays["seconds"] = _seconds(problem, solver, limits)
    return Measured(arrays)


def _seconds(problem: TargetsForSkeleton, solver: str, limits: Limits) -> FloatArray:
    """Return how long each target takes by a call of its own [s], (target,)."""
    starts = np.broadcast_to(problem.starts, (len(problem.targets), *problem.starts.shape[-2:]))
    solves = [
        partial(solve_ik, problem.skeleton, start, target, solver, **limits._asdict())
        for start, target in zip(starts, problem.targets, strict=True)
    ]
    solves[0]()  # may compile
    return np.array([timed(solve)[1] for solve in solves])


def solve_with_engine(problem: TargetsForSkeleton, name: str, limits: Limits) -> Measured:
    """Solve all targets by Levenberg-Marquardt on an engine's kinematics."""
    engine = SKELETON_ENGINES[name](problem.skeleton)
    effector, root = problem.skeleton.joint_count - 1, problem.skeleton.offsets[0]
    targets = within_reach(problem.targets, root, problem.skeleton.reach())
    results = [
        timed(partial(levenberg_marquardt, engine, q, target, effector, **limits._asdict()))
        for q, target in zip(coordinates(engine, problem.starts), targets, strict=True)
    ]
    rotations = np.array([answer.q[engine.columns] for answer, _ in results])
    arrays = _answers(problem, limits, rotations, [answer.iterations for answer, _ in results])
    return Measured(arrays | {"seconds": np.array([seconds for _, seconds in results])})


def residuals(skeleton: Skeleton, local_rotations: FloatArray, targets: FloatArray) -> FloatArray:
    """Return the effector's distances from the targets by forward kinematics [m], (target,)."""
    effectors = forward_kinematics(skeleton, local_rotations).positions[..., -1, :]
    return np.linalg.norm(effectors - targets, axis=-1)


def _answers(
    problem: TargetsForSkeleton, limits: Limits, found: FloatArray, iterations: Any
) -> dict[str, np.ndarray]:
    positions = forward_kinematics(problem.skeleton, found).positions
    distance = np.linalg.norm(problem.targets - problem.skeleton.offsets[0], axis=-1)
    residual = residuals(problem.skeleton, found, problem.targets)
    return {
        "residual": residual,
        "solved": residual <= limits.tolerance,
        "iterations": np.asarray(iterations),
        "distance": distance,
        "bend": metrics.bend(positions, problem.targets),
        "excess": metrics.excess(residual, distance, problem.skeleton.reach()),
        "reach": np.array(problem.skeleton.reach()),
    }
