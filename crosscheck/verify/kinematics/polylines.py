"""Polylines in strokes, measured along their length, and the even points on them."""

import numpy as np

from plumbob.reference.arguments import FloatArray


class Line:
    """A polyline whose strokes are joined by bridges; a closed one returns to its start.

    Attributes:
        points: of all strokes, and the first again if it is closed [m].
        strokes: where each stroke begins.
        at: length from the start to each point, bridges counted [m].
        bridges: which segments are bridges.
    """

    def __init__(self, curve: FloatArray, strokes: tuple[int, ...], closed: bool) -> None:
        self.points = np.concatenate([curve, curve[:1]]) if closed else curve
        self.strokes = strokes
        self.lengths = np.linalg.norm(np.diff(self.points, axis=0), axis=-1)
        self.at = np.concatenate([[0.0], np.cumsum(self.lengths)])
        self.bridges = np.isin(np.arange(1, len(self.points)), strokes)

    @property
    def length(self) -> float:
        """The whole length [m]."""
        return float(self.at[-1])

    def nearest(self, point: FloatArray, bridged: bool) -> tuple[float, float]:
        """Return the distance to the line, and where along it the nearest place is [m]."""
        distance, along = self._to_segments(point)
        distance = np.where(self.bridges & (not bridged), np.inf, distance)
        k = int(np.argmin(distance))
        return float(distance[k]), float(along[k])

    def _to_segments(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        distance, share = _to_chords(self.points[:-1], self.points[1:], point)
        return distance, self.at[:-1] + share * self.lengths

    def is_on_chord(self, point: FloatArray, bound: float) -> bool:
        """Return whether a point lies between two of the line's points, a corner cut off."""
        i, j = np.triu_indices(len(self.points), 1)
        distance, _ = _to_chords(self.points[i], self.points[j], point)
        return bool(distance.min(initial=np.inf) <= bound)

    def parameters(self, points: FloatArray, bound: float) -> FloatArray:
        """Return where along the line points are, each as soon as possible after the one before.

        Where a line crosses itself a point is in several places. The last point of a closed line
        may be its first one again.
        """
        parameters, before = np.empty(len(points)), 0.0
        for i, point in enumerate(points):
            distance, along = self._to_segments(point)
            places = along[distance <= 2.0 * bound]
            later = places[places >= before - 4.0 * bound]
            parameters[i] = later.min() if len(later) else places.max(initial=0.0)
            before = parameters[i]
        return parameters

    def without_bridges(self, at: FloatArray) -> FloatArray:
        """Return lengths along the line that do not count its bridges [m]."""
        drawn = np.concatenate([[0.0], np.cumsum(np.where(self.bridges, 0.0, self.lengths))])
        return np.interp(at, self.at, drawn)

    def point_at(self, at: FloatArray) -> FloatArray:
        """Return the points at lengths along the line [m]."""
        return np.stack([np.interp(at, self.at, self.points[:, k]) for k in range(3)], axis=-1)


def _to_chords(
    start: FloatArray, end: FloatArray, point: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the distances from a point to chords, and at what share of each it is nearest."""
    step = end - start
    square = np.maximum((step * step).sum(-1), 1e-300)
    share = np.clip(((point - start) * step).sum(-1) / square, 0.0, 1.0)
    return np.linalg.norm(start + share[:, None] * step - point, axis=-1), share


def even_by_count(line: Line, count: int, closed: bool) -> FloatArray:
    """Return so many points, evenly spaced along the line, bridges counted."""
    return line.point_at(np.linspace(0.0, line.length, count, endpoint=not closed))


def even_by_spacing(line: Line, spacing: float, closed: bool) -> FloatArray:
    """Return evenly spaced points no farther apart than a spacing."""
    pieces = max(1, int(np.ceil(line.length / spacing - 1e-9)))
    return even_by_count(line, pieces if closed else pieces + 1, closed)
