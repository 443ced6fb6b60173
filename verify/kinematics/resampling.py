"""Points along a polyline by the right rule, or by one with other formulas."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..formulas import value_of

PointsOf = Callable[[Case], FloatArray]


# The right rule, in the order of the computation: of the curve, its strokes' first points, and
# whether it is closed; by count or, if that is None, by spacing.
FORMULAS: Mapping[str, str] = {
    "line": "curve",
    "points": "np.concatenate([line, line[:1]]) if closed else line",
    "measured": "points",
    "gaps": "np.linalg.norm(np.diff(measured, axis=0), axis=1)",
    "arc": "np.append(0.0, np.cumsum(gaps))",
    "length": "arc[-1]",
    "pieces": "np.ceil(length / spacing - 1e-9)",
    "n": "count or max(1, int(pieces)) + (not closed)",
    "step": "length / max(1, n - (not closed))",
    "s": "np.linspace(0.0, length, n, endpoint=not closed)",
    "k": "np.searchsorted(arc, s, 'right') - 1",  # the segment of each place
    "k_valid": "np.clip(k, 0, len(gaps) - 1).astype(int)",
    "width": "gaps[k_valid]",
    "t": "(s - arc[k_valid]) / np.where(width > 0.0, width, 1.0)",
    "a": "points[k_valid]",
    "b": "points[k_valid + 1]",
    "even": "a + t[:, None] * (b - a)",
    "result": "even",
}


def points_by(model: Mapping[str, str], case: Case) -> FloatArray:
    """Return the points of the rule with some formulas changed."""
    names = ("curve", "strokes", "count")
    values: dict[str, Any] = {name: case.inputs.get(name) for name in names}
    values |= {"spacing": case.inputs.get("spacing", np.inf), "closed": bool(case.inputs["closed"])}
    values |= {"np": np, "accumulate": accumulate, "by_chords": _by_chords}
    for name, formula in FORMULAS.items():
        values[name] = value_of(model.get(name, formula), values)
    return np.asarray(values["result"])


def _by_chords(points: FloatArray, step: float, count: int) -> FloatArray:
    """Step straight towards the next sample that is at least a step away."""
    return np.array(list(_chords(points, step, count)))


def _chords(points: FloatArray, step: float, count: int) -> Iterator[FloatArray]:
    place, k = points[0], 1
    for _ in range(count):
        yield place
        while k < len(points) and np.linalg.norm(points[k] - place) < step:
            k += 1
        if k == len(points):
            return
        direction = points[k] - place
        place = place + step / np.linalg.norm(direction) * direction


even_points: PointsOf = partial(points_by, {})
