"""Every number of tables and figures, from arrays, without formatting or drawing."""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Share(NamedTuple):
    """A count out of a total, with the 95 % confidence interval of the true rate."""

    hits: int
    total: int
    low: float
    high: float


class Spread(NamedTuple):
    """Quantiles of a sample; NaN throughout if empty."""

    median: float
    p95: float
    largest: float


class Interval(NamedTuple):
    """An estimate, and the 95 % confidence interval of the true value."""

    value: float
    low: float
    high: float


class Ranking(NamedTuple):
    """Names, the best first, and the names tied with the first, itself included."""

    order: tuple[str, ...]
    first: tuple[str, ...]


class Timing(NamedTuple):
    """Seconds per operation over the rounds of a benchmark: median, tenths, 95 % interval."""

    median: float
    low: float
    high: float
    rounds: int
    interval: Interval


# The share of samples in which a statement holds, over all comparisons of a ranking at once; the
# usual share.
CONFIDENCE = 0.95
# The size of a bootstrap: each end of an interval of 95 % leaves out 2.5 % of the samples, give or
# take 0.8 %, sqrt(0.025 * 0.975 / 400).
RESAMPLES, _SEED = 400, 1979
# More targets take the normal distribution instead, which a mean of so many times follows.
LARGE = 20_000
_NORMAL = 1.959963984540054  # the quantile of the normal distribution at 97.5 %
# The signs of so few differences are enumerated: 4,096 patterns.
_FEW = 12


def share(hits: NDArray[np.bool_]) -> Share:
    """Return how many of the entries are true, with Wilson's interval (Wilson 1927)."""
    count, total = int(np.count_nonzero(hits)), int(np.size(hits))
    if total == 0:
        return Share(0, 0, 0.0, 1.0)
    low, high = wilson(np.array(count / total), total)
    return Share(count, total, float(low), float(high))


def wilson(rates: Floats, total: int | Floats) -> tuple[Floats, Floats]:
    """Return bounds of the true rates in 95 % of samples of this size (Wilson 1927)."""
    z = _NORMAL
    centre = (rates + z**2 / (2 * total)) / (1 + z**2 / total)
    half = z * np.sqrt(rates * (1 - rates) / total + (z / (2 * total)) ** 2) / (1 + z**2 / total)
    return np.maximum(0.0, centre - half), np.minimum(1.0, centre + half)


def spread(values: Floats) -> Spread:
    """Return median, 95th percentile and maximum; a NaN among the values shows in all three."""
    values = np.asarray(values, dtype=float).ravel()
    if values.size == 0:
        return Spread(math.nan, math.nan, math.nan)
    # Between two infinite values there is nothing to interpolate.
    method: Literal["higher", "linear"] = "higher" if np.isinf(values).any() else "linear"
    median, p95 = np.quantile(values, [0.5, 0.95], method=method)
    return Spread(float(median), float(p95), float(values.max()))


def median_interval(values: Floats) -> Interval:
    """Return the median and its interval by order statistics; NaN bounds of fewer than six.

    The number of values below the median is distributed like heads in as many throws of a coin,
    whatever the distribution of values (Conover 1999, section 3.2).
    """
    ordered = np.sort(np.asarray(values, dtype=float).ravel())
    if not len(ordered):
        return Interval(math.nan, math.nan, math.nan)
    rank = _coin_quantile(len(ordered))
    low, high = (ordered[rank], ordered[-1 - rank]) if rank >= 0 else (math.nan, math.nan)
    return Interval(float(np.median(ordered)), float(low), float(high))


@functools.cache
def _coin_quantile(throws: int) -> int:
    """Return the greatest k with at most 2.5 % probability of k heads or fewer, else -1."""
    return int(scipy.stats.binom.ppf((1 - CONFIDENCE) / 2, throws, 0.5)) - 1


def mean_interval(values: Floats) -> Interval:
    """Return the mean and its interval by Student; NaN bounds of fewer than two."""
    count, middle = int(np.size(values)), mean(values)
    if count < 2:
        return Interval(middle, math.nan, math.nan)
    half = float(scipy.stats.t.ppf((1 + CONFIDENCE) / 2, count - 1) * scipy.stats.sem(values))
    return Interval(middle, middle - half, middle + half)


