"""A scene as an animated GIF, or as a strip of moments in SVG."""

import tempfile
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

from ..figures.drawing import STYLE
from ..figures.scene_drawing import COLOUR_MAP, draw_arm, draw_cloth
from ..figures.style import COLOURS, written
from ..figures.view import seen
from ..motion.motion import Moving, Scene, decades, length

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
        lefts = [(i + 0.02) / count for i in range(count)]
        axes = [figure.add_axes((left, base, 0.96 / count, top - base)) for left in lefts]
        if count > 1:
            _bar(scene, figure, figure.add_axes((0.3, 0.08, 0.4, 0.02)))
        update = partial(_frame, axes, scene)
        frames = len(scene.motions[0].positions)
        animation = FuncAnimation(figure, update, frames=frames, init_func=lambda: ())
        with tempfile.TemporaryDirectory() as folder:  # interrupted, Pillow writes what it has
            whole = Path(folder, "film.gif")
            animation.save(whole, writer=PillowWriter(fps=RATE), progress_callback=progress)
            path.write_bytes(whole.read_bytes())


def picture(scene: Scene, path: Path, progress: Told) -> None:
    """Write an SVG: for each solver what an arm has drawn, or a row of moments of a cloth."""
    with mpl.rc_context({**STYLE, **_WHITE}):
        count, is_arm = len(scene.motions), scene.curve is not None
        rows, columns, size = (1, count, 4.8) if is_arm else (count, MOMENTS, 2.4)
        figure = Figure(figsize=(size * columns, size * rows + 0.6), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).reshape(count, -1)
        last = len(scene.motions[0].positions) - 1
        moments = np.linspace(0, last, MOMENTS).round().astype(int).tolist()
        for done, i in enumerate(moments[-panels.shape[1] :], 1):
            _frame(list(panels[:, done - 1]), scene, i, done == 1, moments if is_arm else ())
            progress(done, panels.shape[1])
        if count > 1:
            _bar(scene, figure, None, panels.ravel().tolist())
        figure.savefig(path, metadata={"Date": None}, bbox_inches="tight")


def _bar(scene: Scene, figure: Figure, where: Axes | None, beside: Sequence[Axes] = ()) -> None:
    """Draw what the colours mean."""
    low, high = decades(scene)
    colours = ScalarMappable(LogNorm(10.0**low, 10.0**high), COLOUR_MAP)
    more: dict[str, Any] = {"cax": where} if where else {"ax": beside, "shrink": 0.5, "aspect": 40}
    bar = figure.colorbar(colours, orientation="horizontal", **more)
    bar.ax.xaxis.set_major_formatter(lambda metres, _: length(metres))
    bar.ax.minorticks_off()
    bar.set_label(scene.measure)


def _frame(
    axes: Sequence[Axes], scene: Scene, i: int, title: bool = True, poses: Sequence[int] = ()
) -> tuple[()]:
    every = [one.positions.reshape(-1, 3) for one in scene.motions]
    every += [] if scene.curve is None else [scene.curve]
    x, y, _ = seen(np.concatenate(every), scene.view)
    for ax, one in zip(axes, scene.motions, strict=True):
        ax.clear()
        for k in poses:
            draw_arm(ax, one.positions[k], alpha=0.15)
        (_arm if scene.curve is not None else _cloth)(ax, scene, one, i)
        if len(scene.motions) > 1:
            _say(ax, one, i, title)
        ax.set_xlim(np.nanmin(x) - MARGIN, np.nanmax(x) + MARGIN)
        ax.set_ylim(np.nanmin(y) - MARGIN, np.nanmax(y) + MARGIN)
        ax.set_aspect("equal")
        ax.axis("off")
    return ()


def _say(ax: Axes, one: Moving, i: int, title: bool) -> None:
    """Write whose motion this is, and its error in this frame and up to it."""
    ax.set_title(written(one.label) if title else "", fontweight="bold", loc="left")
    error, largest = (length(value) for value in (one.errors[i], np.max(one.errors[: i + 1])))
    error = f"error {error}, largest {largest}" if np.isfinite(one.errors[i]) else "diverged"
    ax.text(0.0, -0.02, error, transform=ax.transAxes, va="top", color=COLOURS["faint"])


def _arm(ax: Axes, scene: Scene, one: Moving, i: int) -> None:
    assert scene.curve is not None
    x, y, _ = seen(scene.curve, scene.view)
    ax.plot(x, y, color=COLOURS["rule"], linewidth=1 if len(scene.motions) == 1 else 3, zorder=2)
    x, y, _ = seen(one.positions[: i + 1, -1], scene.view)
    if len(scene.motions) == 1:
        ax.plot(x, y, color=COLOURS["orange"], linewidth=1.8, zorder=5)
    else:
        ends = np.stack([x, y], axis=-1)
        segments = list(np.stack([ends[:-1], ends[1:]], axis=1))
        lines = LineCollection(segments, linewidths=2.4, zorder=5)
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
