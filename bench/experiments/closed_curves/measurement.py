"""Following closed curves: each frame from rest, each from the last solution, and coherently."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, IKSolution, Skeleton, forward_kinematics, rotation, track
from plumbob.reference.arguments import FloatArray

from ...harness.block import Block, Measured, Scale
from ..arm.problem import FollowedCurve
from . import COHERENT, COLD, CURVE, DRIFT, WARM
from .problem import (
    DRIFT_FRAMES,
    arm_closed_curves,
    heart_three_times,
    robot_closed_curves,
)

SUITE = "tracking"
TOLERANCE, ITERATIONS = 1e-4, 100
LIMITS: dict[str, Any] = {"tolerance": TOLERANCE, "max_iterations": ITERATIONS}
OPTIONS = {COLD: {"warm": False}, WARM: {}, COHERENT: {"coherent": True, "closed": True}}
# On a robot the other solvers take long to compile: a quick run leaves them out.
ROBOT_SOLVER = "levenberg_marquardt"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver in each mode, and the heart three times."""
    for problem in arm_closed_curves():
        yield from _modes(problem, list(IK_SOLVERS))
    some = [ROBOT_SOLVER] if scale.is_as_short_as("quick") else list(IK_SOLVERS)
    for problem in robot_closed_curves():
        yield from _modes(problem, some)
    for solver in IK_SOLVERS:
        for mode in (WARM, COHERENT):
            measure = partial(drift, heart_three_times(), solver, mode)
            facts = {"task": DRIFT, "title": heart_three_times().title}
            yield Block(
                SUITE, heart_three_times().name, solver, measure, _settings(mode), facts=facts
            )


def _modes(problem: FollowedCurve, solvers: list[str]) -> Iterator[Block]:
    for solver in solvers:
        for mode in OPTIONS:
            measure = partial(follow, problem, solver, mode)
            facts = {"task": CURVE, "title": problem.title}
            yield Block(SUITE, problem.name, solver, measure, _settings(mode), facts=facts)


def _settings(mode: str) -> dict[str, Any]:
    return {"mode": mode, **LIMITS}


def follow(problem: FollowedCurve, solver: str, mode: str) -> Measured:
    """Follow the curve once; residuals are recomputed by forward kinematics of the answers.

    The last angle is that from the last frame back to the first.
    """
    motion = _tracked(problem, solver, mode)
    pose = forward_kinematics(problem.model, motion.coordinates)
    angles = _joint_angles(problem, motion, np.arange(len(problem.curve)) - len(problem.curve) + 1)
    return Measured(
        {
            "residual": np.linalg.norm(pose.positions[:, -1] - problem.curve, axis=-1),
            "iterations": motion.iterations,
            "outcome": motion.outcome,
            "largest_angle": angles.max(axis=-1),
            "mean_angle": angles.mean(axis=-1),
        }
    )


def drift(problem: FollowedCurve, solver: str, mode: str) -> Measured:
    """Follow the curve three times over; return how far the first pose is left behind after each.

    A coherent motion is closed: after its last frame comes its first.
    """
    again = (
        problem.curve if mode == COHERENT else np.append(problem.curve, problem.curve[:1], axis=0)
    )
    motion = _tracked(replace(problem, curve=again), solver, mode)
    later = (DRIFT_FRAMES * np.arange(1, 4)) % len(again)
    angles = rotation.angle(motion.local_rotations[[0, 0, 0]], motion.local_rotations[later])
    return Measured({"drift": angles.max(axis=-1), "residual": motion.residual})


def _tracked(problem: FollowedCurve, solver: str, mode: str) -> IKSolution:
    options: dict[str, Any] = {
        "tolerance": TOLERANCE,
        "max_iterations": ITERATIONS,
        **OPTIONS[mode],
    }
    return track(problem.model, problem.curve, solver, problem.start, **options)


def _joint_angles(problem: FollowedCurve, motion: IKSolution, following: np.ndarray) -> FloatArray:
    """Return the angle by which each joint rotates to the following frame [rad], (frame, joint).

    A hinge's angle is not reduced to half a revolution, though its link looks the same.
    """
    if isinstance(problem.model, Skeleton):
        # The effector keeps its rotation and would only dilute the mean.
        R = motion.local_rotations[:, :-1]
        return rotation.angle(R, R[following])
    return np.abs(motion.coordinates[following] - motion.coordinates)
