"""Compare times of two runs: confidence intervals of ratios, and the drift of the machine.

Times are compared by the logarithm of their ratio, so twice and half are equally far from 1.
"""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ..peers import catalogue
from .answers import SOLVED, is_time
from .rows import ChangeVerdict, Pair, RowChange, RowKey, TimeRatio

Floats = NDArray[np.float64]

# The probability of calling any row faster or slower although no row is, as usual.
ERROR_RATE = 0.05
# The confidence of intervals, as in every table.
CONFIDENCE = 0.95
# The size of a bootstrap: the standard deviation of 200 is known to 5 %, 1 / sqrt(2 * 199).
RESAMPLES = 200
# The least drift, however steady the machine seems. A round number: a smaller change is no news.
FLOOR = 0.01
# The drift if not measured; a smaller change of a time is then called neither slower nor faster.
UNKNOWN = 0.1
# Times whose ratio is surely within this margin of 1 are the same: a user hardly feels 10 %.
MARGIN = 0.1
# Times with fewer rounds are not compared: their medians by the bootstrap are too few.
ROUNDS = 5


class Drift(NamedTuple):
    """Standard deviation [log] of a time between two runs, degrees of freedom, and its source."""

    sigma: float
    freedom: float
    source: str = ""

    @property
    def half_width(self) -> float:
        """Half the width of the 95 % interval around 0 [log]."""
        return float(scipy.stats.t.ppf((1 + CONFIDENCE) / 2, self.freedom) * self.sigma)

    @property
    def sentence(self) -> str:
        """The drift in percent and its source."""
        return f"{100 * math.expm1(self.half_width):.1f} % ({self.source})"


def assumed_drift(half_width: float, source: str) -> Drift:
    """Return a drift of known size."""
    return Drift(half_width / float(scipy.stats.norm.ppf((1 + CONFIDENCE) / 2)), 1e6, source)


def ratio_of_medians(
    old: Floats, new: Floats, drift: Drift, paired: bool, rng: np.random.Generator
) -> TimeRatio:
    """Return the ratio of two medians by the block bootstrap, and by the machine's drift [log].

    Successive rounds are correlated, so blocks of rounds are resampled (Künsch 1989). Neither run
    shows the drift between the two, so the variance of the drift is added, with the degrees of
    freedom of Welch (1947).
    """
    centre = math.log(np.median(new) / np.median(old))
    resamples = [_block_resamples(len(times), rng) for times in (old, new)]
    medians = [
        np.median(old[resamples[0]], axis=1),
        np.median(new[resamples[0 if paired else 1]], axis=1),
    ]
    sigma = float(np.std(np.log(medians[1] / medians[0]), ddof=1))
    freedom = min(len(old), len(new)) - 1
    squares = sigma**2, drift.sigma**2  # one of them is not zero
    total = Drift(
        math.sqrt(sum(squares)),
        sum(squares) ** 2 / (squares[0] ** 2 / freedom + squares[1] ** 2 / drift.freedom),
    )
    chance = float(2 * scipy.stats.t.sf(abs(centre) / total.sigma, total.freedom))
    return _from_logs(centre, centre - total.half_width, centre + total.half_width, chance)


