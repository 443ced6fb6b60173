"""A failing case drawn in space as SVG: the answer dashed, the expected answer solid."""

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

from plumbob.reference.arguments import FloatArray

from ..observe.spring_law import SpringLaw
from .comparison import CaseDrawing, Wireframe

# Differences below the first share of the extent are magnified to about the second.
_VISIBLE, _MAGNIFIED = 0.02, 0.2
# Smaller shares stay: the rounding of single precision may cause such differences.
_ROUNDING = 1e-6
# Points are numbered if there are no more than this.
_NUMBERED = 12
# Points farther from the middle than so many extents of the right answer are left out.
_FARTHEST = 3.0
# Placeholders of the page's colours, which differ in dark mode.
_COLOURS = {"rule": "#010101", "blue": "#020202", "orange": "#030303", "ink": "#040404",
            "faint": "#050505"}  # fmt: skip
_STYLES: dict[str, dict[str, Any]] = {
    "request": {"color": _COLOURS["rule"], "linewidth": 1.2},
    "expected": {"color": _COLOURS["blue"], "linewidth": 3.0, "alpha": 0.55},
    "answer": {"color": _COLOURS["orange"], "linewidth": 1.4, "linestyle": (0, (4, 2))},
}


def svg(drawing: CaseDrawing, title: str) -> Markup:
    """Return a drawing in the colours of the page."""
    points = _visible_points(drawing)
    figure = Figure(figsize=(6.4, 4.8))
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection="3d", facecolor="none")
    _set_box(axes, np.concatenate([*points.values(), np.zeros((0, 3))]))
    for name, style in _STYLES.items():
        shape = getattr(drawing, name)
        if shape is not None:
            places = _upright(points[name])
            ends = places[np.asarray(shape.lines, dtype=int)]
            ends = ends[np.isfinite(ends).all(axis=(1, 2))]
            lines = Line3DCollection(ends, gid=name, clip_on=False, **style)
            axes.add_collection3d(lines, autolim=False)
            if name != "request":
                axes.plot(*places.T, "o", color=style["color"], markersize=4, clip_on=False)
    numbered = points["answer" if drawing.expected is None else "expected"]
    for i, place in enumerate(numbered if len(numbered) <= _NUMBERED else ()):
        if np.isfinite(place).all():
            flat = proj_transform(*_upright(place), axes.get_proj())[:2]
            axes.annotate(str(i), flat, (6, 4), textcoords="offset points", fontsize=11,
                          color=_COLOURS["faint"])  # fmt: skip
    marks = _upright(points["marks"])
    axes.plot(*marks.T, "+", color=_COLOURS["ink"], markersize=11, clip_on=False)
    return Markup(_to_text(figure, title))


def law_svg(law: SpringLaw, title: str) -> Markup:
    """Return what springs pull or store at each length as points, beside the linear law's line."""
    figure = Figure(figsize=(6.4, 3.2))
    axes: Any = figure.add_subplot(facecolor="none")
    axes.plot(law.stretches, law.linear, color=_COLOURS["blue"], linewidth=3.0, alpha=0.55)
    axes.plot(law.stretches, law.measured, "o", color=_COLOURS["orange"], markersize=4)
    axes.set_xlabel("l/r", color=_COLOURS["ink"])
    axes.tick_params(colors=_COLOURS["faint"])
    for spine in axes.spines.values():
        spine.set_color(_COLOURS["rule"])
    return Markup(_to_text(figure, title))


def _visible_points(drawing: CaseDrawing) -> dict[str, FloatArray]:
    """Return the points of each shape, NaN far from the right answer."""
    shapes = {name: getattr(drawing, name) for name in _STYLES}
    points = {name: np.zeros((0, 3)) if s is None else s.points for name, s in shapes.items()}
    points["marks"] = drawing.marks
    right = np.concatenate([points["request"], points["expected"], points["marks"]])
    right = right[np.isfinite(right).all(axis=1)]
    if len(right):
        low, high = right.min(axis=0), right.max(axis=0)
        reach = _FARTHEST * max(float((high - low).max()), 1e-9)
        is_near = np.abs(points["answer"] - (low + high) / 2.0).max(axis=1) <= reach
        points["answer"] = np.where(is_near[:, None], points["answer"], np.nan)
    return points


def _upright(points: FloatArray) -> FloatArray:
    """Return points with the y axis, which is vertical in mass-spring systems, as z."""
    return points[..., [0, 2, 1]] * [1.0, -1.0, 1.0]


def _set_box(axes: Any, points: FloatArray) -> None:
    """Fill the drawing with the points, each axis to the same scale."""
    finite = _upright(points[np.isfinite(points).all(axis=1)])
    finite = finite if len(finite) else np.zeros((1, 3))
    low, high = finite.min(axis=0), finite.max(axis=0)
    sides = np.maximum(high - low, 0.2 * max(float((high - low).max()), 1e-9))
    middle = (low + high) / 2.0
    axes.set(**{f"{axis}lim": (m - s / 2, m + s / 2)
                for axis, m, s in zip("xyz", middle, sides, strict=True)})  # fmt: skip
    axes.set_box_aspect(sides, zoom=1.6)  # by itself it leaves wide margins
    axes.set_proj_type("ortho")
    axes.view_init(elev=18, azim=-65)
    axes.set_axis_off()


def _to_text(figure: Figure, title: str) -> str:
    """Return a figure as SVG without size, in colours and the font of the page."""
    file = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": title}):
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None},
                       bbox_inches="tight", pad_inches=0.25)  # fmt: skip
    text = file.getvalue()
    box = re.search(r'viewBox="[^"]*"', text)
    for name, colour in _COLOURS.items():
        text = text.replace(colour, f"var(--{name})")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r" (font-family|font): [^;\"]*", " ", text)
    inside = text[text.index(">", text.index("<svg")) + 1 :]
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg {names} {box[0] if box else ""} role="img"><title>{escape(title)}</title>'
    return head + inside


def distance(drawing: CaseDrawing) -> float | None:
    """Return the largest distance of an answered point from the expected point [m], if known."""
    if drawing.answer is None or drawing.expected is None:
        return None
    a, b = drawing.answer.points, drawing.expected.points
    if a.shape != b.shape or not np.isfinite(a).all():
        return None
    return float(np.linalg.norm(a - b, axis=-1).max(initial=0.0))


def magnified(drawing: CaseDrawing) -> tuple[CaseDrawing, float]:
    """Return a drawing in which small differences are larger, and the factor."""
    gap = distance(drawing)
    if not gap or drawing.answer is None or drawing.expected is None:
        return drawing, 1.0
    expected = drawing.expected.points
    extent = float(np.ptp(expected, axis=0).max(initial=0.0))
    if gap >= _VISIBLE * extent or gap < _ROUNDING * extent:
        return drawing, 1.0
    factor = float(f"{_MAGNIFIED * extent / gap:.0e}")
    points = expected + factor * (drawing.answer.points - expected)
    return drawing._replace(answer=Wireframe(points, drawing.answer.lines)), factor
