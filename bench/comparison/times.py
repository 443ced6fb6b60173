"""Compare times of two runs: intervals, and how far the machine drifts of itself."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ..peers import registry
from .intervals import ERROR_RATE, Deviation, Ratio, ratio_of_medians
from .quantities import SOLVED, is_clocked
from .rows import Pair, Row, RowKey, Verdict

# Two runs are not told apart below this, however calm the machine seems; nor below that where
# nothing says how calm it is.
FLOOR, UNKNOWN = 0.01, 0.1
# Times that are surely within so much of each other are the same.
MARGIN = 0.1
# Of fewer rounds nothing is said.
ROUNDS = 5


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
    sure = 1e6
    return Drift(Deviation(half_width / Deviation(1.0, sure).half_width, sure), source)


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
    apart = np.array([_apart(pair) for pair in rows.values() if _is_control(pair)])
    if len(apart):
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


def _apart(pair: Pair) -> float:
    old, new = (float(np.median(record.arrays["seconds"])) for record in pair)
    return math.log(new / old)
