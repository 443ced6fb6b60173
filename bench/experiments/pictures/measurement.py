"""Pictures and motions of the report: the arm on the custom curve, and the cloth."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import IK_SOLVERS, ImplicitEuler, rotation, scenes, track

from ...harness.block import Block, Measured, Scale
from ...problems.cloth_swing import TOLERANCE, H, cloth_swing, converged_motion, motion
from ...problems.curves import CUSTOM, MAX_SPACING, MIN_SPACING, custom_curve, evened_custom_curve
from . import ARM, ARM_MOTION, CLOTH, CLOTH_MOTION

GHOSTS, FRAMES = 9, 6
# Motions to play: solvers of inverse kinematics; step solvers with their iteration limits.
FOLLOWING = ("ccd", "fabrik", "levenberg_marquardt")
SWINGING = (("local_global", 1), ("newton", 100), ("local_global", 10), ("gauss_newton", 1))
# A step solver with a larger limit of iterations works to the tolerance.
SOLVED = 50
# Steps of the cloth; the intervals at which its states and the arm's frames are kept; decimals.
SWUNG, EVERY, THINNED, PLACES = 200, 4, 2, 6


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield the drawings with the first solver, the cloth, and the motions, at every scale."""
    first = next(iter(IK_SOLVERS))
    spacing = {"min_spacing": MIN_SPACING, "max_spacing": MAX_SPACING}
    for evened in (False, True):
        measure = partial(drawing, first, evened)
        yield _block(ARM, f"arm/{CUSTOM}", first, measure, {"evened": evened, **spacing})
    yield _block(CLOTH, "cloth/x1", "newton", falling_cloth, {"h": H, "frames": FRAMES})
    for i, solver in enumerate(FOLLOWING):
        measure, settings = partial(arm_motion, solver), {"every": THINNED}
        yield _block(ARM_MOTION, f"motion/arm/{CUSTOM}", solver, measure, settings, order=i)
    for i, (solver, iterations) in enumerate(SWINGING):
        measure = partial(cloth_motion, solver, iterations)
        limits = {"h": H, "every": EVERY, "iterations": iterations}
        yield _block(CLOTH_MOTION, "motion/cloth/x1", solver, measure, limits, order=i)


def _block(task: str, name: str, solver: str, measure: Any, settings: Any, **facts: int) -> Block:
    return Block("pictures", name, solver, measure, settings, facts={"task": task, **facts})


def arm_motion(solver: str) -> Measured:
    """Follow the evened custom curve; keep each `THINNED`-th frame, to a micrometre."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve()
    frames = track(skeleton, curve, solver, rest)
    positions, errors = frames.positions[::THINNED], np.atleast_1d(frames.residual)[::THINNED]
    return {
        "positions": positions.round(PLACES),
        "curve": curve.round(PLACES),
        "error": errors,
    }


def cloth_motion(solver: str, iterations: int) -> Measured:
    """Swing the lab's cloth; keep each `EVERY`-th state and its distance from converged steps."""
    problem = cloth_swing(1)
    exact = np.array([state.positions for state in converged_motion(problem)[: SWUNG + 1]])
    limits: dict[str, Any] = {"max_iterations": iterations}
    limits |= {"tolerance": TOLERANCE if iterations > SOLVED else 0.0}
    integrator = ImplicitEuler(problem.system, h=problem.h, solver=solver, **limits)
    states = motion(problem.start, SWUNG, integrator)
    positions = np.array([state.positions for state in states])
    distance = np.linalg.norm(positions - exact, axis=-1)[::EVERY]
    digits = np.array([[float(f"{d:.2e}") for d in row] for row in distance])
    return {
        "positions": positions[::EVERY].round(PLACES),
        "distance": digits,
        "pinned": problem.system.pinned,
    }


def drawing(solver: str, evened: bool) -> Measured:
    """Draw the custom curve; keep its points and the arm's joints in a few frames."""
    skeleton, rest = scenes.lab_arm()
    curve = evened_custom_curve() if evened else custom_curve()
    motion = track(skeleton, curve, solver, rest)
    joints = motion.local_rotations[:, :-1]
    angles = rotation.angle(joints[:-1], joints[1:])
    ghosts = np.linspace(0, len(curve) - 1, GHOSTS).round().astype(int)
    return {
        "curve": curve,
        "residual": np.atleast_1d(motion.residual),
        "iterations": np.atleast_1d(motion.iterations),
        "largest_angle": angles.max(axis=-1),
        "mean_angle": angles.mean(axis=-1),
        "spacing": np.linalg.norm(np.diff(curve, axis=0), axis=-1),
        "ghosts": motion.positions[ghosts],
    }


def falling_cloth() -> Measured:
    """Swing the lab's cloth by converged steps; keep the particles in evenly spaced frames."""
    problem = cloth_swing(1)
    states = converged_motion(problem)
    frames = np.linspace(0, len(states) - 1, FRAMES).round().astype(int)
    positions = np.array([states[i].positions for i in frames])
    return {"positions": positions, "time": frames * problem.h, "pinned": problem.system.pinned}
