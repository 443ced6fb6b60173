"""Following closed curves: each frame from rest, each from the last solution, and coherently."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, rotation

from ...harness.block import Block, Measured, Scale
from ...problems.curves import (
    DRIFT_FRAMES,
    FollowedCurve,
    arm_closed_curves,
    heart_three_times,
    robot_closed_curves,
)
from ..arm.measurement import LIMITS, follow, solve_frames
from . import COHERENT, COLD, CURVE, DRIFT, WARM
from .values import DriftAngles

SUITE = "tracking"
OPTIONS: dict[str, dict[str, Any]] = {
    COLD: {"warm": False},
    WARM: {},
    COHERENT: {"coherent": True, "closed": True},
}
# On a robot the other solvers take long to compile: a quick run leaves them out.
ROBOT_SOLVER = "levenberg_marquardt"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every curve for every solver in each mode, and the heart three times."""
    robot_solvers = [ROBOT_SOLVER] if scale.is_as_short_as("quick") else list(IK_SOLVERS)
    followed = [(curve, solver) for curve in arm_closed_curves() for solver in IK_SOLVERS]
    followed += [(curve, solver) for curve in robot_closed_curves() for solver in robot_solvers]
    for curve, solver in followed:
        for mode, options in OPTIONS.items():
            measure = partial(follow, curve, solver, options, closed=True)
            yield _block(curve, solver, mode, measure, CURVE)
    heart = heart_three_times()
    for solver in IK_SOLVERS:
        for mode in (WARM, COHERENT):
            yield _block(heart, solver, mode, partial(drift, heart, solver, mode), DRIFT)


def _block(
    problem: FollowedCurve, solver: str, mode: str, measure: partial[Measured], task: str
) -> Block:
    settings, facts = {"mode": mode, **LIMITS._asdict()}, {"task": task, "title": problem.title}
    return Block(SUITE, problem.name, solver, measure, settings, facts=facts)


def drift(problem: FollowedCurve, solver: str, mode: str) -> Measured:
    """Follow the curve three times over; return the angles from the first pose after each.

    A coherent motion is closed: after its last frame comes its first.
    """
    if mode != COHERENT:
        problem = replace(problem, curve=np.append(problem.curve, problem.curve[:1], axis=0))
    motion = solve_frames(problem, solver, OPTIONS[mode])
    frames = (DRIFT_FRAMES * np.arange(1, 4)) % len(problem.curve)
    angles = rotation.angle(motion.local_rotations[[0, 0, 0]], motion.local_rotations[frames])
    return Measured(DriftAngles(angles.max(axis=-1), np.asarray(motion.residual)))
