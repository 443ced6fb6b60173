"""A failing case drawn in space as SVG: theirs dashed, ours solid."""

import io
import re
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform

from .geometry import FloatArray, Scene, Shape

# Differences below the first part of the drawing are magnified to about the second.
_VISIBLE, _MAGNIFIED = 0.02, 0.2
# So few points are numbered.
_NUMBERED = 12
# Points further from the middle than so many extents of the right answer are left out.
_FAR = 3.0
# Colours that stand for those of the page, which are others in the dark.
_COLOURS = {"rule": "#010101", "blue": "#020202", "orange": "#030303", "ink": "#040404",
            "faint": "#050505"}  # fmt: skip
_STYLES: dict[str, dict[str, Any]] = {
    "given": {"color": _COLOURS["rule"], "linewidth": 1.2},
    "ours": {"color": _COLOURS["blue"], "linewidth": 3.0, "alpha": 0.55},
    "theirs": {"color": _COLOURS["orange"], "linewidth": 1.4, "linestyle": (0, (4, 2))},
}


def svg(scene: Scene, title: str) -> Markup:
    """Return a drawing in the colours of the page."""
    points = _near(scene)
    figure = Figure(figsize=(6.4, 4.8))
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", facecolor="none")
    _set_box(axes, np.concatenate([*points.values(), np.zeros((0, 3))]))
    for name, style in _STYLES.items():
        shape = getattr(scene, name)
        if shape is not None:
            _draw(axes, shape, points, name, style)
    numbered = "ours" if scene.ours is not None else "theirs"
    if len(points[numbered]) <= _NUMBERED:
        for i, place in enumerate(points[numbered]):
            if np.isfinite(place).all():
                flat = proj_transform(*_up(place), axes.get_proj())[:2]
                axes.annotate(str(i), flat, (6, 4), textcoords="offset points", fontsize=11,
                              color=_COLOURS["faint"])  # fmt: skip
    axes.plot(*_up(points["marks"]).T, "+", color=_COLOURS["ink"], markersize=11, clip_on=False)
    return Markup(_text(figure, title))


def _near(scene: Scene) -> dict[str, FloatArray]:
    """Return the points of each shape, NaN where they are far from the right answer."""
    shapes = {name: getattr(scene, name) for name in _STYLES}
    points = {name: np.zeros((0, 3)) if s is None else s.points for name, s in shapes.items()}
    points["marks"] = scene.marks
    right = np.concatenate([points["given"], points["ours"], points["marks"]])
    right = right[np.isfinite(right).all(axis=1)]
    if len(right):
        low, high = right.min(axis=0), right.max(axis=0)
        reach = _FAR * max(float((high - low).max()), 1e-9)
        away = ~(np.abs(points["theirs"] - (low + high) / 2.0).max(axis=1) <= reach)
        points["theirs"] = np.where(away[:, None], np.nan, points["theirs"])
    return points


def _up(points: FloatArray) -> FloatArray:
    """Return points with y upwards, as mass-spring systems and skeletons have it, for z."""
    return points[..., [0, 2, 1]] * [1.0, -1.0, 1.0]


def _set_box(axes: Any, points: FloatArray) -> None:
    """Fill the drawing with the points, each axis to the same scale."""
    seen = _up(points[np.isfinite(points).all(axis=1)])
    seen = seen if len(seen) else np.zeros((1, 3))
    low, high = seen.min(axis=0), seen.max(axis=0)
    sides = np.maximum(high - low, 0.2 * max(float((high - low).max()), 1e-9))
    middle = (low + high) / 2.0
    axes.set(**{f"{axis}lim": (m - s / 2, m + s / 2)
                for axis, m, s in zip("xyz", middle, sides, strict=True)})  # fmt: skip
    axes.set_box_aspect(sides, zoom=1.6)  # by itself it leaves wide margins
    axes.set_proj_type("ortho")
    axes.view_init(elev=18, azim=-65)
    axes.set_axis_off()


def _draw(
    axes: Any, shape: Shape, points: dict[str, FloatArray], name: str, style: dict[str, Any]
) -> None:
    places = _up(points[name])
    ends = places[np.asarray(shape.lines, dtype=int)]
    ends = ends[np.isfinite(ends).all(axis=(1, 2))]
    axes.add_collection3d(Line3DCollection(ends, gid=name, clip_on=False, **style), autolim=False)
    if name != "given":
        axes.plot(*places.T, "o", color=style["color"], markersize=4, clip_on=False)


def _text(figure: Figure, title: str) -> str:
    """Return a figure as SVG without size, in colours and the font of the page."""
    written = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": title}):
        figure.savefig(written, format="svg", transparent=True, metadata={"Date": None},
                       bbox_inches="tight", pad_inches=0.25)  # fmt: skip
    text = written.getvalue()
    box = re.search(r'viewBox="[^"]*"', text)
    for name, colour in _COLOURS.items():
        text = text.replace(colour, f"var(--{name})")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r" (font-family|font): [^;\"]*", " ", text)
    inside = text[text.index(">", text.index("<svg")) + 1 :]
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg {names} {box[0] if box else ""} role="img"><title>{escape(title)}</title>'
    return head + inside


def apart(scene: Scene) -> float | None:
    """Return the largest distance of points of theirs from ours, if there are as many [m]."""
    if scene.theirs is None or scene.ours is None:
        return None
    a, b = scene.theirs.points, scene.ours.points
    if a.shape != b.shape or not np.isfinite(a).all():
        return None
    return float(np.linalg.norm(a - b, axis=-1).max(initial=0.0))


def magnified(scene: Scene) -> tuple[Scene, float]:
    """Return a scene in which differences too small to be seen are larger, and how much."""
    distance = apart(scene)
    if not distance or scene.theirs is None or scene.ours is None:
        return scene, 1.0
    ours = scene.ours.points
    extent = float(np.ptp(ours, axis=0).max(initial=0.0))
    if distance >= _VISIBLE * extent:
        return scene, 1.0
    factor = float(f"{_MAGNIFIED * extent / distance:.0e}")
    theirs = Shape(ours + factor * (scene.theirs.points - ours), scene.theirs.lines)
    return scene._replace(theirs=theirs), factor
