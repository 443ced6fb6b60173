"""Pictures of the scenes, seen in parallel projection: SVG for the report, GIF for `show`."""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.colors import LogNorm, to_rgba
from numpy.typing import NDArray

from ...harness.record import Record
from ...presentation.figures import COLOURS, Drawing, canvas, finished
from ...presentation.results import Results
from . import ARM, CLOTH

Floats = NDArray[np.float64]

# Where the camera stands: rotated about the vertical and lifted above the floor [rad].
ARM_VIEW = (np.radians(200.0), np.radians(50.0))
CLOTH_VIEW = (np.radians(-38.0), np.radians(18.0))
# Shades of the scale of spacings: few enough to be drawn as shapes rather than as an image.
SHADES = 40
# Frames of the filmstrip beside each other.
COLUMNS = 3
LIGHT = np.array([0.4, 0.8, 0.45])


def arm_draws(results: Results) -> Drawing | None:
    """Draw the arm on the custom curve, before and after resampling, points by their spacing."""
    records = results.all("pictures", task=ARM)
    if not records:
        return None
    with canvas(5.4, len(records), sharex=True, sharey=True) as (figure, axes):
        for ax, record in zip(axes, records, strict=True):
            points = _points_by_spacing(ax, record)
            _ghosts(ax, record.arrays["ghosts"])
            evened = record.settings["evened"]
            ax.set_title("after resampling" if evened else "before: as it is drawn")
            _bare(ax)
        bar = figure.colorbar(points, ax=axes, shrink=0.5, aspect=35, location="bottom")
        bar.set_label("distance to the next point [m], log scale")
        bar.outline.set_visible(False)
        return finished(
            figure,
            "arm_draws",
            "The lab’s arm draws the custom curve",
            "The arm hangs from its root above; the drawing lies in the plane y = 0. Fainter poses "
            "are earlier frames.",
        )


def falling_cloth(results: Results) -> Drawing | None:
    """Draw a filmstrip of the falling cloth."""
    records = results.all("pictures", task=CLOTH)
    if not records:
        return None
    arrays = records[0].arrays
    rows = -(-len(arrays["time"]) // COLUMNS)
    with canvas(2.1 * rows, COLUMNS, rows, sharex=True, sharey=True) as (figure, axes):
        for ax in axes:
            _bare(ax)
        for ax, positions, time in zip(axes, arrays["positions"], arrays["time"], strict=False):
            draw_cloth(ax, positions, arrays["pinned"])
            ax.set_title(f"{time:.1f} s", fontweight="normal", loc="center")
        return finished(
            figure,
            "falling_cloth",
            "The lab’s cloth swings from two corners",
            "Every step converged by Newton. The pinned corners are marked.",
        )


def draw_arm(ax: Axes, joints: Floats, alpha: float = 1.0) -> None:
    """Draw one pose of a chain from its joints' positions, (joint, 3)."""
    x, y, _ = seen(joints, ARM_VIEW)
    ax.plot(x, y, "-", color=COLOURS["blue"], alpha=alpha, linewidth=2.4, zorder=3)
    ax.plot(
        x, y, "o", color=COLOURS["blue"], alpha=alpha, markersize=4.5, markeredgewidth=0, zorder=4
    )


def draw_cloth(ax: Axes, positions: Floats, pinned: Sequence[int] | NDArray[np.int64]) -> None:
    """Draw a square cloth from its particles' positions, (particle, 3), the far squares first."""
    size = round(len(positions) ** 0.5)
    i, j = np.divmod(np.arange((size - 1) ** 2), size - 1)
    first = size * i + j
    corners = np.stack([first, first + size, first + size + 1, first + 1], axis=1)
    x, y, depth = seen(positions, CLOTH_VIEW)
    order = np.argsort(depth[corners].mean(axis=1))
    quads = positions[corners]
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    lit = 0.25 + 0.6 * np.abs(normals @ (LIGHT / np.linalg.norm(LIGHT)))
    colours = [to_rgba(COLOURS["blue"], 1.0 - 0.85 * shade) for shade in lit[order]]
    outlines = np.stack([x[corners], y[corners]], axis=-1)[order]
    ax.add_collection(
        PolyCollection(
            list(outlines), facecolors=colours, edgecolors=COLOURS["blue"], linewidths=0.35
        )
    )
    ax.plot(x[pinned], y[pinned], "o", color=COLOURS["brass"], markersize=4, zorder=4)
    ax.autoscale_view()


def seen(points: Floats, view: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Return where points appear to the right and up, and how near, from an azimuth and height."""
    azimuth, height = view
    x, y, z = np.moveaxis(points, -1, 0)
    right = np.cos(azimuth) * x + np.sin(azimuth) * z
    toward = -np.sin(azimuth) * x + np.cos(azimuth) * z
    up = np.cos(height) * y - np.sin(height) * toward
    return right, up, np.sin(height) * y + np.cos(height) * toward


def _points_by_spacing(ax: Axes, record: Record) -> PathCollection:
    x, y, _ = seen(record.arrays["curve"][:-1], ARM_VIEW)
    shades = mpl.colormaps["viridis"].resampled(SHADES)
    dots: dict[str, Any] = {"s": 4, "linewidths": 0, "zorder": 5}
    spacing, norm = record.arrays["spacing"], LogNorm(1e-4, 1)
    return ax.scatter(x, y, c=spacing, cmap=shades, norm=norm, **dots)


def _ghosts(ax: Axes, ghosts: Floats) -> None:
    for joints, alpha in zip(ghosts, np.linspace(0.06, 0.5, len(ghosts)), strict=True):
        draw_arm(ax, joints, alpha)
    x, y, _ = seen(ghosts[0, :1], ARM_VIEW)
    ax.plot(x, y, "o", color=COLOURS["brass"], markersize=7, zorder=5)


def _bare(ax: Axes) -> None:
    ax.set_aspect("equal")
    ax.axis("off")
