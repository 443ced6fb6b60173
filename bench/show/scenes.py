"""Solve the named scenes, and write them as pages, pictures or BVH motions."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob import reference
from plumbob.reference.arguments import FloatArray, choice
from plumbob.reference.formats import bvh

from ..figures.view import ARM_VIEW, CLOTH_VIEW
from ..player import motion
from ..player.motion import Moving, Scene
from ..problems.curves import CUSTOM, MAX_SPACING, MIN_SPACING
from ..tables.results import label
from .scene_solver import ARM_TASKS, CLOTH_TASKS, H, SceneSolver

ARM, CLOTH = "arm", "cloth"
SCENES = (ARM, CLOTH, *reference.curves)
HTML, SVG, BVH = ".html", ".svg", ".bvh"
SECONDS = 5  # of a motion
# A page shows every third step of a cloth; the frames of an arm are thinned to as many.
EVERY = 3
RATE = 20  # frames of a second
FRAMES = SECONDS * RATE
# The solver of the exact implicit motion of a cloth, to which others are compared.
EXACT = "newton"
# The solvers of an arm and of a cloth, unless another is asked for.
_DEFAULTS = ("fabrik", EXACT)
Progress = Callable[[int, int], None]


class ArmMotion(NamedTuple):
    """An arm, its first pose, the points of its curve, a point a frame, and its motion."""

    skeleton: reference.Skeleton
    rest: FloatArray
    curve: FloatArray
    motion: reference.IKSolution


class ClothMotion(NamedTuple):
    """A cloth, its start, and its positions after each step, the start first."""

    system: reference.MassSpring
    start: reference.State
    positions: FloatArray


def write(
    name: str,
    path: Path,
    solver: str | None,
    progress: Progress,
    user_solver: SceneSolver | None = None,
) -> None:
    """Write a scene as a page, a picture or a BVH motion, by the suffix of the file.

    Args:
        name: of the scene.
        path: of the file.
        solver: of Plumbob; FABRIK or Newton's if None.
        progress: called with the frames done and their number.
        user_solver: a solver beside Plumbob's.

    Raises:
        ValueError: if scene or solver are unknown, the suffix does not fit them, or the
            user's solver does not answer.
    """
    is_cloth = choice("scene", name, SCENES) == CLOTH
    bones = () if is_cloth or user_solver else (BVH,)
    choice("suffix of the file", path.suffix, (HTML, SVG, *bones))
    if user_solver:
        user_solver.offered(*(("a cloth", CLOTH_TASKS) if is_cloth else ("an arm", ARM_TASKS)))
    solver = choice(
        "solver",
        solver or _DEFAULTS[is_cloth],
        reference.STEP_SOLVERS if is_cloth else reference.IK_SOLVERS,
    )
    if is_cloth:
        cloth = cloth_motion(solver)
        moves = [(c.name, step_like(cloth, c, progress)) for c in [user_solver] if c]
        return _write_scene(cloth_scene(cloth, solver, moves), path, progress)
    arm = arm_motion(name, solver)
    if path.suffix == BVH:
        seconds = SECONDS / len(arm.curve)
        return bvh.write(path, arm.skeleton, arm.motion.local_rotations, seconds)
    moves = [(c.name, draw_like(arm, c, progress)) for c in [user_solver] if c]
    return _write_scene(arm_scene(name, arm, f"Plumbob {label(solver)}", moves), path, progress)


def _write_scene(scene: Scene, path: Path, progress: Progress) -> None:
    if path.suffix == HTML:
        path.write_text(motion.page(scene), encoding="utf-8")
        return
    from .picture import draw_picture

    draw_picture(scene, path, progress)


def arm_motion(name: str, solver: str) -> ArmMotion:
    """Return the arm drawing a curve."""
    skeleton, rest = reference.scenes.lab_arm()
    points = reference.curves[CUSTOM if name == ARM else name]()
    even = reference.resample(points, min_spacing=MIN_SPACING, max_spacing=MAX_SPACING)
    return ArmMotion(skeleton, rest, even, reference.track(skeleton, even, solver, rest))


def draw_like(arm: ArmMotion, solver: SceneSolver, progress: Progress) -> FloatArray:
    """Return the joint positions of a solver that draws the arm's curve, (frame, joint, 3)."""
    return solver.follow_curve(arm.skeleton, arm.rest, arm.curve, progress)


def arm_scene(
    name: str, arm: ArmMotion, solver: str, other_solvers: Sequence[tuple[str, FloatArray]] = ()
) -> Scene:
    """Return the scene of an arm, behind the names and joint positions of other solvers."""
    points = arm.curve
    frames = np.linspace(0, len(points) - 1, min(len(points), FRAMES)).round().astype(int)
    motions = []
    for title, x in [*other_solvers, (solver, arm.motion.positions)]:
        errors = np.linalg.norm(x[frames, -1] - points[frames], axis=-1)
        motions.append(Moving(title, x[frames], errors))
    curve = "the custom curve" if name == ARM else f"the curve “{name.replace('_', ' ')}”"
    return Scene(
        "arm",
        f"The lab’s arm draws {curve}{_labels(motions)}",
        "The line drawn has the colour of its error.",
        motions,
        SECONDS / len(frames),
        "distance to the target",
        ARM_VIEW,
        len(motions),
        points,
    ).checked()


def cloth_motion(solver: str, mass: float = 1.0) -> ClothMotion:
    """Return the motion of the lab's cloth from rest, with a mass of each particle [kg]."""
    system, start = reference.scenes.lab_cloth(mass=mass)
    integrator, state = reference.ImplicitEuler(system, h=H, solver=solver), start
    positions = [state.positions]
    for _ in range(FRAMES * EVERY):
        state = integrator.step(state).state
        positions.append(state.positions)
    return ClothMotion(system, start, np.array(positions))


def step_like(cloth: ClothMotion, solver: SceneSolver, progress: Progress) -> FloatArray:
    """Return the positions of a cloth after each step of a solver, (frame, particle, 3)."""
    return solver.step_cloth(cloth.system, cloth.start, len(cloth.positions) - 1, progress)


def cloth_scene(
    cloth: ClothMotion, solver: str, other_solvers: Sequence[tuple[str, FloatArray]] = ()
) -> Scene:
    """Return the scene of a cloth, with distances to the exact implicit motion."""
    exact = cloth.positions if solver == EXACT else cloth_motion(EXACT).positions
    motions = []
    for title, x in [*other_solvers, (f"Plumbob {label(solver)}", cloth.positions)]:
        distances = np.linalg.norm(x[::EVERY] - exact[::EVERY], axis=-1)
        rms = np.sqrt(np.mean(distances**2, axis=-1))
        motions.append(Moving(title, x[::EVERY], rms, distances))
    return Scene(
        "cloth",
        f"The lab’s cloth swings from two corners{_labels(motions)}",
        "Every particle has the colour of its distance to the converged motion of implicit Euler; "
        "the numbers are root mean squares over the particles.",
        motions,
        H * EVERY,
        "distance to the exact implicit motion",
        CLOTH_VIEW,
        len(motions),
        marked=cloth.system.pinned.tolist(),
    ).checked()


def _labels(motions: Sequence[Moving]) -> str:
    """Return the names of solvers beside each other, "" for a single solver."""
    return f": {' beside '.join(motion.label for motion in motions)}" if motions[1:] else ""
