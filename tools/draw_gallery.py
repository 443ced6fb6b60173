"""Draw docs/gallery, curves and cloths by good and faulty solvers: `python tools/draw_gallery.py`.

Curves and cloths stand still, in SVG; two famous faults move, in GIF.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
from draw_lab import DOCS, shorten
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from plumbob.bench.player.motion import Scene
from plumbob.bench.show import picture, scenes
from plumbob.bench.show.scene_solver import SceneSolver
from plumbob.bench.show.scenes import CLOTH, EXACT
from plumbob.verify.functions import FunctionConnection
from plumbob.verify.greeting import PROTOCOL, Greeting
from plumbob.verify.mass_spring.model import Integrator, StepModel, simulate
from plumbob.verify.mass_spring.problem import problem_of
from plumbob.verify.self_test import subjects

CURVE, EXPLODING = "heart", "explicit Euler"
# A film shows every third frame of a scene, in a small picture.
EVERY, DPI = 3, 56


class FamousFault(NamedTuple):
    """A mistake that many programs make, and the scene that shows it."""

    title: str  # how the picture calls it
    family: str  # of the faults of the self-test
    fault: str  # its key there
    scene: str = CLOTH  # or the curve that the arm draws


MISSING_PARENT = FamousFault(
    "Parent's rotation left out", "CCD", "rotations not accumulated", CURVE
)
NO_BACKWARD_PASS = FamousFault("No backward pass", "FABRIK", "no backward pass", CURVE)
DRIFTING_PINS = FamousFault("Pins that drift", "STEP", "pins of one kilogram")
DOUBLE_GRAVITY = FamousFault("Gravity twice", "STEP", "gravity doubled")
EXPLICIT_EULER = FamousFault("Explicit Euler explodes", "STEP", EXPLODING)
# Faulty solvers beside the right one, by the file's name; the solver of Plumbob beside each.
PICTURES = {
    "curves.svg": ("fabrik", (MISSING_PARENT, NO_BACKWARD_PASS)),
    "cloths.svg": (EXACT, (DRIFTING_PINS, DOUBLE_GRAVITY)),
    "missing_parent.gif": ("ccd", (MISSING_PARENT,)),
    "explicit_euler.gif": (EXACT, (EXPLICIT_EULER,)),
}


def draw_gallery(folder: Path) -> None:
    """Draw all pictures and films into a folder."""
    for name, (solver, faults) in PICTURES.items():
        scene, path = beside_truth(solver, faults), folder / name
        if path.suffix == ".gif":
            animate(thinned(scene), path)
        else:
            picture.draw_picture(scene, path, ignore)
            shorten(path)


def beside_truth(solver: str, faults: Sequence[FamousFault]) -> Scene:
    """Return the scene of faulty solvers beside a solver of Plumbob."""
    titles = [fault.title for fault in faults]
    if faults[0].scene == CLOTH:
        cloth = scenes.cloth_motion(solver)
        x = [scenes.step_like(cloth, solver_of(fault), ignore) for fault in faults]
        return scenes.cloth_scene(cloth, solver, list(zip(titles, x, strict=True)))
    arm = scenes.arm_motion(CURVE, solver)
    x = [scenes.draw_like(arm, solver_of(fault), ignore) for fault in faults]
    name = f"Plumbob {solver.upper()}"
    return scenes.arm_scene(CURVE, arm, name, list(zip(titles, x, strict=True)))


def solver_of(fault: FamousFault) -> SceneSolver:
    """Return the subject of the self-test that has a fault, or explicit Euler.

    Explicit Euler is an honest method, but unstable on the cloth.
    """
    for subject in subjects():
        if (subject.family, subject.name) == (fault.family, fault.fault):
            return SceneSolver(fault.title, subject.connection)
    model = StepModel(Integrator("explicit"), velocity="separate")

    def step(**inputs: Any) -> Mapping[str, Any]:
        return simulate(problem_of(inputs), model)

    greeting = Greeting(PROTOCOL, ("mass_spring_step",))
    return SceneSolver(fault.title, FunctionConnection({"mass_spring_step": step}, greeting))


def thinned(scene: Scene) -> Scene:
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


def animate(scene: Scene, path: Path) -> None:
    """Write a GIF of the solvers beside each other, above a colour bar."""
    with mpl.rc_context(picture.ON_WHITE):
        count = len(scene.motions)
        figure = Figure(figsize=(4.8 * count, 5.4), dpi=DPI)
        lefts = [(i + 0.02) / count for i in range(count)]
        axes = [figure.add_axes((left, 0.18, 0.96 / count, 0.76)) for left in lefts]
        picture.draw_colour_bar(scene, figure, cax=figure.add_axes((0.3, 0.08, 0.4, 0.02)))
        update = partial(picture.draw_frame, axes, scene)
        frames = len(scene.motions[0].positions)
        animation = FuncAnimation(figure, update, frames=frames, init_func=lambda: ())
        animation.save(path, writer=PillowWriter(fps=round(1 / scene.seconds)))


def ignore(frame: int, count: int) -> None:
    """Report no progress: a solver takes less than a second."""


if __name__ == "__main__":
    draw_gallery(DOCS / "gallery")
