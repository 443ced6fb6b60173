"""Compare two runs row by row, and decide which rows a gate stops at."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ..harness.metrics import adjusted
from ..harness.record import Record
from .answers import chance_by_clock, compare_answers, compare_cut_answers
from .rows import Pair, Ratio, Row, RowKey, Verdict, by_row, come_and_gone, pairs, worst_first
from .times import ERROR_RATE, Drift, clocked, drift, has_rounds, judged, time_ratios

ACCURACY, TIME, GONE = "accuracy", "time", "gone"


class Comparison(NamedTuple):
    """What two runs differ in.

    Attributes:
        rows: the worst first.
        drift: by how much the machine differs from itself.
        how: a sentence on how times were decided.
        is_rerun: whether both were measured side by side.
        short: how many times have too few rounds to be compared.
    """

    rows: list[Row]
    drift: Drift
    how: str
    is_rerun: bool = False
    short: int = 0


class Limits(NamedTuple):
    """At what a gate stops: the least relative change of answers and of times; None never."""

    accuracy: float | None = None
    time: float | None = None
    gone: bool = False


HOW = (
    "Answers are compared to the bit. Times are ratios of medians with 95 % block-bootstrap "
    "intervals, widened by the machine's drift; the chance of calling any row wrongly is held at "
    f"{100 * ERROR_RATE:g} % over all rows (Holm)."
)


def compare(old: Iterable[Record], new: Iterable[Record]) -> Comparison:
    """Return what two runs differ in, by their records."""
    before, after = by_row(old), by_row(new)
    both = pairs(before, after)
    machine = drift(both)
    rows = [*come_and_gone(before, after), *decide(both, time_ratios(both, machine))]
    short = sum(not has_rounds(pair, name) for pair in both.values() for name in clocked(pair))
    return Comparison(worst_first(rows), machine, HOW, short=short)


def decide(
    both: Mapping[RowKey, Pair], ratios: Mapping[tuple[RowKey, str], Ratio | str]
) -> list[Row]:
    """Return a row on the answers of each pair, and one on each of its times."""
    cut = {key: chance for key, pair in both.items()
           if (chance := chance_by_clock(pair)) is not None}  # fmt: skip
    known = {at: ratio.chance for at, ratio in ratios.items() if isinstance(ratio, Ratio)}
    chances = iter(adjusted([*cut.values(), *known.values()]).tolist())
    rows = [compare_cut_answers(key, both[key], next(chances), ERROR_RATE) for key in cut]
    rows += [compare_answers(key, pair) for key, pair in both.items() if key not in cut]
    for at, ratio in ratios.items():
        rows.append(
            judged(*at, ratio, next(chances))
            if isinstance(ratio, Ratio)
            else Row(*at, Verdict.UNDECIDED, why=ratio)
        )
    return rows


def limits(text: str) -> Limits:
    """Return the limits that a text such as "accuracy,time:10%" sets.

    Raises:
        ValueError: if it is none.
    """
    found: dict[str, Any] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, _, value = part.partition(":")
        if name not in Limits._fields or (name == GONE and value):
            raise ValueError(
                f"--fail: expected accuracy, accuracy:SHARE, time:SHARE or gone, got {part!r}"
            )
        found[name] = True if name == GONE else _share(part, value)
    return Limits(**found)


def _share(part: str, value: str) -> float:
    if not value:
        return 0.0
    try:
        share = float(value.removesuffix("%")) / (100 if value.endswith("%") else 1)
    except ValueError:
        share = -1.0
    if not 0 <= share < float("inf"):
        raise ValueError(f"--fail: expected a share such as 10% or 0.1, got {part!r}")
    return share


def stops_at(rows: Sequence[Row], limit: Limits) -> list[Row]:
    """Return the rows that a gate stops at."""
    return [row for row in rows if _stops(row, limit)]


def _stops(row: Row, limit: Limits) -> bool:
    if row.verdict in (Verdict.LESS_RIGHT, Verdict.CHANGED):
        return limit.accuracy is not None and row.change >= limit.accuracy
    if row.verdict == Verdict.SLOWER and row.ratio:
        return limit.time is not None and row.ratio.value >= 1 + limit.time
    return row.verdict == Verdict.GONE and limit.gone
