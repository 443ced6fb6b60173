"""The gallery of the documentation: curves and cloths by good and faulty solvers."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.reference import forward_kinematics, rotation, scenes, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.verify.functions import FunctionContestant
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.mass_spring.model import Integrator, StepModel
from plumbob.verify.self_test import STEP, Stepper, Subject, subjects

from ..figures.view import ARM_VIEW
from ..motion.motion import Moving, Scene
from . import film
from .scenes import (
    CLOTH,
    EXACT,
    Progress,
    arm_motion,
    arm_scene,
    cloth_motion,
    cloth_scene,
    draw_like,
    step_like,
)
from .your_solver import YourSolver

EXPLODING, REACH = "explicit Euler", "reach"
# The reach: from a random pose to a point [m] within so many sweeps, one a frame.
SEED, POINT, SWEEPS = 34, (-0.238, 0.0, -0.956), 40
# Of the frames of a scene, the animations of the gallery show every third, in a small picture.
EVERY, DPI = 3, 56


class FamousFault(NamedTuple):
    """A mistake that many programs make, and the scene that shows it."""

    file: str  # its name in the gallery
    title: str  # how the picture calls it
    family: str  # of the faults of the self-test
    fault: str  # its key there
    solver: str  # of Plumbob, beside which it is shown
    scene: str  # the curve that the arm draws, one reach of it, or the cloth
    mass: float = 1.0  # of a particle of the cloth [kg]


FAMOUS = (
    FamousFault("world_rotation", "World rotation on the left", "CCD",
                "world rotation on the left", "ccd", REACH),
    FamousFault("missing_parent", "Parent's rotation left out", "CCD",
                "rotations not accumulated", "ccd", "heart"),
    FamousFault("no_backward_pass", "No backward pass", "FABRIK", "no backward pass", "fabrik",
                "heart"),
    FamousFault("explicit_euler", "Explicit Euler explodes", "steps", EXPLODING, EXACT, CLOTH),
    FamousFault("drifting_pins", "Pins that drift", "steps", "pins of one kilogram", EXACT, CLOTH),
    FamousFault("gravity_by_mass", "Gravity divided by mass", "steps", "gravity g/m", EXACT, CLOTH,
                mass=0.25),
)  # fmt: skip
# The faulty solvers beside good ones in the pictures that stand still.
DOUBLE_GRAVITY = FamousFault("", "Gravity twice", "steps", "gravity doubled", EXACT, CLOTH)
BESIDE_CURVES, BESIDE_CLOTHS = FAMOUS[1:3], (FAMOUS[4], DOUBLE_GRAVITY)


def write_gallery(folder: Path, progress: Progress) -> list[Path]:
    """Write the pictures and the animations into a folder, and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    count = len(FAMOUS) + 2
    paths = []
    for i, (name, scene) in enumerate(_scenes()):
        paths.append(folder / name)
        if paths[-1].suffix == ".svg":
            film.picture(scene, paths[-1], _silent)
        else:
            scene = scene if scene.name == REACH else _thinned(scene)
            film.animate(scene, paths[-1], _silent, DPI)
        progress(i + 1, count)
    return paths


def _scenes() -> Iterator[tuple[str, Scene]]:
    """Yield the file of each picture with its scene."""
    arm, cloth = arm_motion("heart", "fabrik"), cloth_motion(EXACT)
    drawn = [(fault.title, draw_like(arm, _solver(fault), _silent)) for fault in BESIDE_CURVES]
    yield "curves.svg", arm_scene("heart", arm, "Plumbob FABRIK", drawn)
    stepped = [(fault.title, step_like(cloth, _solver(fault), _silent)) for fault in BESIDE_CLOTHS]
    yield "cloths.svg", cloth_scene(cloth, EXACT, stepped)
    for fault in FAMOUS:
        yield f"{fault.file}.gif", _beside_truth(fault)


def _beside_truth(fault: FamousFault) -> Scene:
    """Return the scene of a faulty solver beside Plumbob's."""
    if fault.scene == CLOTH:
        cloth = cloth_motion(fault.solver, fault.mass)
        moves = [(fault.title, step_like(cloth, _solver(fault), _silent))]
        return cloth_scene(cloth, fault.solver, moves)
    if fault.scene == REACH:
        return _reach(fault)
    arm = arm_motion(fault.scene, fault.solver)
    moves = [(fault.title, draw_like(arm, _solver(fault), _silent))]
    return arm_scene(fault.scene, arm, f"Plumbob {fault.solver.upper()}", moves)


def _reach(fault: FamousFault) -> Scene:
    """Return the scene of an arm that reaches for a point, sweep by sweep."""
    skeleton, rest = scenes.lab_arm()
    target, n = np.array(POINT), len(rest)
    q = rotation.random(np.random.default_rng(SEED), n)
    inputs = {"parents": skeleton.parents, "offsets": skeleton.offsets, "effector": n - 1,
              "local_rotations": q, "target": target, "tolerance": 1e-4}  # fmt: skip
    faulty = [
        forward_kinematics(
            skeleton, _subject(fault).function(**inputs, max_iterations=k)["local_rotations"]
        ).positions
        for k in range(SWEEPS + 1)
    ]
    right = [
        solve_ik(skeleton, q, target, fault.solver, max_iterations=k).positions
        for k in range(SWEEPS + 1)
    ]
    motions = [
        Moving(title, np.array(x), np.linalg.norm(np.array(x)[:, -1] - target, axis=-1))
        for title, x in ((fault.title, faulty), (f"Plumbob {fault.solver.upper()}", right))
    ]
    shows = "A frame is a sweep; the line has the colour of the distance to the target."
    return Scene(REACH, "The lab’s arm reaches for a point", shows, motions, 0.1,
                 "distance to the target", ARM_VIEW, 2, _cross(target)).checked()  # fmt: skip


def _cross(point: FloatArray) -> FloatArray:
    """Return a line that marks a point by a cross on the floor, (5, 3)."""
    return np.asarray(point + 0.06 * np.array(
        [[-1, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, -1], [0, 0, 1]]))  # fmt: skip


def _solver(fault: FamousFault) -> YourSolver:
    """Return the solver that has a fault."""
    subject = _subject(fault)
    contestant = FunctionContestant({subject.task: subject.function}, subject.greeting)
    return YourSolver(fault.title, contestant)


def _subject(fault: FamousFault) -> Subject:
    """Return the subject of the self-test that has a fault, or explicit Euler.

    Explicit Euler is an honest method, but unstable on the cloth.
    """
    for subject in subjects():
        if (subject.family, subject.name) == (fault.family, fault.fault):
            return subject
    step = Stepper(StepModel(Integrator("explicit"), velocity="separate"))
    return Subject(EXPLODING, "steps", STEP, step, Greeting(PROTOCOL, (STEP,)))


def _thinned(scene: Scene) -> Scene:
    """Return a scene with fewer frames, played as fast."""
    motions = [
        motion._replace(
            positions=motion.positions[::EVERY],
            errors=motion.errors[::EVERY],
            distances=None if motion.distances is None else motion.distances[::EVERY],
        )
        for motion in scene.motions
    ]
    return scene._replace(motions=motions, seconds=EVERY * scene.seconds).checked()


def _silent(frame: int, count: int) -> None:
    """Report nothing: a solver takes less than a second."""