def ranking(scores: Mapping[str, Floats]) -> Ranking:
    """Return the order by mean score, and the names tied with the greatest.

    The scores are of the same targets, (target,) each, and compared in pairs, since a target may be
    easy or hard for all. Two differ if their mean difference exceeds 95 % of the mean differences
    under random signs (Fisher 1935, section 21). For truth values the test is McNemar's exact test
    (1947). With several rivals the probabilities are adjusted by Holm (1979).
    """
    order = sorted(scores, key=lambda name: -mean(scores[name]))
    if not order:
        return Ranking((), ())
    first, *rivals = order
    chances = adjusted([chance_of_pairs(scores[first], scores[rival]) for rival in rivals])
    tied = [name for name, chance in zip(rivals, chances, strict=True) if chance > 1 - CONFIDENCE]
    return Ranking(tuple(order), (first, *tied))


def chance_of_pairs(a: Floats, b: Floats) -> float:
    """Return the probability of a mean difference as large under random signs, (target,) each.

    Exact for differences of equal size, and for few; else the sum is taken to be normal.
    """
    differences = np.asarray(a, dtype=float) - np.asarray(b, dtype=float)
    differences = differences[differences != 0]
    total, size = abs(float(differences.sum())), np.abs(differences)
    if not len(differences):
        return 1.0
    if size.min() == size.max():
        successes = int(np.sum(differences > 0))
        return float(scipy.stats.binomtest(successes, len(differences)).pvalue)
    if len(differences) <= _FEW:
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(differences))))
        return float(np.mean(np.abs(signs @ size) >= total * (1.0 - 1e-12)))
    return math.erfc(total / math.sqrt(2.0 * float(differences @ differences)))


def adjusted(chances: Sequence[float]) -> Floats:
    """Return probabilities valid over all comparisons at once (Holm 1979).

    A false discovery rate (Benjamini & Hochberg 1995) would not do: a false alarm stops a merge.
    """
    raw = np.asarray(chances, dtype=float)
    order = np.argsort(raw, kind="stable")
    steps = np.maximum.accumulate(raw[order] * (len(raw) - np.arange(len(raw))))
    return np.minimum(steps, 1.0)[np.argsort(order)]


def penalised(seconds: Floats, solved: NDArray[np.bool_], penalty: float) -> Floats:
    """Return seconds where solved; else the penalty, or the seconds if more."""
    return np.where(solved, seconds, np.maximum(np.nan_to_num(seconds, posinf=penalty), penalty))


def shifted_geometric_mean(seconds: Floats, shift: float, groups: Sequence[int] = ()) -> Interval:
    """Return exp(mean(log(seconds + shift))) - shift and its interval by the bootstrap.

    Targets are resampled within each group, for example a robot; `groups` are the sizes of the
    groups, in order, by default of a single group. The draws are seeded.
    """
    logs = np.log(np.asarray(seconds, dtype=float) + shift)
    sizes = tuple(groups) or (len(logs),)
    if len(logs) > LARGE:
        parts = np.split(logs, np.cumsum(sizes)[:-1])
        error = math.sqrt(sum(len(part) * float(np.var(part)) for part in parts)) / len(logs)
        low, high = np.mean(logs) + _NORMAL * error * np.array([-1.0, 1.0])
    else:
        means = _resamples(sizes) @ logs / len(logs)
        low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(*(float(np.exp(log) - shift) for log in (np.mean(logs), low, high)))


@functools.lru_cache(maxsize=8)
def _resamples(groups: tuple[int, ...]) -> Floats:
    """Return how often each target is drawn, (resample, target)."""
    rng = np.random.default_rng(_SEED)
    drawn = [rng.multinomial(size, np.full(size, 1.0 / size), size=RESAMPLES) for size in groups]
    return np.concatenate(drawn, axis=1).astype(float)


def relative_spread(values: Floats) -> float:
    """Return half the width of the middle eight tenths over the median; NaN if there are none."""
    if not np.size(values):
        return math.nan
    low, median, high = np.quantile(values, [0.1, 0.5, 0.9])
    return float((high - low) / (2.0 * median))


