"""How sure a ratio of times is: bootstrap and signed ranks.

Times are compared by the logarithm of a ratio, so that twice and half are equally far from 1.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Floats = NDArray[np.float64]

# The chance that any row at all is called faster or slower though none is.
ERROR_RATE = 0.05
CONFIDENCE = 0.95
RESAMPLES = 200


class Ratio(NamedTuple):
    """New time over old, its interval, and how likely as much is by chance.

    The interval holds the ratio in 95 % of runs.
    """

    value: float
    low: float
    high: float
    chance: float


class Deviation(NamedTuple):
    """A standard deviation, and the degrees of freedom that it is known by."""

    value: float
    freedom: float

    @property
    def half_width(self) -> float:
        """How far from 0 all but 5 % lie."""
        return float(stats.t.ppf((1 + CONFIDENCE) / 2, self.freedom) * self.value)


def ratio_of_medians(
    old: Floats, new: Floats, drift: Deviation, paired: bool, rng: np.random.Generator
) -> Ratio:
    """Return the ratio of two medians by the block bootstrap, and by the drift [log] of a machine.

    Rounds that follow each other are alike, so blocks of them are drawn (Künsch 1989). What a
    machine drifts between two runs shows in neither of them, so its variance is added, by the
    degrees of freedom of Welch (1947).
    """
    middle = math.log(np.median(new) / np.median(old))
    picks = [_blocks(len(values), rng) for values in (old, new)]
    draws = [np.median(old[picks[0]], axis=1), np.median(new[picks[0 if paired else 1]], axis=1)]
    rounds = Deviation(
        float(np.std(np.log(draws[1] / draws[0]), ddof=1)), min(len(old), len(new)) - 1
    )
    total = _sum(rounds, drift)
    chance = 2 * stats.t.sf(abs(middle) / total.value, total.freedom)
    return _ratio(middle, middle - total.half_width, middle + total.half_width, float(chance))


def _sum(a: Deviation, b: Deviation) -> Deviation:
    """Return the deviation of a sum; one of the two is not zero."""
    squares = a.value**2, b.value**2
    freedom = sum(squares) ** 2 / (squares[0] ** 2 / a.freedom + squares[1] ** 2 / b.freedom)
    return Deviation(math.sqrt(sum(squares)), freedom)


def _blocks(size: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return indices of resamples, (resample, size), in runs of the root of the size."""
    length = max(1, round(math.sqrt(size)))
    starts = rng.integers(size, size=(RESAMPLES, -(-size // length), 1))
    return ((starts + np.arange(length)) % size).reshape(RESAMPLES, -1)[:, :size]


def ratio_of_pairs(old: Floats, new: Floats) -> Ratio:
    """Return the ratio over pairs measured side by side, the order of each pair drawn by lot.

    By that lot old and new may be exchanged if they are alike, whatever the machine does, so
    the signed-rank test (Wilcoxon 1945) is exact. Estimate and interval are order
    statistics of the means of all pairs of differences (Hodges & Lehmann 1963).
    """
    apart = np.log(new / old)
    means = np.sort([(a + b) / 2 for i, a in enumerate(apart) for b in apart[i:]])
    nonzero = apart[apart != 0]
    chance = stats.wilcoxon(nonzero, method="exact").pvalue if len(nonzero) else 1.0
    cut = _signed_rank_quantile(len(apart))
    low, high = (means[cut], means[-1 - cut]) if cut >= 0 else (-math.inf, math.inf)
    return _ratio(float(np.median(means)), low, high, float(chance))


def _ratio(middle: float, low: float, high: float, chance: float) -> Ratio:
    return Ratio(math.exp(middle), math.exp(low), math.exp(high), chance)


def _signed_rank_quantile(count: int) -> int:
    """Return how many of the sorted means lie below the interval, -1 if all pairs are too few."""
    subsets = np.ones(1)
    for rank in range(1, count + 1):
        subsets = np.convolve(subsets, [1, *[0] * (rank - 1), 1])
    below = np.cumsum(subsets) / subsets.sum()
    return int(np.count_nonzero(below <= (1 - CONFIDENCE) / 2)) - 1


def pairs_needed(rows: int) -> int:
    """Return how many pairs let one of so many rows be called though some of them disagree."""
    return math.ceil(math.log2(2 * max(rows, 1) / ERROR_RATE)) + 6
