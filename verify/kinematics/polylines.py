"""Polylines in strokes, measured along their length, and evenly spaced points on them."""

import numpy as np

from plumbob.reference.arguments import FloatArray


class Polyline:
    """A polyline whose strokes are joined by bridges; a closed one returns to its start."""

    def __init__(self, curve: FloatArray, strokes: tuple[int, ...], closed: bool) -> None:
        self.points = np.concatenate([curve, curve[:1]]) if closed else curve
        self.strokes = strokes
        self.lengths = np.linalg.norm(np.diff(self.points, axis=0), axis=-1)
        self.arc = np.concatenate([[0.0], np.cumsum(self.lengths)])
        self.length = float(self.arc[-1])
        self.bridges = np.isin(np.arange(1, len(self.points)), strokes)

    def distance(self, point: FloatArray) -> float:
        """Return the distance of a point from the line and its bridges [m]."""
        return float(_to_chords(self.points[:-1], self.points[1:], point)[0].min())

    def is_on_chord(self, point: FloatArray, bound: float) -> bool:
        """Return whether a point lies between any two points of the line, a corner cut off."""
        i, j = np.triu_indices(len(self.points), 1)
        distance, _ = _to_chords(self.points[i], self.points[j], point)
        return bool(distance.min(initial=np.inf) <= bound)

    def arc_lengths(self, points: FloatArray, bound: float) -> FloatArray:
        """Return the arc length of each point, the least one not before the previous point's [m].

        A line that crosses itself passes a point several times. The last point of a closed line
        may be its first one again.
        """
        arc, before = np.empty(len(points)), 0.0
        for i, point in enumerate(points):
            distance, share = _to_chords(self.points[:-1], self.points[1:], point)
            candidates = (self.arc[:-1] + share * self.lengths)[distance <= 2.0 * bound]
            later = candidates[candidates >= before - 4.0 * bound]
            arc[i] = before = later.min() if len(later) else candidates.max(initial=0.0)
        return arc

    def without_bridges(self, arc: FloatArray) -> FloatArray:
        """Return arc lengths from which bridges are left out [m]."""
        drawn = np.concatenate([[0.0], np.cumsum(np.where(self.bridges, 0.0, self.lengths))])
        return np.interp(arc, self.arc, drawn)

    def even_points(self, count: int, closed: bool) -> FloatArray:
        """Return evenly spaced points along the line and its bridges."""
        return self.point_at(np.linspace(0.0, self.length, count, endpoint=not closed))

    def point_at(self, arc: FloatArray) -> FloatArray:
        """Return the points at arc lengths [m]."""
        return np.stack([np.interp(arc, self.arc, x) for x in self.points.T], axis=-1)

    def count(self, spacing: float, closed: bool) -> int:
        """Return the number of evenly spaced points that are no farther apart than a spacing."""
        pieces = max(1, int(np.ceil(self.length / spacing - 1e-9)))
        return pieces if closed else pieces + 1


def _to_chords(
    start: FloatArray, end: FloatArray, point: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the distances of a point from chords, and the share of each chord before it."""
    step = end - start
    square = np.maximum((step * step).sum(-1), 1e-300)
    share = np.clip(((point - start) * step).sum(-1) / square, 0.0, 1.0)
    return np.linalg.norm(start + share[:, None] * step - point, axis=-1), share