def within_budget(
    share: Share, seconds: Floats, budgets: Floats
) -> tuple[Floats, tuple[Floats, Floats]]:
    """Return the share of all targets solved within each budget, and its interval, (budget,).

    `seconds` are the times of some of the solved targets. The result is p q: p is the share that is
    solved, q the part of these times within the budget. Its variance is q² Var p + p² Var q; the
    interval is Wilson's for as many trials as have this variance. NaN if no solved target is timed.
    """
    count, p = np.size(seconds), share.hits / max(1, share.total)
    if share.hits and not count:
        rates = np.full(np.shape(budgets), math.nan)
        return rates, (rates, rates)
    q = np.searchsorted(np.sort(seconds), budgets, side="right") / max(1, count)
    rates = p * q
    variance = q**2 * p * (1 - p) / max(1, share.total) + p**2 * q * (1 - q) / max(1, count)
    trials = np.where((q == 0.0) & (p > 0.0), count / max(p, 1e-300), max(1.0, share.total))
    np.divide(rates * (1 - rates), variance, out=trials, where=variance > 0.0)
    return rates, wilson(rates, trials)


def performance_profiles(seconds: Floats, solved: NDArray[np.bool_], ratios: Floats) -> Floats:
    """Return the share of targets solved by each solver within a ratio of the fastest's time.

    Dolan & Moré 2002, eq. 2.1: rho(tau) over the targets solved by any solver. The arguments are
    (solver, target) and (ratio,), ascending; the result is (solver, ratio).
    """
    times = np.where(solved, seconds, np.inf)
    best = times.min(axis=0, initial=np.inf)
    times, best = times[:, np.isfinite(best)], best[np.isfinite(best)]
    if not len(best):
        return np.full((len(times), len(ratios)), math.nan)
    slower = np.sort(times / best, axis=-1)
    return np.array([np.searchsorted(row, ratios, side="right") for row in slower]) / len(best)


def paired_ratio(a: Floats, b: Floats) -> Interval:
    """Return the geometric mean of a / b over the pairs in which both are numbers.

    The interval is Student's, of the logarithms; a single pair leaves the factor open.
    """
    logs = np.log(np.asarray(a) / np.asarray(b))
    logs = logs[np.isfinite(logs)]
    middle, low, high = np.exp(mean_interval(logs)).tolist()
    return Interval(middle, low, high) if len(logs) > 1 else Interval(middle, 0.0, math.inf)


def whole(values: Floats) -> tuple[int | float, int | float, int | float]:
    """Return the spread of counts, as integers where integral."""
    median, p95, largest = (int(part) if part.is_integer() else part for part in spread(values))
    return median, p95, largest


def timing(seconds: Floats) -> Timing:
    """Return the median, the 10th and 90th percentiles of the rounds, and the median's interval.

    `seconds` are times of rounds, (round,), or of the rounds of each sweep, (sweep, round). The
    median is over all rounds. Successive rounds of a sweep are correlated, so the interval is of
    the sweeps' medians.
    """
    rounds = np.asarray(seconds, dtype=float)
    low, median, high = np.quantile(rounds, [0.1, 0.5, 0.9])
    sweeps = np.median(rounds, axis=1) if rounds.ndim == 2 else rounds
    interval = median_interval(sweeps)._replace(value=float(median))
    return Timing(float(median), float(low), float(high), int(rounds.size), interval)


def bend(positions: Floats, target: Floats) -> Floats:
    """Return the largest distance of a joint from the line through root and target [m], (...,).

    `positions` are its joints, (..., joint, 3), the root first; `target` is (..., 3).
    """
    arms = positions - positions[..., :1, :]
    line = target - positions[..., 0, :]
    direction = line / np.linalg.norm(line, axis=-1, keepdims=True)
    along = np.einsum("...jk,...k->...j", arms, direction)
    offsets = arms - along[..., None] * direction[..., None, :]
    return np.linalg.norm(offsets, axis=-1).max(axis=-1)


def excess(residual: Floats, distance: Floats, reach: float) -> Floats:
    """Return by how much a residual exceeds its lower bound, distance - reach [m]."""
    return residual - np.maximum(distance - reach, 0.0)


def ratio(a: float, b: float) -> float:
    """Return a / b; NaN where b is zero."""
    return a / b if b else math.nan


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
