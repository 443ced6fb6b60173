"""What the report draws: the arm on the custom curve, the cloth, and both in motion."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, ImplicitEuler, scenes, track

from ...harness import metrics
from ...harness.block import Block, Measured, Scale
from ...problems.curves import CUSTOM, MAX_SPACING, MIN_SPACING, custom_curve, evened_custom_curve
from ..cloth.measurement import TOLERANCE, converged_motion, motion
from ..cloth.problem import H, cloth_swing
from . import ARM, ARM_MOTION, CLOTH, CLOTH_MOTION
from .values import ArmDrawing, ArmMotion, ClothDrawing, ClothMotion

GHOSTS = 9
FRAMES = 6
# Motions that are played: solvers of inverse kinematics, frame by frame or coherent; solvers of
# steps with the most iterations that each step has.
FOLLOWING = (
    ("ccd", False),
    ("fabrik", True),
    ("fabrik", False),
    ("levenberg_marquardt", False),
)
SWINGING = (("local_global", 1), ("newton", 100), ("local_global", 10), ("gauss_newton", 1))
SOLVED = 50
# Steps of the cloth; every so many are kept, of the arm's frames likewise; decimals of positions.
SWUNG, EVERY, THINNED, PLACES = 200, 4, 2, 6


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the drawings with the first solver, and the cloth; the same at every scale."""
    solver = next(iter(IK_SOLVERS))
    for evened in (False, True):
        settings = {"evened": evened, "min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
        measure, facts = partial(drawing, solver, evened), {"task": ARM}
        yield Block("pictures", f"arm/{CUSTOM}", solver, measure, settings, facts=facts)
    settings, facts = {"h": H, "frames": FRAMES}, {"task": CLOTH}
    yield Block("pictures", "cloth/x1", "newton", falling_cloth, settings, facts=facts)
    yield from _motions()


def _motions() -> Iterator[Block]:
    """Yield the arm's motion by each solver of its frames, and the cloth's by each solver."""
    for i, (solver, coherent) in enumerate(FOLLOWING):
        settings = {"coherent": coherent, "every": THINNED}
        facts = {"task": ARM_MOTION, "order": i}
        measure = partial(arm_motion, solver, coherent)
        yield Block("pictures", f"motion/arm/{CUSTOM}", solver, measure, settings, facts=facts)
    for i, (solver, iterations) in enumerate(SWINGING):
        limits = {"h": H, "every": EVERY, "iterations": iterations}
        facts = {"task": CLOTH_MOTION, "order": i}
        swing = partial(cloth_motion, solver, iterations)
        yield Block("pictures", "motion/cloth/x1", solver, swing, limits, facts=facts)


def arm_motion(solver: str, coherent: bool) -> Measured:
    """Follow the evened custom curve; keep each `THINNED`-th frame, to a micrometre."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve()
    found = track(skeleton, curve, solver, rest, coherent=coherent)
    kept = slice(None, None, THINNED)
    positions, error = found.positions[kept].round(PLACES), np.atleast_1d(found.residual)[kept]
    return Measured(ArmMotion(positions, curve.round(PLACES), error))


def cloth_motion(solver: str, iterations: int) -> Measured:
    """Swing the lab's cloth; keep each `EVERY`-th state and how far it is from converged steps."""
    problem = cloth_swing(1)
    exact = np.array([state.positions for state in converged_motion(problem)[: SWUNG + 1]])
    limits: dict[str, Any] = {"max_iterations": iterations}
    limits |= {"tolerance": TOLERANCE if iterations > SOLVED else 0.0}
    integrator = ImplicitEuler(problem.system, h=problem.h, solver=solver, **limits)
    found = np.array([state.positions for state in motion(problem.start, SWUNG, integrator)])
    distance = np.linalg.norm(found - exact, axis=-1)
    kept = slice(None, None, EVERY)
    digits = np.array([[float(f"{d:.2e}") for d in row] for row in distance[kept]])
    return Measured(ClothMotion(found[kept].round(PLACES), digits, problem.system.pinned))


def drawing(solver: str, evened: bool) -> Measured:
    """Draw the custom curve; keep its points and the arm's joints in a few frames."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve() if evened else custom_curve()
    motion = track(skeleton, curve, solver, rest)
    angles = metrics.rotation_angles(motion.local_rotations[:, :-1])
    ghosts = np.linspace(0, len(curve) - 1, GHOSTS).round().astype(int)
    return Measured(
        ArmDrawing(
            curve,
            np.atleast_1d(motion.residual),
            np.atleast_1d(motion.iterations),
            angles.max(axis=-1),
            angles.mean(axis=-1),
            np.linalg.norm(np.diff(curve, axis=0), axis=-1),
            motion.positions[ghosts],
        )
    )


def falling_cloth() -> Measured:
    """Swing the lab's cloth by converged steps; keep the particles in evenly spaced frames."""
    problem = cloth_swing(1)
    states = converged_motion(problem)
    kept = np.linspace(0, len(states) - 1, FRAMES).round().astype(int)
    positions = np.array([states[i].positions for i in kept])
    return Measured(ClothDrawing(positions, kept * problem.h, problem.system.pinned))
