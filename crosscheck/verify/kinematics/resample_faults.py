"""The points that faulty programs answer when they resample a polyline, by the keys of faults.

Each is the right rule with another step: the lengths of segments, the number of pieces, the places
along the line, or the point at such a place.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from .polylines import Polyline

PointsOf = Callable[[Case], FloatArray]
# What a program adds before it rounds down.
ROUNDING = 1e-9


def even_points(case: Case, extra: int = 0) -> FloatArray:
    """Return evenly spaced points, by default the right number of them."""
    return points_by(case, extra=extra)


def points_by(
    case: Case,
    *,
    extra: int = 0,
    norm: Callable[..., Any] = np.linalg.norm,
    pieces: Callable[[float], float] = np.ceil,
    interpolate: Callable[..., FloatArray] | None = None,
    places: Callable[..., FloatArray] | None = None,
    arcs: Callable[[FloatArray], FloatArray] = lambda lengths: np.append(0.0, np.cumsum(lengths)),
    kept_axes: Any = 1.0,
) -> FloatArray:
    """Return points at even places along a line, or those of other steps.

    `norm` measures segments, `pieces` makes whole pieces of length / spacing, `places` returns the
    places along the line, `interpolate` the points there, `arcs` the arc length of each point from
    the lengths of segments, and `kept_axes` is 0 for a lost axis.
    """
    points, is_closed = kept_axes * case.facts["line"].points, bool(case.inputs["closed"])
    arc = arcs(norm(np.diff(points, axis=0), axis=1))
    count = case.inputs.get("count")
    if count is None:
        count = max(1, int(pieces(arc[-1] / case.inputs["spacing"] - ROUNDING))) + (not is_closed)
    s = np.linspace(0.0, arc[-1], int(count) + extra, endpoint=not is_closed)
    if places is not None:
        s = places(s, arc[-1], case)
    return (interpolate or _linear)(s, arc, points)


def _linear(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    return np.stack([np.interp(s, arc, x) for x in points.T], axis=-1)


def _at_fraction(
    s: FloatArray,
    arc: FloatArray,
    points: FloatArray,
    fraction: Callable[..., Any],
    side: Any,
    first: int = 0,
) -> FloatArray:
    """Return points on segments, from the distance along a segment and its length.

    The length is that of the segment, or the arc length of its end if `side` is "end"; `first` is
    the first segment that is ever taken.
    """
    lengths = np.diff(arc)
    order: Any = "left" if side == "end" else side
    k = np.clip(np.searchsorted(arc, s, side=order) - (side != "left"), first, len(lengths) - 1)
    t = fraction(s - arc[k], np.maximum((arc[1:] if side == "end" else lengths)[k], 1e-12))
    return points[k] + np.asarray(t)[:, None] * (points[k + 1] - points[k])


def _smoothstep(along: FloatArray, length: FloatArray) -> FloatArray:
    t = along / length
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _segment_for_each(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    """Go on by a segment at most for each point."""
    k, last = 0, len(arc) - 2
    segments = [k := min(k + (arc[k + 1] < place), last) for place in s]
    t = (s - arc[segments]) / np.maximum(np.diff(arc)[segments], 1e-12)
    return np.asarray(points[segments] + t[:, None] * np.diff(points, axis=0)[segments])


def _of_other_line(case: Case, points: FloatArray) -> FloatArray:
    """Return even points of another polyline."""
    line = Polyline(points, (0,), bool(case.inputs["closed"]))
    return even_points(replace(case, facts={**case.facts, "line": line}))


def _with_axes(case: Case, axes: tuple[int, ...]) -> FloatArray:
    return even_points(case)[:, list(axes)]


def _steps_added_up(s: FloatArray, length: float, case: Case) -> FloatArray:
    """Return the places below the length of an open line, each a step after the one before."""
    if case.inputs["closed"] or len(s) < 2:
        return s
    places = np.cumsum(np.append(0.0, np.full(len(s), s[1])))
    return np.asarray(places[places < length])


def _first_stroke(case: Case) -> FloatArray:
    return case.inputs["curve"][: (*case.inputs["strokes"][1:], None)[0]]


def _catmull_rom(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    """Return points of the uniform Catmull-Rom spline, its end points repeated."""
    k = np.clip(np.searchsorted(arc, s, side="right") - 1, 0, len(arc) - 2)
    t = ((s - arc[k]) / np.maximum(np.diff(arc)[k], 1e-12))[:, None]
    a, b, c, d = (points[np.clip(k + i, 0, len(points) - 1)] for i in (-1, 0, 1, 2))
    cubic = (-a + 3.0 * b - 3.0 * c + d) * t + 2.0 * a - 5.0 * b + 4.0 * c - d
    return np.asarray(b + 0.5 * t * (c - a + t * cubic))


def _samples_before(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    last = np.searchsorted(arc, s, side="right") - 1
    return np.asarray(points[np.minimum(last, len(points) - 1)])


def _nearest_samples(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(points[np.argmin(np.abs(arc - s[:, None]), axis=1)])


def _by_index(s: FloatArray, arc: FloatArray, points: FloatArray) -> FloatArray:
    """Space points by the number of samples instead of the length along the curve."""
    return _linear(s / arc[-1] * (len(points) - 1), np.arange(float(len(points))), points)


def _rounded_index(
    s: FloatArray, arc: FloatArray, points: FloatArray, rule: Callable[..., Any], is_open: bool
) -> FloatArray:
    index = s / (s[-1] if is_open else arc[-1]) * (len(points) - 1)
    return np.asarray(points[rule(index).astype(int)])


def _steps_of_spacing(s: FloatArray, length: float, case: Case) -> FloatArray:
    return np.arange(0.0, length, case.inputs["spacing"]) if "spacing" in case.inputs else s


def _step_of(case: Case, is_exact: bool) -> float:
    """Return the gap between two points: that of even ones, or exactly the requested spacing."""
    line, is_closed = case.facts["line"], case.inputs["closed"]
    if is_exact and "spacing" in case.inputs:
        return float(case.inputs["spacing"])
    count = case.inputs.get("count") or line.count(case.inputs["spacing"], is_closed)
    return float(line.length / max(1, count - (not is_closed)))


def _segment_by_segment(case: Case, is_exact: bool, has_end: bool, extra: int) -> FloatArray:
    """Begin anew at each sample, so that what remains of a segment is lost."""
    line, step = case.facts["line"], _step_of(case, is_exact)
    places = [
        start + step * np.arange(int(length / step) + extra)
        for start, length in zip(line.arc[:-1], line.lengths, strict=True)
    ]
    points = np.concatenate([line.point_at(np.concatenate(places)), line.points[-1:]])
    return np.asarray(points if has_end else points[:-1])


def _steps_by_chords(case: Case, is_exact: bool) -> FloatArray:
    """Step straight towards the next sample that is at least a step away."""
    return np.array(list(_chords(case.facts["line"].points, _step_of(case, is_exact), case)))


def _chords(points: FloatArray, step: float, case: Case) -> Iterator[FloatArray]:
    count = case.inputs.get("count") or len(points) + int(case.facts["line"].length / step)
    place, k = points[0], 1
    for _ in range(count):
        yield place
        while k < len(points) and np.linalg.norm(points[k] - place) < step:
            k += 1
        if k == len(points):
            return
        direction = points[k] - place
        place = place + step / np.linalg.norm(direction) * direction


def _left_open(case: Case, keeps_count: bool) -> FloatArray:
    line = Polyline(case.inputs["curve"], case.facts["line"].strokes, False)
    measured = case.facts["line"] if keeps_count else line
    is_closed = keeps_count and case.inputs["closed"]
    count = case.inputs.get("count") or measured.count(case.inputs["spacing"], is_closed)
    return line.even_points(int(count), False)


def _fraction(fraction: Callable[..., Any], side: str = "right", first: int = 0) -> PointsOf:
    rule = partial(_at_fraction, fraction=fraction, side=side, first=first)
    return partial(points_by, interpolate=rule)


def _places(places: Callable[..., FloatArray]) -> PointsOf:
    return partial(points_by, places=places)


# The points that programs with each fault answer, one function for each way of writing it.
FAULTS: Mapping[str, tuple[PointsOf, ...]] = {
    "by index": (partial(points_by, interpolate=_by_index),),
    "end left out": (_places(lambda s, length, case: np.linspace(0, length, len(s), False)),),
    "one point less": (partial(even_points, extra=-1),),
    "one point more": (partial(even_points, extra=1),),
    "left open": (partial(_left_open, keeps_count=True), partial(_left_open, keeps_count=False)),
    "reversed": (lambda case: even_points(case)[::-1],),
    "samples only": (partial(points_by, interpolate=_samples_before),),
    "pieces rounded down": (partial(points_by, pieces=lambda x: x + 2.0 * ROUNDING),),
    "pieces rounded": (partial(points_by, pieces=lambda x: round(x + ROUNDING)),),
    "steps of the spacing": (_places(_steps_of_spacing),),
    "start again at the end": (_places(lambda s, length, case: np.linspace(0, length, len(s))),),
    "both ends left out": (
        _places(lambda s, length, case: np.linspace(0, length, len(s) + 2)[1:-1]),
    ),
    "shifted by half a gap": (_places(lambda s, length, case: s + 0.5 * s[1:2].sum()),),
    "index rounded": tuple(
        partial(points_by, interpolate=partial(_rounded_index, rule=rule, is_open=is_open))
        for is_open in (True, False)
        for rule in (np.round, np.floor)
    ),
    "nearest sample": (partial(points_by, interpolate=_nearest_samples),),
    "lengths squared": (partial(points_by, norm=lambda d, axis: (d * d).sum(axis)),),
    "lengths in the plane": tuple(
        partial(points_by, norm=lambda d, axis, kept=kept: np.linalg.norm(d * kept, axis=axis))
        for kept in ([1.0, 1.0, 0.0], [1.0, 0.0, 1.0])
    ),
    "lengths of coordinates": (partial(points_by, norm=lambda d, axis: np.abs(d).sum(axis)),),
    "distance for the fraction": (_fraction(lambda along, length: along),),
    "segment after the place": (_fraction(np.divide, "left"), _fraction(np.divide, "left", 1)),
    "fraction of the arc length": (_fraction(np.divide, "end"),),
    "segment for each point": (partial(points_by, interpolate=_segment_for_each),),
    "arc length without its zero": (
        partial(points_by, arcs=lambda d: np.cumsum(np.append(d, d[-1]))),
        partial(points_by, arcs=lambda d: np.cumsum(np.append(d[0], d))),
    ),
    "first stroke only": (lambda case: _of_other_line(case, _first_stroke(case)),),
    "points sorted": (lambda case: _of_other_line(case, np.unique(case.inputs["curve"], axis=0)),),
    "coordinates exchanged": tuple(
        partial(_with_axes, axes=axes) for axes in product(range(3), repeat=3) if axes != (0, 1, 2)
    ),
    "steps added up": (_places(_steps_added_up),),
    "fraction smoothed": (_fraction(_smoothstep),),
    "spline for the polyline": (partial(points_by, interpolate=_catmull_rom),),
    "segment by segment": tuple(
        partial(_segment_by_segment, is_exact=is_exact, has_end=has_end, extra=extra)
        for is_exact, has_end, extra in product((False, True), (True, False), (0, 1))
    ),
    "steps by chords": tuple(
        partial(_steps_by_chords, is_exact=is_exact) for is_exact in (False, True)
    ),
    "coordinate dropped": tuple(
        function
        for kept in ([1.0, 1.0, 0.0], [1.0, 0.0, 1.0])
        for function in (
            lambda case, kept=kept: even_points(case) * kept,
            partial(points_by, kept_axes=np.array(kept)),
        )
    ),
}
