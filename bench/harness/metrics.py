"""Every number that tables and figures show, from arrays; nothing here formats or draws."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from reference import rotation

Floats = NDArray[np.float64]


class Share(NamedTuple):
    """A count out of a total, with the interval that holds the true rate in 95 % of samples."""

    hits: int
    total: int
    low: float
    high: float


class Spread(NamedTuple):
    """Where a sample lies; NaN throughout if it is empty."""

    median: float
    p95: float
    largest: float


class Effort(NamedTuple):
    """Seconds over a sample, failures included; NaN throughout if it is empty."""

    median: float
    p95: float
    mean: float


class Timing(NamedTuple):
    """Seconds per operation over the rounds of one benchmark."""

    median: float
    low: float
    high: float
    rounds: int


class Ratio(NamedTuple):
    """By what factor one of two samples of pairs exceeds the other, with its 95 % interval."""

    mean: float
    low: float
    high: float
    pairs: int


class Convergence(NamedTuple):
    """Quantiles over the targets of the residual before and after each iteration."""

    low: Floats
    median: Floats
    high: Floats


def share(hits: NDArray[np.bool_]) -> Share:
    """Return how many of the entries are true, with Wilson's interval (Wilson 1927)."""
    count, total, z = int(np.count_nonzero(hits)), int(np.size(hits)), 1.959963984540054
    if total == 0:
        return Share(0, 0, 0.0, 1.0)
    rate = count / total
    centre = (rate + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z * math.sqrt(rate * (1 - rate) / total + (z / (2 * total)) ** 2) / (1 + z**2 / total)
    return Share(count, total, max(0.0, centre - half), min(1.0, centre + half))


def spread(values: Floats) -> Spread:
    """Return median, 95th percentile and maximum; a NaN among the values shows in all three."""
    values = np.asarray(values, dtype=float).ravel()
    if values.size == 0:
        return Spread(math.nan, math.nan, math.nan)
    median, p95 = np.quantile(values, [0.5, 0.95])
    return Spread(float(median), float(p95), float(values.max()))


def effort(seconds: Floats) -> Effort:
    """Return median, 95th percentile and mean of all solves, those that failed among them."""
    median, p95, _ = spread(seconds)
    return Effort(median, p95, mean(seconds))


def within_budget(seconds: Floats, solved: NDArray[np.bool_], budgets: Floats) -> Floats:
    """Return the share of all targets that were solved within each budget of time, (budget,)."""
    if not np.size(seconds):
        return np.full(np.shape(budgets), math.nan)
    hits = np.sort(np.asarray(seconds)[np.asarray(solved, dtype=bool)])
    return np.searchsorted(hits, budgets, side="right") / np.size(seconds)


def performance_profiles(seconds: Floats, solved: NDArray[np.bool_], ratios: Floats) -> Floats:
    """Return the share of targets that each solver solves within a ratio of the fastest's time.

    Dolan & Moré 2002, eq. 2.1: rho(tau) over the targets that any of the solvers solves. The
    arguments are (solver, target) and (ratio,), ascending; the result is (solver, ratio).
    """
    taken = np.where(solved, seconds, np.inf)
    best = taken.min(axis=0, initial=np.inf)
    taken, best = taken[:, np.isfinite(best)], best[np.isfinite(best)]
    if not len(best):
        return np.full((len(taken), len(ratios)), math.nan)
    slower = np.sort(taken / best, axis=-1)
    return np.array([np.searchsorted(row, ratios, side="right") for row in slower]) / len(best)


def paired_ratio(values: Floats, others: Floats) -> Ratio:
    """Return the geometric mean of values / others over the pairs in which both are numbers.

    The interval is Student's, of the logarithms; a single pair leaves the factor open.
    """
    logs = np.log(np.asarray(values) / np.asarray(others))
    logs = logs[np.isfinite(logs)]
    count = int(logs.size)
    if count < 2:
        return Ratio(float(np.exp(logs[0])) if count else math.nan, 0.0, math.inf, count)
    half = stdtrit(count - 1, 0.975) * logs.std(ddof=1) / math.sqrt(count)
    mean, low, high = np.exp(logs.mean() + np.array([0.0, -half, half]))
    return Ratio(float(mean), float(low), float(high), count)


def whole(values: Floats) -> tuple[int | float, int | float, int | float]:
    """Return the spread of counts, as integers where they are."""
    median, p95, largest = (int(x) if x.is_integer() else x for x in spread(values))
    return median, p95, largest


def timing(seconds: Floats) -> Timing:
    """Return the median and the 10th and 90th percentiles of the rounds."""
    low, median, high = np.quantile(np.asarray(seconds, dtype=float), [0.1, 0.5, 0.9])
    return Timing(float(median), float(low), float(high), int(np.size(seconds)))


def bend(positions: Floats, target: Floats) -> Floats:
    """Return how far a chain strays from the straight line through root and target [m], (...,).

    `positions` are its joints, (..., joint, 3), the root first; `target` is (..., 3).
    """
    arms = positions - positions[..., :1, :]
    line = target - positions[..., 0, :]
    direction = line / np.linalg.norm(line, axis=-1, keepdims=True)
    along = np.einsum("...jk,...k->...j", arms, direction)
    aside = arms - along[..., None] * direction[..., None, :]
    return np.linalg.norm(aside, axis=-1).max(axis=-1)


def excess(residual: Floats, distance: Floats, reach: float) -> Floats:
    """Return by how much a residual exceeds the least possible one, distance - reach [m]."""
    return residual - np.maximum(distance - reach, 0.0)


def rotation_angles(local_rotations: Floats) -> Floats:
    """Return the angle by which each joint rotates between frames [rad], (frame - 1, joint).

    These are geodesic angles. The last frame and the first are no neighbours.
    """
    return rotation.angle(local_rotations[:-1], local_rotations[1:])


def relative_error(x: Floats, exact: Floats, start: Floats) -> float:
    """Return |x - exact| / |start - exact|: what is left of the error of the start."""
    return float(np.linalg.norm(x - exact) / np.linalg.norm(start - exact))


def rms_distance(x: Floats, y: Floats) -> float:
    """Return the root mean square distance between the points of x and of y [m]."""
    return float(np.sqrt(np.mean(np.sum((x - y) ** 2, axis=-1))))


def convergence(history: Floats) -> Convergence:
    """Return the 10th, 50th and 90th percentile over targets, (iteration,).

    `history` is (target, iteration); a target that is done keeps its last residual.
    """
    low, median, high = np.quantile(history, [0.1, 0.5, 0.9], axis=0)
    return Convergence(low, median, high)


def counts(values: Floats, edges: Floats) -> NDArray[np.int64]:
    """Return how many values fall between neighbouring edges; the last bin takes all beyond."""
    values = np.asarray(values, dtype=float).ravel()
    inside = np.clip(values, edges[0], edges[-1])
    return np.histogram(inside, bins=edges)[0].astype(np.int64)


def ratio(a: float, b: float) -> float:
    """Return a / b; NaN where b is zero."""
    return a / b if b else math.nan


def gigabytes_per_second(moved: float, seconds: float) -> float:
    """Return the bandwidth of so many bytes in so many seconds [GB/s]."""
    return moved / seconds / 1e9


def mean(values: Floats) -> float:
    """Return the mean; NaN if there are no values."""
    return float(np.mean(values)) if np.size(values) else math.nan


def extent(values: Floats) -> tuple[float, float]:
    """Return the least and the greatest value."""
    return float(np.min(values)), float(np.max(values))


def first_below(values: Floats, limit: float) -> int | None:
    """Return the index of the first value at or below the limit, None if there is none."""
    below = np.flatnonzero(np.asarray(values) <= limit)
    return int(below[0]) if below.size else None


def cheapest_within(seconds: Floats, errors: Floats, limit: float) -> int | None:
    """Return the index of the least time whose error is within the limit, None if none is."""
    reached = np.flatnonzero(np.asarray(errors) <= limit)
    return int(reached[np.argmin(np.asarray(seconds)[reached])]) if reached.size else None
