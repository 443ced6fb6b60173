"""A scene as an animated GIF, or as a strip of moments in SVG."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..presentation.figures.drawing import STYLE, power
from ..presentation.figures.scene_drawing import COLOUR_MAP, draw_arm, draw_cloth
from ..presentation.figures.style import COLOURS, written
from ..presentation.figures.view import seen
from ..presentation.motion.motion import Moving, Scene, decades, length

# A picture shows so many moments beside each other.
MOMENTS = 4
MARGIN = 0.1
RATE = 20
_WHITE: dict[Any, Any] = {"savefig.facecolor": "white", "figure.facecolor": "white"}
Told = Callable[[int, int], None]


def animate(scene: Scene, path: Path, progress: Told) -> None:
    """Write a GIF: the solvers beside each other and, if there are several, a scale of colours."""
    with mpl.rc_context({**STYLE, **_WHITE}):
        count = len(scene.motions)
        figure = Figure(figsize=(4.8 * count, 4.8 if count == 1 else 5.4), dpi=96)
        base, top = (0.0, 1.0) if count == 1 else (0.18, 0.94)
        axes = [figure.add_axes((i / count, base, 1 / count, top - base)) for i in range(count)]
        if count > 1:
            _bar(scene, figure, figure.add_axes((0.3, 0.08, 0.4, 0.02)))
        update = partial(_frame, axes, scene)
        frames = len(scene.motions[0].positions)
        animation = FuncAnimation(figure, update, frames=frames, init_func=lambda: ())
        animation.save(path, writer=PillowWriter(fps=RATE), progress_callback=progress)


def picture(scene: Scene, path: Path, progress: Told) -> None:
    """Write an SVG: a row of moments for each solver."""
    with mpl.rc_context({**STYLE, **_WHITE}):
        count = len(scene.motions)
        height = 2.8 * count + (0.6 if count > 1 else 0.0)
        figure = Figure(figsize=(2.4 * MOMENTS, height), layout="constrained")
        rows = figure.subplots(count, MOMENTS, squeeze=False)
        last = len(scene.motions[0].positions) - 1
        for done, i in enumerate(np.linspace(0, last, MOMENTS).round().astype(int), 1):
            _frame(list(rows[:, done - 1]), scene, int(i), title=done == 1)
            progress(done, MOMENTS)
        if count > 1:
            _bar(scene, figure, None, rows.ravel().tolist())
        figure.savefig(path, metadata={"Date": None})


def _bar(scene: Scene, figure: Figure, where: Axes | None, beside: Sequence[Axes] = ()) -> None:
    """Draw what the colours mean."""
    low, high = decades(scene)
    colours = ScalarMappable(LogNorm(10.0**low, 10.0**high), COLOUR_MAP)
    more: dict[str, Any] = {"cax": where} if where else {"ax": beside, "shrink": 0.5, "aspect": 40}
    bar = figure.colorbar(colours, orientation="horizontal", **more)
    bar.ax.xaxis.set_major_formatter(power)
    bar.ax.minorticks_off()
    bar.set_label(f"{scene.measure} [m]")


def _frame(axes: Sequence[Axes], scene: Scene, i: int, title: bool = True) -> tuple[()]:
    every = [one.positions.reshape(-1, 3) for one in scene.motions]
    every += [] if scene.curve is None else [scene.curve]
    x, y, _ = seen(np.concatenate(every), scene.view)
    for ax, one in zip(axes, scene.motions, strict=True):
        ax.clear()
        (_arm if scene.curve is not None else _cloth)(ax, scene, one, i)
        if len(scene.motions) > 1:
            _say(ax, one, i, title)
        ax.set_xlim(np.nanmin(x) - MARGIN, np.nanmax(x) + MARGIN)
        ax.set_ylim(np.nanmin(y) - MARGIN, np.nanmax(y) + MARGIN)
        ax.set_aspect("equal")
        ax.axis("off")
    return ()


def _say(ax: Axes, one: Moving, i: int, title: bool) -> None:
    """Write whose motion this is, and its error in this frame."""
    ax.set_title(written(one.label) if title else "", fontweight="bold", loc="left")
    error = f"error {length(one.errors[i])}" if np.isfinite(one.errors[i]) else "diverged"
    ax.text(0.0, -0.02, error, transform=ax.transAxes, va="top", color=COLOURS["faint"])


def _arm(ax: Axes, scene: Scene, one: Moving, i: int) -> None:
    assert scene.curve is not None
    x, y, _ = seen(scene.curve, scene.view)
    ax.plot(x, y, color=COLOURS["rule"], linewidth=1 if len(scene.motions) == 1 else 3)
    x, y, _ = seen(one.positions[: i + 1, -1], scene.view)
    if len(scene.motions) == 1:
        ax.plot(x, y, color=COLOURS["orange"], linewidth=1.8)
    else:
        ends = np.stack([x, y], axis=-1)
        lines = LineCollection(list(np.stack([ends[:-1], ends[1:]], axis=1)), linewidths=1.8)
        lines.set_color(
            list(COLOUR_MAP(np.nan_to_num(_share(scene, one.errors[1 : i + 1]), nan=1)))
        )
        ax.add_collection(lines)
    draw_arm(ax, one.positions[i])


def _cloth(ax: Axes, scene: Scene, one: Moving, i: int) -> None:
    if not np.isfinite(one.positions[i]).all():
        return
    shares = None
    if len(scene.motions) > 1 and one.distances is not None:
        shares = _share(scene, one.distances[i])
    draw_cloth(ax, one.positions[i], scene.marked, shares)


def _share(scene: Scene, errors: Any) -> Any:
    low, high = decades(scene)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.clip((np.log10(errors) - low) / (high - low), 0.0, 1.0)
