"""Animations and pictures of the named scenes, and motions for animation programs."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference import (
    IK_SOLVERS,
    STEP_SOLVERS,
    IKSolution,
    ImplicitEuler,
    curves,
    resample,
    scenes,
    track,
)
from reference.arguments import FloatArray, choice
from reference.formats import bvh

from .experiments.arm.problem import CUSTOM, MAX_SPACING, MIN_SPACING
from .presentation.drawing import STYLE
from .presentation.figures import COLOURS
from .presentation.scene_drawing import ARM_VIEW, CLOTH_VIEW, draw_arm, draw_cloth, seen

ARM, CLOTH = "arm", "cloth"
SCENES = (ARM, CLOTH, *curves)
H = 1 / 60
SECONDS = 5
# An animation shows each third step; an arm's frames are thinned out to about as many.
EVERY = 3
RATE = 20
FRAMES = SECONDS * RATE
# A picture shows so many moments beside each other.
MOMENTS = 4
MARGIN = 0.1
GIF, SVG, BVH = ".gif", ".svg", ".bvh"
PICTURES = (GIF, SVG)


class Motion(NamedTuple):
    """A scene that moves.

    Attributes:
        positions: of all points in all frames, for the extent of the picture (frame, point, 3).
        view: where the camera stands.
        draw: draws a frame, given the axes and its number.
    """

    positions: FloatArray
    view: tuple[float, float]
    draw: Callable[[Axes, int], None]


class Drawn(NamedTuple):
    """A curve and how the arm follows it, a frame a point."""

    curve: FloatArray
    motion: IKSolution


def write(
    scene: str,
    path: Path,
    solver: str | None,
    progress: Callable[[int, int], None],
    coherent: bool = False,
) -> None:
    """Write a scene as an animated GIF or, by the file's suffix, an SVG picture or a BVH motion.

    Raises:
        ValueError: if the suffix is another or not one for this scene, scene or solver are unknown,
            or a cloth is to be coherent.
    """
    is_cloth = choice("scene", scene, SCENES) == CLOTH
    choice("suffix of the file", path.suffix, PICTURES if is_cloth else (*PICTURES, BVH))
    if is_cloth and coherent:
        raise ValueError("coherent: expected an arm that follows a curve, got a cloth")
    if is_cloth:
        motion = _falling(choice("solver", solver or "newton", STEP_SOLVERS))
    else:
        drawn = _drawn(scene, choice("solver", solver or "fabrik", IK_SOLVERS), coherent)
        if path.suffix == BVH:
            skeleton, _ = scenes.lab_arm()
            frame_time = SECONDS / len(drawn.curve)
            return bvh.write(path, skeleton, drawn.motion.local_rotations, frame_time)
        motion = _drawing(drawn)
    white: dict[Any, Any] = {"savefig.facecolor": "white", "figure.facecolor": "white"}
    with mpl.rc_context({**STYLE, **white}):
        (_animate if path.suffix == GIF else _picture)(motion, path, progress)
    return None


def _animate(motion: Motion, path: Path, progress: Callable[[int, int], None]) -> None:
    figure = Figure(figsize=(4.8, 4.8), dpi=96)
    ax = figure.add_axes((0, 0, 1, 1))
    update = partial(_frame, ax, motion)
    animation = FuncAnimation(figure, update, frames=len(motion.positions), init_func=lambda: ())
    animation.save(path, writer=PillowWriter(fps=RATE), progress_callback=progress)


def _picture(motion: Motion, path: Path, progress: Callable[[int, int], None]) -> None:
    figure = Figure(figsize=(2.4 * MOMENTS, 2.8), layout="constrained")
    moments = np.linspace(0, len(motion.positions) - 1, MOMENTS).round().astype(int)
    for done, (ax, i) in enumerate(zip(figure.subplots(1, MOMENTS), moments, strict=True), 1):
        _frame(ax, motion, int(i))
        progress(done, MOMENTS)
    figure.savefig(path, metadata={"Date": None})


def _frame(ax: Axes, motion: Motion, i: int) -> tuple[()]:
    ax.clear()
    motion.draw(ax, i)
    x, y, _ = seen(motion.positions.reshape(-1, 3), motion.view)
    ax.set_xlim(x.min() - MARGIN, x.max() + MARGIN)
    ax.set_ylim(y.min() - MARGIN, y.max() + MARGIN)
    ax.set_aspect("equal")
    ax.axis("off")
    return ()


def _drawn(scene: str, solver: str, coherent: bool) -> Drawn:
    """Return the arm drawing a curve, evened out; a coherent motion can be repeated for ever."""
    skeleton, rest = scenes.lab_arm()
    points = curves[CUSTOM if scene == ARM else scene]()
    even = resample(points, min_spacing=MIN_SPACING, max_spacing=MAX_SPACING, closed=coherent)
    motion = track(skeleton, even, solver, rest, coherent=coherent, closed=coherent)
    return Drawn(even, motion)


def _drawing(drawn: Drawn) -> Motion:
    """Return what is seen of the arm and its curve."""
    points, positions = drawn.curve, drawn.motion.positions
    shown = np.linspace(0, len(points) - 1, min(len(points), FRAMES)).round().astype(int)
    x, y, _ = seen(points, ARM_VIEW)

    def draw(ax: Axes, i: int) -> None:
        ax.plot(x, y, color=COLOURS["rule"], linewidth=1)
        ax.plot(x[: shown[i] + 1], y[: shown[i] + 1], color=COLOURS["orange"], linewidth=1.8)
        draw_arm(ax, positions[shown[i]])

    return Motion(positions[shown], ARM_VIEW, draw)


def _falling(solver: str) -> Motion:
    """Return the lab's cloth, let go."""
    system, state = scenes.lab_cloth()
    integrator = ImplicitEuler(system, h=H, solver=solver)
    positions = [state.positions]
    for _ in range(FRAMES * EVERY):
        state = integrator.step(state).state
        positions.append(state.positions)
    shown = np.array(positions[::EVERY])
    return Motion(shown, CLOTH_VIEW, lambda ax, i: draw_cloth(ax, shown[i], system.pinned))
