"""The lab's arm: accuracy, iterations and jitter on every curve, and targets beyond its reach."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, IKSolution, Skeleton, forward_kinematics, rotation, track
from plumbob.reference.arguments import FloatArray

from ...harness.block import Block, Measured, Scale
from ...problems.curves import FollowedCurve, arm_beyond, arm_curves
from ..chain.measurement import BEYOND_TOLERANCE, SolverLimits, solve_targets
from . import BEYOND, CURVE

LIMITS = SolverLimits(tolerance=1e-4, max_iterations=100)
BEYOND_LIMITS = SolverLimits(BEYOND_TOLERANCE, max_iterations=1000)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver, from rest and from the last solution (warm), then Q1."""
    for curve in arm_curves():
        facts = {"task": CURVE, "title": f"arm, {curve.title}", "curve": curve.title}
        for solver in IK_SOLVERS:
            for warm in (False, True):
                settings = {**LIMITS._asdict(), "warm": warm}
                measure = partial(follow, curve, solver, {"warm": warm})
                yield Block("arm", curve.name, solver, measure, settings, facts=facts)
    beyond, limits = arm_beyond(scale.targets), BEYOND_LIMITS._asdict()
    facts = {"task": BEYOND, "title": beyond.title}
    for solver in IK_SOLVERS:
        measure = partial(solve_targets, beyond, solver, BEYOND_LIMITS)
        yield Block("arm", beyond.name, solver, measure, limits, scale.targets, facts)


def follow(problem: FollowedCurve, solver: str, options: dict[str, Any]) -> Measured:
    """Follow a curve once."""
    return followed(problem, solve_frames(problem, solver, options), closed=False)


def followed(problem: FollowedCurve, motion: IKSolution, closed: bool) -> Measured:
    """Return a motion along a curve; residuals are recomputed by forward kinematics.

    The last angle of a closed curve is from the last frame back to the first.
    """
    pose = forward_kinematics(problem.model, motion.coordinates)
    angles = _joint_angles(problem, motion)[: None if closed else -1]
    return {
        "residual": np.linalg.norm(pose.positions[:, -1] - problem.curve, axis=-1),
        "iterations": np.asarray(motion.iterations),
        "outcome": np.asarray(motion.outcome),
        "largest_angle": angles.max(axis=-1),
        "mean_angle": angles.mean(axis=-1),
    }


def solve_frames(problem: FollowedCurve, solver: str, options: dict[str, Any]) -> IKSolution:
    """Return the solutions of all frames of a curve."""
    limits: dict[str, Any] = {**LIMITS._asdict(), **options}
    return track(problem.model, problem.curve, solver, problem.start, **limits)


def _joint_angles(problem: FollowedCurve, motion: IKSolution) -> FloatArray:
    """Return the angle by which each joint rotates to the following frame [rad], (frame, joint).

    The first frame follows the last. A hinge's angle is not reduced to half a revolution, though
    its link looks the same.
    """
    if isinstance(problem.model, Skeleton):
        # The effector keeps its rotation and would only dilute the mean.
        R = motion.local_rotations[:, :-1]
        return rotation.angle(R, np.roll(R, -1, axis=0))
    return np.abs(np.roll(motion.coordinates, -1, axis=0) - motion.coordinates)