def _block_resamples(size: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return indices, (resample, size), in blocks as long as the square root of the size."""
    length = max(1, round(math.sqrt(size)))
    starts = rng.integers(size, size=(RESAMPLES, -(-size // length), 1))
    return ((starts + np.arange(length)) % size).reshape(RESAMPLES, -1)[:, :size]


def ratio_of_pairs(old: Floats, new: Floats) -> TimeRatio:
    """Return the ratio over pairs measured side by side, each in random order.

    The random order makes the signed-rank test (Wilcoxon 1945) exact, whatever the machine does.
    Estimate and interval are order statistics of the means of all pairs of differences
    (Hodges & Lehmann 1963).
    """
    differences = np.log(new / old)
    first, second = np.triu_indices(len(differences))
    means = np.sort((differences[first] + differences[second]) / 2)
    nonzero = differences[differences != 0]
    chance = scipy.stats.wilcoxon(nonzero, method="exact").pvalue if len(nonzero) else 1.0
    margin = _signed_rank_quantile(len(differences))
    low, high = (means[margin], means[-1 - margin]) if margin >= 0 else (-math.inf, math.inf)
    return _from_logs(float(np.median(means)), low, high, float(chance))


def _from_logs(centre: float, low: float, high: float, chance: float) -> TimeRatio:
    return TimeRatio(math.exp(centre), math.exp(low), math.exp(high), chance)


def _signed_rank_quantile(count: int) -> int:
    """Return how many sorted means lie below the 95 % interval, -1 if there are too few pairs."""
    subsets = np.ones(1)
    for rank in range(1, count + 1):
        subsets = np.convolve(subsets, [1, *[0] * (rank - 1), 1])
    below = np.cumsum(subsets) / subsets.sum()
    return int(np.count_nonzero(below <= (1 - CONFIDENCE) / 2)) - 1


def pairs_needed(rows: int) -> int:
    """Return how many pairs can decide a row of so many though a few pairs disagree."""
    return math.ceil(math.log2(2 * max(rows, 1) / ERROR_RATE)) + 6


def machine_drift(rows: Mapping[RowKey, Pair]) -> Drift:
    """Return the drift between two runs, by the larger of two estimates.

    The first estimate is by solvers with unchanged code, like engines and copies of memory. The
    second is by the fixed loop timed beside every record.
    """
    estimates = [*_drift_by_controls(rows), *_drift_by_fixed_loop(rows)]
    if not estimates:
        return assumed_drift(UNKNOWN, "assumed: the records do not measure it")
    floor = assumed_drift(FLOOR, "the least that is distinguished")
    return max(*estimates, floor, key=lambda drift: drift.half_width)


def _drift_by_controls(rows: Mapping[RowKey, Pair]) -> Iterator[Drift]:
    if controls := [pair for pair in rows.values() if _is_control(pair)]:
        medians = [[np.median(record.measured["seconds"]) for record in pair] for pair in controls]
        differences = np.diff(np.log(medians))
        sigma, count = float(np.sqrt(np.mean(differences**2))), len(differences)
        yield Drift(sigma, count, f"{count:,} times of unchanged code")


def _drift_by_fixed_loop(rows: Mapping[RowKey, Pair]) -> Iterator[Drift]:
    conditions = [record.conditions.get("pace") for pair in rows.values() for record in pair]
    paces = [pace for pace in conditions if isinstance(pace, float) and 0 < pace < math.inf]
    if len(paces) > 1:  # a difference of two moments, hence the root of two
        sigma = math.sqrt(2) * float(np.std(np.log(paces), ddof=1))
        yield Drift(sigma, len(paces) - 1, f"a fixed loop timed with {len(paces):,} records")


def _is_control(pair: Pair) -> bool:
    """Return whether a row times code that no revision of Plumbob changes."""
    versions = [record.stamp.get("versions") for record in pair]
    if pair.old.suite != "timing" or versions[0] != versions[1]:
        return False
    engine = catalogue.find(pair.old.solver).engine
    is_foreign = pair.old.solver == catalogue.LIMIT.name or engine not in ("", catalogue.PLUMBOB)
    return is_foreign and not _why_not_compared(pair, "seconds")


def time_ratios(
    rows: Mapping[RowKey, Pair], drift: Drift
) -> dict[tuple[RowKey, str], TimeRatio | str]:
    """Return the ratio of each time with enough rounds, or why the time is not compared."""
    return {
        (key, name): _why_not_compared(pair, name) or _time_ratio(pair, name, drift)
        for key, pair in rows.items()
        for name in common_times(pair)
        if has_rounds(pair, name)
    }


def common_times(pair: Pair) -> list[str]:
    """Return the names of the times in both runs."""
    suite, new = pair.old.suite, pair.new.numbers()
    return [name for name in pair.old.measured if name in new and is_time(suite, name)]


def has_rounds(pair: Pair, name: str) -> bool:
    """Return whether both runs have enough rounds of a time."""
    return all(record.numbers()[name].size >= ROUNDS for record in pair)


def time_change(key: RowKey, name: str, ratio: TimeRatio, chance: float) -> RowChange:
    """Return the change of a time, by its probability adjusted for all rows."""
    bounds = (ratio.ratio, ratio.low, ratio.high)
    if ratio.ratio < 1:
        bounds = (1 / ratio.ratio, 1 / ratio.high, 1 / ratio.low if ratio.low else math.inf)
    times, low, high = (f"{bound:.3g}" for bound in bounds)
    why = f"{times} times {'slower' if ratio.ratio >= 1 else 'faster'} ({low} to {high})"
    verdict = ChangeVerdict.UNDECIDED
    if chance <= ERROR_RATE:
        verdict = ChangeVerdict.SLOWER if ratio.ratio > 1 else ChangeVerdict.FASTER
    elif ratio.low * (1 + MARGIN) >= 1 and ratio.high <= 1 + MARGIN:
        verdict = ChangeVerdict.SAME
    return RowChange(key, name, verdict, abs(math.log(ratio.ratio)), why, ratio)


def _why_not_compared(pair: Pair, name: str) -> str:
    if pair.old.stamp.get("machine") != pair.new.stamp.get("machine"):
        return "measured on different machines"
    for record in pair:
        times = record.numbers()[name]
        if not np.all((times > 0) & np.isfinite(times)):
            return "a time is zero or missing"
    return ""


def _time_ratio(pair: Pair, name: str, drift: Drift) -> TimeRatio:
    old, new = (record.numbers()[name].ravel() for record in pair)
    if np.array_equal(old, new):
        return TimeRatio(1.0, 1.0, 1.0, 1.0)
    has_targets = all(SOLVED in record.measured for record in pair)  # a time each, in both runs
    if has_targets:
        count = min(len(old), len(new))
        old, new = old[:count], new[:count]
    rng = np.random.default_rng(len(old))
    return ratio_of_medians(old, new, drift, has_targets, rng)
