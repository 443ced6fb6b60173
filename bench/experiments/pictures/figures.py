"""Pictures of the scenes for the report: the arm on the custom curve, and the cloth as it falls."""

from typing import TYPE_CHECKING, Any

from ...figures.sketch import Sketch
from ...tables.results import Results
from . import ARM, CLOTH
from .values import ClothDrawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

# Shades of the scale of spacings: few enough to be drawn as shapes rather than as an image.
SHADES = 40
# Frames of the filmstrip beside each other.
COLUMNS = 3


def arm_draws(results: Results) -> Sketch | None:
    """Show the arm on the custom curve, before and after resampling, points by their spacing."""
    records = results.all("pictures", task=ARM)
    if not records:
        return None
    data = [
        (record.details.evened, record.values.curve, record.values.spacing, record.values.ghosts)
        for record in records
    ]
    return Sketch(
        "arm_draws",
        "The lab’s arm draws the custom curve",
        "The arm hangs from its root above; the drawing lies in the plane y = 0. Fainter poses "
        "are earlier frames.",
        data,
        _draw_arms,
    )


def falling_cloth(results: Results) -> Sketch | None:
    """Show a filmstrip of the falling cloth."""
    records = results.all("pictures", task=CLOTH)
    if not records:
        return None
    cloth: ClothDrawing = records[0].values
    return Sketch(
        "falling_cloth",
        "The lab’s cloth swings from two corners",
        "Every step converged by Newton. The pinned corners are marked.",
        (cloth.positions, cloth.time, cloth.pinned),
        _draw_cloths,
    )


def _draw_arms(data: Any) -> "Figure":
    from ...figures.drawing import canvas, power

    figure, axes = canvas(5.2, len(data), sharex=True, sharey=True)
    for ax, (evened, curve, spacing, ghosts) in zip(axes, data, strict=True):
        points = _points_by_spacing(ax, curve, spacing)
        _ghosts(ax, ghosts)
        ax.set_title("after resampling" if evened else "before: as it is drawn")
        _bare(ax)
    bar = figure.colorbar(points, ax=axes, shrink=0.5, aspect=35, location="bottom")
    bar.ax.xaxis.set_major_formatter(power)
    bar.ax.minorticks_off()
    bar.set_label("distance to the next point [m], log scale")
    bar.outline.set_visible(False)
    return figure


def _draw_cloths(data: Any) -> "Figure":
    from ...figures.drawing import canvas
    from ...figures.scene_drawing import draw_cloth

    moments, times, pinned = data
    rows = -(-len(times) // COLUMNS)
    figure, axes = canvas(2.1 * rows, COLUMNS, rows, sharex=True, sharey=True)
    for ax in axes:
        _bare(ax)
    for ax, positions, time in zip(axes, moments, times, strict=False):
        draw_cloth(ax, positions, pinned)
        ax.set_title(f"{time:.1f} s", fontweight="normal", loc="center")
    return figure


def _points_by_spacing(ax: "Axes", curve: Any, spacing: Any) -> "ScalarMappable":
    """Draw the points of a shade as one path, which takes a tenth of the file; return the scale."""
    import matplotlib as mpl
    import numpy as np
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    from ...figures.view import ARM_VIEW, seen

    scale = ScalarMappable(LogNorm(1e-4, 1), mpl.colormaps["viridis"].resampled(SHADES))
    points, shades = np.stack(seen(curve[:-1], ARM_VIEW)[:2], axis=-1), scale.to_rgba(spacing)
    for shade in np.unique(shades, axis=0):
        ends = points[(shades == shade).all(axis=-1)][:, None] + [[0, 0], [1e-3, 0], [np.nan, 0]]
        ax.plot(*ends.reshape(-1, 2).T, color=shade, lw=2, solid_capstyle="round", zorder=5)
    return scale


def _ghosts(ax: "Axes", ghosts: Any) -> None:
    from ...figures.scene_drawing import draw_arm

    for joints, alpha in zip(ghosts, [0.12] * (len(ghosts) - 1) + [0.9], strict=True):
        draw_arm(ax, joints, alpha)


def _bare(ax: "Axes") -> None:
    ax.set_aspect("equal")
    ax.axis("off")
