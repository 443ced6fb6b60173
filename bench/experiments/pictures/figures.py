"""The arm on the custom curve and the falling cloth: as pictures, and as motions of the page."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...figures.sketch import Sketch
from ...figures.view import ARM_VIEW, CLOTH_VIEW, project
from ...harness.record import Record
from ...motion.motion import Moving, Scene
from ...tables.captions import Captions
from ...tables.results import Results, counted, label
from . import ARM, ARM_MOTION, CLOTH, CLOTH_MOTION
from .values import ClothDrawing, MovingCloth

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

CAPTIONS = Captions(__file__)
# Shades of the scale of spacings: few enough to be drawn as shapes rather than as an image.
SHADES = 40
# Frames beside each other in the filmstrip.
COLUMNS = 3
# Motions of a kind on the page, entrants first: a cloth adds some 60 kB to the page.
MAX_ARMS, MAX_CLOTHS = 6, 4
# Time in which the arm draws the curve [s].
DRAWING = 12.0
# A solver with a larger limit of iterations converges: its label has no count.
FEW = 50


def arm_draws(results: Results) -> Sketch | None:
    """Show the arm on the custom curve before and after resampling, the points by their spacing."""
    records = results.all("pictures", task=ARM)
    if not records:
        return None
    drawings = [
        (r.values.evened, r.values.curve, r.values.spacing, r.values.ghosts) for r in records
    ]
    return Sketch(
        **CAPTIONS.figure("arm_draws"),
        data=drawings,
        draw=_draw_arms,
    )


def falling_cloth(results: Results) -> Sketch | None:
    """Show a filmstrip of the falling cloth."""
    records = results.all("pictures", task=CLOTH)
    if not records:
        return None
    cloth: ClothDrawing = records[0].values
    return Sketch(
        **CAPTIONS.figure("falling_cloth"),
        data=(cloth.positions, cloth.time, cloth.pinned),
        draw=_draw_cloths,
    )


def _draw_arms(drawings: Any) -> "Figure":
    from ...figures.canvas import canvas
    from ...figures.drawing import power
    from ...figures.scene_drawing import draw_arm

    figure, axes = canvas(5.2, len(drawings), sharex=True, sharey=True)
    for ax, (evened, curve, spacing, ghosts) in zip(axes, drawings, strict=True):
        points = _points_by_spacing(ax, curve, spacing)
        for joints, alpha in zip(ghosts, [0.12] * (len(ghosts) - 1) + [0.9], strict=True):
            draw_arm(ax, joints, alpha)
        ax.set_title("after resampling" if evened else "before: as it is drawn")
        ax.set_aspect("equal")
        ax.axis("off")
    bar = figure.colorbar(points, ax=axes, shrink=0.5, aspect=35, location="bottom")
    bar.ax.xaxis.set_major_formatter(power)
    bar.ax.minorticks_off()
    bar.set_label("distance to the next point [m], log scale")
    bar.outline.set_visible(False)
    return figure


def _draw_cloths(frames: Any) -> "Figure":
    from ...figures.canvas import canvas
    from ...figures.scene_drawing import draw_cloth

    moments, times, pinned = frames
    rows = -(-len(times) // COLUMNS)
    figure, axes = canvas(2.1 * rows, COLUMNS, rows, sharex=True, sharey=True)
    for ax in axes:
        ax.set_aspect("equal")
        ax.axis("off")
    for ax, positions, time in zip(axes, moments, times, strict=False):
        draw_cloth(ax, positions, pinned)
        ax.set_title(f"{time:.1f} s", fontweight="normal", loc="center")
    return figure


def _points_by_spacing(ax: "Axes", curve: Any, spacing: Any) -> "ScalarMappable":
    """Draw the points of a shade as a single path, a tenth of the file; return the scale."""
    import matplotlib as mpl
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    scale = ScalarMappable(LogNorm(1e-4, 1), mpl.colormaps["viridis"].resampled(SHADES))
    points, shades = np.stack(project(curve[:-1], ARM_VIEW)[:2], axis=-1), scale.to_rgba(spacing)
    for shade in np.unique(shades, axis=0):
        ends = points[(shades == shade).all(axis=-1)][:, None] + [[0, 0], [1e-3, 0], [np.nan, 0]]
        ax.plot(*ends.reshape(-1, 2).T, color=shade, lw=2, solid_capstyle="round", zorder=5)
    return scale


def arm_motion(results: Results) -> Scene | None:
    """Return the arm on the custom curve, by each solver on record; None if there is none."""
    records = _first(results, ARM_MOTION, MAX_ARMS)
    if not records:
        return None
    return Scene(
        **CAPTIONS.figure("arm"),
        motions=[Moving(label(r.solver), r.values.positions, r.values.error) for r in records],
        seconds=DRAWING / len(records[0].values.positions),
        view=ARM_VIEW,
        panes=2,
        curve=records[0].values.curve,
    ).checked()


def cloth_motion(results: Results) -> Scene | None:
    """Return the falling cloth by each solver on record; None if there is none."""
    records = _first(results, CLOTH_MOTION, MAX_CLOTHS)
    if not records:
        return None
    return Scene(
        **CAPTIONS.figure("cloth"),
        motions=[_cloth(record) for record in records],
        seconds=records[0].values.h * records[0].values.every,
        view=CLOTH_VIEW,
        panes=2,
        marked=records[0].values.pinned.tolist(),
    ).checked()


def _cloth(record: Record) -> Moving:
    motion: MovingCloth = record.values
    count = record.values.iterations
    iterations = "converged" if count > FEW else counted(count, "iteration")
    rms = np.sqrt(np.mean(motion.distance**2, axis=-1))
    name = f"{label(record.solver)}, {iterations}"
    return Moving(name, motion.positions, rms, motion.distance)


def _first(results: Results, task: str, maximum: int) -> Sequence[Record]:
    """Return the visible records of a task: entrants first, then in their order."""
    records = results.all("pictures", task=task)
    order = sorted(records, key=lambda r: (r.solver not in results.entrants, r.values.order))
    return order[:maximum]
