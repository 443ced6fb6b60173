"""Named curves for an effector to draw, and resampling to an even spacing.

A named curve takes a count of samples; a count that is no positive integer is a ValueError. All
curves lie in the plane y = 0 [m]; closed curves do not repeat their first point.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from . import arguments
from .arguments import FloatArray
from .backend.compiled import Kernel
from .quaternion import load_vector, norm, subtract

# A finer curve would not fit into memory.
MAX_POINTS = 10_000_000


def circle(count: int = 150) -> FloatArray:
    """Return samples of a circle of radius 0.6, shape (frame, 3) [m]."""
    t = _angles(count)
    return _in_plane(0.6 * np.cos(t), 0.6 * np.sin(t))


def square(count: int = 150) -> FloatArray:
    """Return samples of a square of side 0.4 about the origin, shape (frame, 3) [m]."""
    return _polygon([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)], count)


def heart(count: int = 150) -> FloatArray:
    """Return samples of the cardioid r = 0.5 (1 - sin t), shape (frame, 3) [m]."""
    t = _angles(count)
    r = 0.5 * (1.0 - np.sin(t))
    return _in_plane(r * np.cos(t), r * np.sin(t))


def triangle(count: int = 150) -> FloatArray:
    """Return samples of the triangle (0, 0, 0), (0.5, 0, 0), (0, 0, 0.5), shape (frame, 3) [m]."""
    return _polygon([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5)], count)


def star(count: int = 400) -> FloatArray:
    """Return samples of the pentagram of radius 0.4, which joins every second of five points."""
    t = 4.0 * np.pi * np.arange(5) / 5.0
    return _polygon(0.4 * np.column_stack([np.cos(t), np.sin(t)]), count)


def plumb_bob(count: int = 1200) -> FloatArray:
    """Return unevenly spaced samples of a drawing of a plumb bob, shape (frame, 3) [m].

    The drawing has five strokes: line, eye, collar, body and plumb mark. Within a stroke the arc
    length is s = u + sin(2 pi n u) / (2 pi n) for evenly spaced u. Samples are dense in some parts
    and sparse in others, as in hand-drawn input.
    """
    count = arguments.count("count", count, minimum=1)
    parts = np.array_split(np.arange(count), len(_BOB_STROKES))
    return np.concatenate(
        [stroke(_uneven(len(part))) for stroke, part in zip(_BOB_STROKES, parts, strict=True)]
    )


curves: dict[str, Callable[..., FloatArray]] = {
    curve.__name__: curve for curve in (circle, square, heart, triangle, star, plumb_bob)
}


def resample(
    curve: ArrayLike, *, min_spacing: float, max_spacing: float, closed: bool = False
) -> FloatArray:
    """Return the curve with distances between neighbours from min_spacing to max_spacing.

    Drop points too close to the last kept point, divide wide gaps evenly, and keep both ends. If
    the ends are closer than min_spacing to each other, and no point of the curve is min_spacing
    away from both, only the ends remain.

    Args:
        curve: points, shape (point, 3) [m].
        min_spacing: the least distance of neighbours [m].
        max_spacing: the greatest distance, at least twice min_spacing to keep divided gaps long.
        closed: whether the last point is a neighbour of the first.

    Raises:
        ValueError: if there are no points, a point is not finite, or the spacings are not positive,
            too near to each other, or so small as to give more than ten million points.
    """
    points = arguments.array("curve", curve, "point", 3)
    closed = arguments.boolean("closed", closed)
    min_spacing = arguments.number("min_spacing", min_spacing, above=0.0)
    max_spacing = arguments.number("max_spacing", max_spacing, minimum=2.0 * min_spacing)
    if len(points) == 0:
        raise ValueError("curve: expected at least one point, got none")
    if closed:
        points = np.concatenate([points, points[:1]])
    selection = np.empty(len(points), dtype=np.int64)
    points = points[selection[: _select(points, min_spacing, selection)]]
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    if (gaps / max_spacing).sum() > MAX_POINTS:
        raise ValueError(
            f"max_spacing: expected one for at most {MAX_POINTS:,} points, got {max_spacing:g}"
        )
    spaced = _divide_gaps(points, gaps, max_spacing)
    return spaced[:-1] if closed else spaced


def select_spaced(points, min_spacing, selection):
    """Store the indices of both ends and of points min_spacing apart; return their count.

    Choose points greedily, then drop the last points too close to the end of the curve. If none
    remains between the ends, take a point far enough from both.
    """
    last = len(points) - 1
    count = 1
    selection[0] = 0
    for i in range(1, last):
        if spacing(points, selection[count - 1], i) >= min_spacing:
            selection[count] = i
            count += 1
    while count > 1 and spacing(points, selection[count - 1], last) < min_spacing:
        count -= 1
    if count == 1 and spacing(points, 0, last) < min_spacing:
        for i in range(last - 1, 0, -1):
            distance = min(spacing(points, 0, i), spacing(points, i, last))
            if distance >= min_spacing and count == 1:
                selection[count] = i
                count += 1
    if last > 0:
        selection[count] = last
        count += 1
    return count


def spacing(points, i, j):
    """Return the distance between points i and j."""
    return norm(subtract(load_vector(points, i), load_vector(points, j)))


_select = Kernel(select_spaced)


def _divide_gaps(points: FloatArray, gaps: FloatArray, max_spacing: float) -> FloatArray:
    """Return the points, with evenly spaced points in gaps wider than max_spacing."""
    if len(points) == 1:
        return points
    pieces = np.maximum(np.ceil(gaps / max_spacing), 1).astype(np.int64)
    starts = np.repeat(np.arange(len(gaps)), pieces)
    first = np.cumsum(pieces) - pieces
    fraction = (np.arange(pieces.sum()) - first[starts]) / pieces[starts]
    between = points[starts] + fraction[:, None] * np.diff(points, axis=0)[starts]
    return np.concatenate([between, points[-1:]])


def _angles(count: int) -> FloatArray:
    return 2.0 * np.pi * np.arange(arguments.count("count", count, minimum=1)) / count


def _in_plane(x: ArrayLike, z: ArrayLike) -> FloatArray:
    return np.column_stack([x, np.zeros(np.shape(x)), z])


def _polygon(corners: ArrayLike, count: int) -> FloatArray:
    """Return samples, evenly spaced along the closed polygon of corners (corner, 2)."""
    count = arguments.count("count", count, minimum=1)
    closed = np.concatenate([corners, np.asarray(corners)[:1]])
    return _stroke(closed)(np.arange(count) / count)


def _stroke(corners: ArrayLike) -> Callable[[FloatArray], FloatArray]:
    """Return the polyline of corners (corner, 2) as a function of the fraction of its length."""
    x, z = np.asarray(corners, dtype=np.float64).T
    arc_length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])

    def points(s: FloatArray) -> FloatArray:
        length = s * arc_length[-1]
        return _in_plane(np.interp(length, arc_length, x), np.interp(length, arc_length, z))

    return points


def _uneven(count: int) -> FloatArray:
    """Return fractions from 0 to 1, dense at three points and sparse in between."""
    u = np.linspace(0.0, 1.0, count)
    return u + np.sin(6.0 * np.pi * u) / (6.0 * np.pi)


def _body(u: FloatArray) -> FloatArray:
    """Return the outline of the body, pointed below and round above."""
    t = 2.0 * np.pi * u
    return _in_plane(0.28 * np.sin(t) * (0.5 - 0.5 * np.cos(t)) ** 0.5, -0.05 - 0.4 * np.cos(t))


def _eye(u: FloatArray) -> FloatArray:
    """Return the ring that the line is tied to."""
    t = 2.0 * np.pi * u
    return _in_plane(0.06 * np.sin(t), 0.51 + 0.06 * np.cos(t))


_BOB_STROKES = (
    _stroke([(0.0, 0.9), (0.0, 0.57)]),
    _eye,
    _stroke([(-0.1, 0.45), (0.1, 0.45), (0.1, 0.35), (-0.1, 0.35), (-0.1, 0.45)]),
    _body,
    _stroke([(-0.25, -0.55), (0.25, -0.55)]),
)
