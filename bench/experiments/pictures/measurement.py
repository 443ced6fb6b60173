"""What the report draws: the arm on the custom curve before and after resampling, the cloth."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from reference import IK_SOLVERS, scenes, track

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ..arm.problem import CUSTOM, MAX_SPACING, MIN_SPACING, custom_curve, evened_custom_curve
from ..cloth.measurement import converged_motion
from ..cloth.problem import H, cloth_swing
from . import ARM, CLOTH

GHOSTS = 9
FRAMES = 6


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the drawings with the first solver, and the cloth; the same at every scale."""
    solver = next(iter(IK_SOLVERS))
    for evened in (False, True):
        settings = {"evened": evened, "min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
        measure, facts = partial(drawing, solver, evened), {"task": ARM}
        yield Block("pictures", f"arm/{CUSTOM}", solver, measure, settings, facts=facts)
    settings, facts = {"h": H, "frames": FRAMES}, {"task": CLOTH}
    yield Block("pictures", "cloth/x1", "newton", falling_cloth, settings, facts=facts)


def drawing(solver: str, evened: bool) -> Measured:
    """Draw the custom curve; keep its points and the arm's joints in a few frames."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve() if evened else custom_curve()
    motion = track(skeleton, curve, solver, rest)
    angles = metrics.rotation_angles(motion.local_rotations[:, :-1])
    ghosts = np.linspace(0, len(curve) - 1, GHOSTS).round().astype(int)
    return Measured(
        {
            "curve": curve,
            "residual": motion.residual,
            "iterations": motion.iterations,
            "largest_angle": angles.max(axis=-1),
            "mean_angle": angles.mean(axis=-1),
            "spacing": np.linalg.norm(np.diff(curve, axis=0), axis=-1),
            "ghosts": motion.positions[ghosts],
        }
    )


def falling_cloth() -> Measured:
    """Swing the lab's cloth by converged steps; keep the particles in evenly spaced frames."""
    problem = cloth_swing(1)
    states = converged_motion(problem)
    kept = np.linspace(0, len(states) - 1, FRAMES).round().astype(int)
    return Measured(
        {
            "positions": [states[i].positions for i in kept],
            "time": kept * problem.h,
            "pinned": problem.system.pinned,
        }
    )
