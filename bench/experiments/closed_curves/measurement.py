"""Following closed curves: each frame from rest, each from the last solution, and coherently."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from reference import IK_SOLVERS, IKSolution, Skeleton, forward_kinematics, rotation, track
from reference.arguments import FloatArray

from ...harness.block import SCALES, Block, Measured, Scale
from . import COHERENT, COLD, CURVE, DRIFT, WARM
from .problem import DRIFT_FRAMES, Round, arm_rounds, robot_rounds, three_rounds

SUITE = "tracking"
TOLERANCE, ITERATIONS = 1e-4, 100
OPTIONS = {
    COLD: {"warm": False},
    WARM: {},
    COHERENT: {"coherent": True, "closed": True},
}
# On a robot the other solvers take long to compile: a quick run leaves them out.
ROBOT_SOLVER = "levenberg_marquardt"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver in each of the ways, and three rounds."""
    for problem in arm_rounds():
        yield from _ways(problem, list(IK_SOLVERS))
    some = [ROBOT_SOLVER] if scale == SCALES["quick"] else list(IK_SOLVERS)
    for problem in robot_rounds():
        yield from _ways(problem, some)
    for solver in IK_SOLVERS:
        for way in (WARM, COHERENT):
            measure = partial(drift, three_rounds(), solver, way)
            facts = {"task": DRIFT, "title": three_rounds().title}
            yield Block(SUITE, three_rounds().name, solver, measure, _settings(way), facts=facts)


def _ways(problem: Round, solvers: list[str]) -> Iterator[Block]:
    for solver in solvers:
        for way in OPTIONS:
            measure = partial(follow, problem, solver, way)
            facts = {"task": CURVE, "title": problem.title}
            yield Block(SUITE, problem.name, solver, measure, _settings(way), facts=facts)


def _settings(way: str) -> dict[str, str | float]:
    return {"way": way, "tolerance": TOLERANCE, "max_iterations": ITERATIONS}


def follow(problem: Round, solver: str, way: str) -> Measured:
    """Follow the curve once; residuals are recomputed by forward kinematics of the answers.

    The last turn is that from the last frame back to the first.
    """
    motion = _tracked(problem, solver, way)
    pose = forward_kinematics(problem.model, motion.coordinates)
    turned = _turns(problem, motion, np.arange(len(problem.curve)) - len(problem.curve) + 1)
    return Measured(
        {
            "residual": np.linalg.norm(pose.positions[:, -1] - problem.curve, axis=-1),
            "iterations": motion.iterations,
            "outcome": motion.outcome,
            "largest_turn": turned.max(axis=-1),
            "mean_turn": turned.mean(axis=-1),
        }
    )


def drift(problem: Round, solver: str, way: str) -> Measured:
    """Follow the curve three times over; return how far the first pose is left behind after each.

    A coherent motion is closed: after its last frame comes its first.
    """
    again = (
        problem.curve if way == COHERENT else np.append(problem.curve, problem.curve[:1], axis=0)
    )
    motion = _tracked(replace(problem, curve=again), solver, way)
    later = (DRIFT_FRAMES * np.arange(1, 4)) % len(again)
    turned = rotation.angle(motion.local_rotations[[0, 0, 0]], motion.local_rotations[later])
    return Measured({"drift": turned.max(axis=-1), "residual": motion.residual})


def _tracked(problem: Round, solver: str, way: str) -> IKSolution:
    return track(
        problem.model, problem.curve, solver, problem.start,
        tolerance=TOLERANCE, max_iterations=ITERATIONS, **OPTIONS[way],
    )  # fmt: skip


def _turns(problem: Round, motion: IKSolution, following: np.ndarray) -> FloatArray:
    """Return by how much each joint turns on the way to the following frame [rad], (frame, joint).

    A hinge that turns by more than half a turn has done so, though its link looks the same.
    """
    if isinstance(problem.model, Skeleton):
        # The tip keeps its rotation and would only dilute the mean.
        R = motion.local_rotations[:, :-1]
        return rotation.angle(R, R[following])
    return np.abs(motion.coordinates[following] - motion.coordinates)
