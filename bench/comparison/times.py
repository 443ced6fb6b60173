"""Compare times of two runs: how sure a ratio is, and how far the machine drifts of itself.

Times are compared by the logarithm of a ratio, so that twice and half are equally far from 1.
"""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from ..peers import registry
from .answers import SOLVED, is_clocked
from .rows import Pair, Ratio, Row, RowKey, Verdict

Floats = NDArray[np.float64]

# The chance that any row at all is called faster or slower though none is.
ERROR_RATE = 0.05
CONFIDENCE = 0.95
RESAMPLES = 200
# Two runs are not told apart below this, however calm the machine seems; nor below that where
# nothing says how calm it is.
FLOOR, UNKNOWN = 0.01, 0.1
# Times that are surely within so much of each other are the same.
MARGIN = 0.1
# Of fewer rounds nothing is said.
ROUNDS = 5


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
    return _of_logs(middle, middle - total.half_width, middle + total.half_width, float(chance))


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
    return _of_logs(float(np.median(means)), low, high, float(chance))


def _of_logs(middle: float, low: float, high: float, chance: float) -> Ratio:
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


class Drift(NamedTuple):
    """By how much a machine differs from itself between two runs [log], and how that is known."""

    deviation: Deviation
    source: str

    @property
    def value(self) -> float:
        """What all but 5 % of the differences are below."""
        return self.deviation.half_width

    @property
    def sentence(self) -> str:
        """What a reader is told."""
        return f"{100 * math.expm1(self.value):.1f} % ({self.source})"


def known_drift(half_width: float, source: str) -> Drift:
    """Return a drift that is taken for granted."""
    return Drift(Deviation(half_width / float(stats.norm.ppf((1 + CONFIDENCE) / 2)), 1e6), source)


def drift(rows: Mapping[RowKey, Pair]) -> Drift:
    """Return how far apart two runs are where nothing has changed.

    Either by solvers whose code is the same in both runs, engines and copies of memory, or by the
    fixed loop that is timed beside every record, whichever says more.
    """
    known = [*_by_controls(rows), *_by_paces(rows)]
    if not known:
        return known_drift(UNKNOWN, "assumed, for the records do not tell")
    least = known_drift(FLOOR, "the least that is told apart")
    return max(*known, least, key=lambda one: one.value)


def _by_controls(rows: Mapping[RowKey, Pair]) -> Iterator[Drift]:
    controls = [pair for pair in rows.values() if _is_control(pair)]
    if controls:
        medians = [[np.median(record.arrays["seconds"]) for record in pair] for pair in controls]
        apart = np.diff(np.log(medians))
        deviation = Deviation(float(np.sqrt(np.mean(apart**2))), len(apart))
        yield Drift(deviation, f"{len(apart)} times of code that did not change")


def _by_paces(rows: Mapping[RowKey, Pair]) -> Iterator[Drift]:
    found = [record.conditions.get("pace") for pair in rows.values() for record in pair]
    paces = [pace for pace in found if isinstance(pace, float) and 0 < pace < math.inf]
    if len(paces) > 1:  # of two moments, hence the root of two
        deviation = math.sqrt(2) * float(np.std(np.log(paces), ddof=1))
        yield Drift(
            Deviation(deviation, len(paces) - 1), f"a fixed loop beside {len(paces)} records"
        )


def time_ratios(
    rows: Mapping[RowKey, Pair], machine: Drift
) -> dict[tuple[RowKey, str], Ratio | str]:
    """Return the ratio of each time of each row, or why there is none."""
    return {
        (key, name): _why_not(pair, name) or _ratio(pair, name, machine)
        for key, pair in rows.items() for name in clocked(pair) if has_rounds(pair, name)
    }  # fmt: skip


def clocked(pair: Pair) -> list[str]:
    """Return the names of the times that both runs have."""
    both = pair.old.arrays.keys() & pair.new.arrays.keys()
    return [n for n in pair.old.arrays if n in both and is_clocked(pair.old.suite, n)]


def has_rounds(pair: Pair, name: str) -> bool:
    """Return whether both runs have enough rounds of a time."""
    return all(record.arrays[name].size >= ROUNDS for record in pair)


def judged(key: RowKey, name: str, ratio: Ratio, chance: float) -> Row:
    """Return a row on a time, given its chance over all rows."""
    why = f"{ratio.value:.3f} times as long ({ratio.low:.3f} to {ratio.high:.3f})"
    return Row(key, name, _verdict(ratio, chance), abs(math.log(ratio.value)), why, ratio)


def _verdict(ratio: Ratio, chance: float) -> Verdict:
    if chance <= ERROR_RATE:
        return Verdict.SLOWER if ratio.value > 1 else Verdict.FASTER
    within = ratio.low * (1 + MARGIN) >= 1 and ratio.high <= 1 + MARGIN
    return Verdict.SAME if within else Verdict.UNDECIDED


def _why_not(pair: Pair, name: str) -> str:
    old, new = pair.old.arrays[name], pair.new.arrays[name]
    if pair.old.stamp.get("machine") != pair.new.stamp.get("machine"):
        return "measured on different machines"
    if not all(np.all((values > 0) & np.isfinite(values)) for values in (old, new)):
        return "times of zero or none"
    return ""


def _ratio(pair: Pair, name: str, machine: Drift) -> Ratio:
    old, new = (record.arrays[name].ravel() for record in pair)
    if np.array_equal(old, new):
        return Ratio(1.0, 1.0, 1.0, 1.0)
    paired = all(SOLVED in record.arrays for record in pair)  # by targets, the same in both runs
    if paired:
        count = min(len(old), len(new))
        old, new = old[:count], new[:count]
    return ratio_of_medians(old, new, machine.deviation, paired, np.random.default_rng(len(old)))


def _is_control(pair: Pair) -> bool:
    """Return whether a row times code that no revision of ours changes."""
    versions = [record.stamp.get("versions") for record in pair]
    if pair.old.suite != "timing" or versions[0] != versions[1]:
        return False
    engine = registry.find(pair.old.solver).engine
    is_foreign = pair.old.solver == registry.LIMIT.name or engine not in ("", registry.PLUMBOB)
    return is_foreign and not _why_not(pair, "seconds")
