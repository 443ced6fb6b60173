"""The lab's arm: accuracy, iterations and jitter on every curve, and targets beyond its reach."""

from collections.abc import Iterator
from functools import partial

from plumbob.reference import IK_SOLVERS, scenes, track

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ..chain.measurement import BEYOND_TOLERANCE, Limits, residuals, solve_targets
from . import BEYOND, CURVE
from .problem import FollowedCurve, arm_beyond, arm_curves

LIMITS = Limits(tolerance=1e-4, max_iterations=100)
BEYOND_LIMITS = Limits(BEYOND_TOLERANCE, max_iterations=1000)


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver, from rest and from the last solution (warm), then Q1."""
    for curve in arm_curves():
        for solver in IK_SOLVERS:
            for warm in (False, True):
                settings = {**LIMITS._asdict(), "warm": warm}
                facts = {"task": CURVE, "title": f"arm, {curve.title}", "curve": curve.title}
                measure = partial(draw, curve, solver, warm)
                yield Block("arm", curve.name, solver, measure, settings, facts=facts)
    far = arm_beyond(scale.targets)
    facts = {"task": BEYOND, "title": far.title}
    for solver in IK_SOLVERS:
        measure = partial(solve_targets, far, solver, BEYOND_LIMITS)
        yield Block("arm", far.name, solver, measure, BEYOND_LIMITS._asdict(), scale.targets, facts)


def draw(problem: FollowedCurve, solver: str, warm: bool) -> Measured:
    """Follow the curve; residuals are recomputed by forward kinematics of the answers."""
    skeleton, rest = scenes.lab_arm()
    motion = track(skeleton, problem.curve, solver, rest, warm=warm, **LIMITS._asdict())
    # The effector keeps its rotation and would only dilute the mean.
    angles = metrics.rotation_angles(motion.local_rotations[:, :-1])
    return Measured(
        {
            "residual": residuals(skeleton, motion.local_rotations, problem.curve),
            "iterations": motion.iterations,
            "outcome": motion.outcome,
            "largest_angle": angles.max(axis=-1),
            "mean_angle": angles.mean(axis=-1),
        }
    )
