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
from ..arm.measurement import LIMITS, follow, tracked
from . import COHERENT, COLD, CURVE, DRIFT, WARM

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
    some = [ROBOT_SOLVER] if scale.is_as_short_as("quick") else list(IK_SOLVERS)
    for problems, solvers in ((arm_closed_curves(), IK_SOLVERS), (robot_closed_curves(), some)):
        for problem in problems:
            for solver in solvers:
                for mode, options in OPTIONS.items():
                    measure = partial(follow, problem, solver, options, closed=True)
                    yield _block(problem, solver, mode, measure, CURVE)
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
    """Follow the curve three times over; return how far the first pose is left behind after each.

    A coherent motion is closed: after its last frame comes its first.
    """
    if mode != COHERENT:
        problem = replace(problem, curve=np.append(problem.curve, problem.curve[:1], axis=0))
    motion = tracked(problem, solver, OPTIONS[mode])
    later = (DRIFT_FRAMES * np.arange(1, 4)) % len(problem.curve)
    angles = rotation.angle(motion.local_rotations[[0, 0, 0]], motion.local_rotations[later])
    return Measured({"drift": angles.max(axis=-1), "residual": motion.residual})
