"""Drawings of an arm and a cloth, seen in parallel projection."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from numpy.typing import NDArray

from .figures import COLOURS

Floats = NDArray[np.float64]

# Where the camera stands: rotated about the vertical and lifted above the floor [rad].
ARM_VIEW = (np.radians(200.0), np.radians(50.0))
CLOTH_VIEW = (np.radians(-38.0), np.radians(18.0))
LIGHT = np.array([0.4, 0.8, 0.45])


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
