"""Draw an arm and a cloth in parallel projection."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from numpy.typing import NDArray

from plumbob.reference.arguments import FloatArray

from .style import COLOURS
from .view import ARM_VIEW, CLOTH_VIEW, project

LIGHT = np.array([0.4, 0.8, 0.45])
# From near to far, ever lighter, as in motion.js.
COLOUR_MAP = LinearSegmentedColormap.from_list(
    "distance", ["#3d4ec6", "#8f3fb5", "#d0486f", "#f08a3c", "#f5c33b"]
)


def draw_arm(ax: Axes, joints: FloatArray, alpha: float = 1.0) -> None:
    """Draw a pose of a chain by the positions of its joints, (joint, 3), and mark its root."""
    x, y, _ = project(joints, ARM_VIEW)
    ax.plot(x, y, "-", color=COLOURS["blue"], alpha=alpha, linewidth=2.4, zorder=3)
    ax.plot(
        x, y, "o", color=COLOURS["blue"], alpha=alpha, markersize=4.5, markeredgewidth=0, zorder=4
    )
    ax.plot(x[:1], y[:1], "o", color=COLOURS["brass"], markersize=7, zorder=4)


def draw_cloth(
    ax: Axes,
    positions: FloatArray,
    pinned: Sequence[int] | NDArray[np.int64],
    shares: FloatArray | None = None,
) -> None:
    """Draw a square cloth by the positions of its particles, (particle, 3), far squares first.

    The shares colour the cloth, from 0 to 1 on the colour map, (particle,).
    """
    size = round(len(positions) ** 0.5)
    i, j = np.divmod(np.arange((size - 1) ** 2), size - 1)
    first = size * i + j
    corners = np.stack([first, first + size, first + size + 1, first + 1], axis=1)
    x, y, depth = project(positions, CLOTH_VIEW)
    order = np.argsort(depth[corners].mean(axis=1))
    quads = positions[corners]
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    lit = 0.25 + 0.6 * np.abs(normals @ (LIGHT / np.linalg.norm(LIGHT)))
    colours: list[Any] = [to_rgba(COLOURS["blue"], 1.0 - 0.85 * shade) for shade in lit[order]]
    if shares is not None:
        colours = list(COLOUR_MAP(shares[corners].mean(axis=1)[order]))
    edges = COLOURS["blue"] if shares is None else "white"
    outlines = np.stack([x[corners], y[corners]], axis=-1)[order]
    ax.add_collection(
        PolyCollection(list(outlines), facecolors=colours, edgecolors=edges, linewidths=0.35)
    )
    ax.plot(x[pinned], y[pinned], "o", color=COLOURS["brass"], markersize=4, zorder=4)
    ax.autoscale_view()
