"""A scene as a still picture, in SVG."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..figures.scene_drawing import COLOUR_MAP, draw_arm, draw_cloth
from ..figures.style import COLOURS, PARAMETERS, plain_label
from ..figures.view import project
from ..player.motion import Moving, Scene, decades, length

# Moments of a picture.
MOMENTS = 4
MARGIN = 0.1  # around a drawing, over its size
ON_WHITE = {**PARAMETERS, "savefig.facecolor": "white", "figure.facecolor": "white"}
Progress = Callable[[int, int], None]


def draw_picture(scene: Scene, path: Path, progress: Progress) -> None:
    """Write an SVG: the curve that an arm has drawn, or moments of a cloth, for each solver."""
    with mpl.rc_context(ON_WHITE):
        count, is_arm = len(scene.motions), scene.curve is not None
        rows, columns, size = (1, count, 4.8) if is_arm else (count, MOMENTS, 2.4)
        figure = Figure(figsize=(size * columns, size * rows + 0.6), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).reshape(count, -1)
        last = len(scene.motions[0].positions) - 1
        moments = np.linspace(0, last, MOMENTS).round().astype(int).tolist()
        for k, i in enumerate(moments[-panels.shape[1] :]):
            draw_frame(list(panels[:, k]), scene, i, k == 0, moments if is_arm else ())
            progress(k + 1, panels.shape[1])
        if count > 1:
            draw_colour_bar(scene, figure, ax=panels.ravel().tolist(), shrink=0.5, aspect=40)
        figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")


def draw_colour_bar(scene: Scene, figure: Figure, **place: Any) -> None:
    """Draw the scale of errors, placed as by `Figure.colorbar`."""
    low, high = decades(scene)
    colours = ScalarMappable(LogNorm(10.0**low, 10.0**high), COLOUR_MAP)
    bar = figure.colorbar(colours, orientation="horizontal", **place)
    bar.ax.xaxis.set_major_formatter(lambda metres, _: length(metres))
    bar.ax.minorticks_off()
    bar.set_label(scene.measure)


def draw_frame(
    axes: Sequence[Axes], scene: Scene, i: int, title: bool = True, poses: Sequence[int] = ()
) -> tuple[()]:
    """Draw frame i of each motion, and faintly the poses of other frames."""
    x, y, _ = project(scene.points(), scene.view)
    draw = _draw_cloth if scene.curve is None else _draw_arm
    for ax, motion in zip(axes, scene.motions, strict=True):
        ax.clear()
        for k in poses:
            draw_arm(ax, motion.positions[k], alpha=0.15)
        draw(ax, scene, motion, i)
        if len(scene.motions) > 1:
            _write_error(ax, motion, i, title)
        ax.set_xlim(np.nanmin(x) - MARGIN, np.nanmax(x) + MARGIN)
        ax.set_ylim(np.nanmin(y) - MARGIN, np.nanmax(y) + MARGIN)
        ax.set_aspect("equal")
        ax.axis("off")
    return ()


def _write_error(ax: Axes, motion: Moving, i: int, title: bool) -> None:
    """Write the solver, and its error in this frame and so far."""
    ax.set_title(plain_label(motion.label) if title else "", fontweight="bold", loc="left")
    error, largest = length(motion.errors[i]), length(np.max(motion.errors[: i + 1]))
    text = f"error {error}, largest {largest}" if np.isfinite(motion.errors[i]) else "diverged"
    ax.text(0.0, -0.02, text, transform=ax.transAxes, va="top", color=COLOURS["faint"])


def _draw_arm(ax: Axes, scene: Scene, motion: Moving, i: int) -> None:
    """Draw the curve, the part that the arm has drawn, and the arm."""
    assert scene.curve is not None
    is_single = len(scene.motions) == 1
    x, y, _ = project(scene.curve, scene.view)
    ax.plot(x, y, color=COLOURS["rule"], linewidth=1 if is_single else 3, zorder=2)
    x, y, _ = project(motion.positions[: i + 1, -1], scene.view)
    if is_single:
        ax.plot(x, y, color=COLOURS["orange"], linewidth=1.8, zorder=5)
    else:
        ends = np.stack([x, y], axis=-1)
        segments = list(np.stack([ends[:-1], ends[1:]], axis=1))
        lines = LineCollection(segments, linewidths=2.4, zorder=5)
        shades = np.nan_to_num(_on_scale(scene, motion.errors[1 : i + 1]), nan=1)
        lines.set_color(list(COLOUR_MAP(shades)))
        ax.add_collection(lines)
    draw_arm(ax, motion.positions[i])


def _draw_cloth(ax: Axes, scene: Scene, motion: Moving, i: int) -> None:
    if np.isfinite(motion.positions[i]).all():
        shades = None
        if len(scene.motions) > 1 and motion.distances is not None:
            shades = _on_scale(scene, motion.distances[i])
        draw_cloth(ax, motion.positions[i], scene.marked, shades)


def _on_scale(scene: Scene, errors: Any) -> Any:
    """Return errors on the colour scale, from 0 to 1."""
    low, high = decades(scene)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.clip((np.log10(errors) - low) / (high - low), 0.0, 1.0)
