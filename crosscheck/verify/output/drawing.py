"""A failing case as SVG: theirs dashed, ours solid, seen along the direction that hides least."""

import xml.etree.ElementTree as ElementTree

import numpy as np
from markupsafe import Markup

from .geometry import FloatArray, Scene, Shape

WIDTH, HEIGHT, MARGIN = 640.0, 400.0, 28.0
# Of what lies along the line of sight, so much is seen to the side and upwards.
_OBLIQUE = np.array([0.35, 0.45])
# Differences below the first part of the drawing are magnified to about the second.
_VISIBLE, _MAGNIFIED = 0.02, 0.2
# So few points are numbered.
_NUMBERED = 12
# Points further from the middle than so many extents of the right answer are left out.
_FAR = 3.0
STYLES = {
    "given": {"stroke": "var(--rule)", "stroke-width": "1.5"},
    "ours": {"stroke": "var(--blue)", "stroke-width": "4", "stroke-opacity": "0.55"},
    "theirs": {"stroke": "var(--orange)", "stroke-width": "1.8", "stroke-dasharray": "6 3"},
}


def svg(scene: Scene, title: str) -> Markup:
    """Return a drawing in the colours of the page."""
    root = ElementTree.Element("svg", viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}", role="img")
    ElementTree.SubElement(root, "title").text = title
    project = _projection(scene)
    for name, style in STYLES.items():
        shape = getattr(scene, name)
        if shape is not None:
            _draw(root, project(shape.points), shape, style, name)
    numbered = scene.ours or scene.theirs
    if numbered is not None and len(numbered.points) <= _NUMBERED:
        _number(root, project(numbered.points))
    for x, y in _seen(project(scene.marks)):
        cross = f"M{x - 7:.1f} {y:.1f}h14M{x:.1f} {y - 7:.1f}v14"
        ElementTree.SubElement(root, "path", {"d": cross, "stroke": "var(--ink)", "fill": "none"})
    return Markup(ElementTree.tostring(root, encoding="unicode"))


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
    extent = float(np.ptp(scene.ours.points, axis=0).max(initial=0.0))
    if distance >= _VISIBLE * extent:
        return scene, 1.0
    factor = float(f"{_MAGNIFIED * extent / distance:.0e}")
    ours = scene.ours.points
    theirs = Shape(ours + factor * (scene.theirs.points - ours), scene.theirs.lines)
    return scene._replace(theirs=theirs), factor


class _Projection:
    """Puts points of space on the page: along their widest axes, the third one obliquely."""

    def __init__(self, points: FloatArray) -> None:
        self.middle = (points.max(axis=0) + points.min(axis=0)) / 2.0
        axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
        *flat_axes, depth = _upright(axes)
        across, up = sorted(flat_axes, key=lambda axis: abs(axis[1]))
        self.axes = np.stack([across, up]) + np.outer(_OBLIQUE, depth)
        flat = (points - self.middle) @ self.axes.T
        self.centre = (flat.max(axis=0) + flat.min(axis=0)) / 2.0
        extent = np.maximum(np.ptp(flat, axis=0), 1e-12)
        room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
        self.scale = float((room / extent).min())

    def __call__(self, points: FloatArray) -> FloatArray:
        flat = ((points - self.middle) @ self.axes.T - self.centre) * self.scale
        return np.array([WIDTH / 2.0, HEIGHT / 2.0]) + flat * [1.0, -1.0]


def _upright(axes: FloatArray) -> list[FloatArray]:
    """Return axes that point upwards, to the right, or towards the reader."""
    return [axis if (axis[1], axis[0], axis[2]) >= (0.0, 0.0, 0.0) else -axis for axis in axes]


def _projection(scene: Scene) -> _Projection:
    """Return a view that holds the right answer, and of theirs what is not far off."""
    shapes = [s.points for s in (scene.ours, scene.given) if s is not None]
    right = _finite(np.concatenate([*shapes, scene.marks]))
    theirs = _finite(scene.theirs.points) if scene.theirs is not None else right[:0]
    if len(right):
        middle = (right.max(axis=0) + right.min(axis=0)) / 2.0
        extent = max(float(np.ptp(right, axis=0).max()), 1e-9)
        theirs = theirs[np.abs(theirs - middle).max(axis=-1) <= _FAR * extent]
    points = np.concatenate([right, theirs])
    if len(points) < 3:  # an axis for each dimension
        points = np.concatenate([points, np.zeros((3, 3))])
    return _Projection(points)


def _finite(points: FloatArray) -> FloatArray:
    return points[np.isfinite(points).all(axis=-1)]


def _seen(flat: FloatArray) -> FloatArray:
    """Return points that lie near the page."""
    with np.errstate(invalid="ignore"):
        return flat[(np.abs(flat) < 10.0 * WIDTH).all(axis=-1)]


def _draw(
    root: ElementTree.Element, flat: FloatArray, shape: Shape, style: dict[str, str], name: str
) -> None:
    group = ElementTree.SubElement(
        root, "g", {"class": name, "fill": "none", "stroke-linecap": "round", **style}
    )
    ends = flat[np.asarray(shape.lines, dtype=int)].reshape(-1, 4)
    path = "".join(f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for a, b, c, d in _seen(ends))
    ElementTree.SubElement(group, "path", d=path)
    if name == "given":
        return
    for x, y in _seen(flat):
        ElementTree.SubElement(
            group, "circle",
            {"cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": "3", "fill": style["stroke"],
             "stroke": "none"},
        )  # fmt: skip


def _number(root: ElementTree.Element, flat: FloatArray) -> None:
    for i, (x, y) in enumerate(flat):
        if np.isfinite([x, y]).all():
            text = ElementTree.SubElement(
                root, "text", {"x": f"{x + 7:.1f}", "y": f"{y - 6:.1f}", "fill": "var(--faint)",
                               "font-size": "12"},
            )  # fmt: skip
            text.text = str(i)
