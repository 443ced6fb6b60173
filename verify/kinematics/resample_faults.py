"""The points that faulty programs answer when they resample a polyline, by the keys of faults.

Each is the right rule with other formulas, from the `models` of its fault: of the lengths of
segments, the number of pieces, the places along the line, or the points at such places.
"""

from collections.abc import Mapping, Sequence
from functools import partial

from .faults import TABLE
from .resampling import PointsOf, points_by

# The right rule as programs write it: with an interpolation that keeps to the ends of the line, and
# with open curves that end at their last sample, whatever is computed.
IMPLEMENTATIONS: Sequence[Mapping[str, str]] = (
    {},
    {"even": "np.stack([np.interp(s, arc, axis) for axis in points.T], axis=1)"},
    {"result": "even if closed else np.concatenate([even[:-1], points[-1:]])"},
)
OF_EVEN = {"k", "width", "t", "a", "b", "even"}
# The points that programs with each fault answer, one function for each implementation.
FAULTS: Mapping[str, tuple[PointsOf, ...]] = {
    key: tuple(
        partial(points_by, {**implementation, **model})
        for implementation in IMPLEMENTATIONS
        for model in entry["models"]
        if not model.keys() & (OF_EVEN if "even" in implementation else implementation.keys())
    )
    for key, entry in TABLE["resample"].items()
}
