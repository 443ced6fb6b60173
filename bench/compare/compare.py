"""Compare two runs row by row, and find the rows failing a gate."""

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from textwrap import wrap
from typing import NamedTuple

from plumbob.text.printable import visible

from ..measure.metrics import adjusted
from ..measure.record import Record
from ..tables.columns import text
from ..tables.results import counted
from ..tables.table import Summary, Table, cells
from . import times
from .answers import (
    ERROR,
    SHARE,
    chance_by_time_limit,
    compare_answers,
    compare_limited_answers,
    compare_statistics,
)
from .rows import (
    ORDER,
    ChangeVerdict,
    Pair,
    RowChange,
    RowKey,
    TimeRatio,
    by_row,
    distinguishing,
    match_rows,
    worst_first,
)

# What --fail takes, by the first word; and what a gate of the user's solvers takes by default.
# Every gate has the limit "gone", unless ANY allows rows to vanish and to fail.
LIMITS = {
    "accuracy": "accuracy or accuracy:SHARE",
    "time": "time:SHARE",
    "solved": "solved:POINTS",
    "error": "error:SHARE",
    "gone": "gone or gone:any",
}
OF_SOLVERS = "solved:1,error:100%,time:25%"
ANY = "any"
# Lines of the summary on a terminal; rows of the table in a pull request.
MAX_LINES, MAX_ROWS = 10, 50
# Indentation of the second line of a row on a terminal, as wide as its verdict.
_INDENT = " " * (3 + max(map(len, ORDER)))
METHOD = (
    "Answers are compared to the bit. Times are ratios of medians with 95 % block-bootstrap "
    "intervals, widened by the machine's drift; the probability of any wrong verdict is at most "
    f"{100 * times.ERROR_RATE:g} % over all rows (Holm)."
)


class RunComparison(NamedTuple):
    """Differences between two runs."""

    rows: list[RowChange]  # the worst first
    drift: times.Drift  # of the machine between both runs
    method: str  # a sentence on how times were compared
    is_rerun: bool = False  # whether both were measured side by side
    short: int = 0  # number of times with too few rounds to be compared


def compare(
    old: Iterable[Record], new: Iterable[Record], statistics: bool = False
) -> RunComparison:
    """Return the differences between the records of two runs, also of statistics if asked for."""
    before, after = by_row(old), by_row(new)
    pairs, changes = match_rows(before, after)
    drift = times.machine_drift(pairs)
    rows = [*changes, *row_changes(pairs, times.time_ratios(pairs, drift), statistics)]
    short = sum(
        not times.has_rounds(p, name) for p in pairs.values() for name in times.common_times(p)
    )
    return RunComparison(worst_first(rows), drift, METHOD, short=short)


def row_changes(
    pairs: Mapping[RowKey, Pair],
    ratios: Mapping[tuple[RowKey, str], TimeRatio | str],
    statistics: bool,
) -> list[RowChange]:
    """Return the change of the answers of each pair, of each of its times, and of statistics."""
    limited = {
        key: chance for key, pair in pairs.items()
        if (chance := chance_by_time_limit(pair)) is not None
    }  # fmt: skip
    tested = {time: ratio for time, ratio in ratios.items() if isinstance(ratio, TimeRatio)}
    raw = [*limited.values(), *(ratio.chance for ratio in tested.values())]
    chances = iter(adjusted(raw).tolist())
    rows = [compare_limited_answers(k, pairs[k], next(chances), times.ERROR_RATE) for k in limited]
    rows += [compare_answers(key, pair) for key, pair in pairs.items() if key not in limited]
    if statistics:
        decided = ((key, pairs[key]) for key in pairs if key not in limited)
        rows += [change for key, pair in decided for change in compare_statistics(key, pair)]
    for (key, name), ratio in ratios.items():
        if isinstance(ratio, str):
            rows.append(RowChange(key, name, ChangeVerdict.UNDECIDED, why=ratio))
        else:
            rows.append(times.time_change(key, name, ratio, next(chances)))
    return rows


def gate_limits(request: str) -> dict[str, float]:
    """Return the least changes that fail a gate, from a text like "solved:1,time:25%".

    Raises:
        ValueError: if a part of the text is no limit.
    """
    limits: dict[str, float] = {"gone": 0.0} if request.strip(" ,") else {}
    for part in filter(None, (part.strip() for part in request.split(","))):
        name, _, text = part.partition(":")
        if name not in LIMITS or (name == "gone" and text not in ("", ANY)):
            raise ValueError(f"--fail: expected {', '.join(LIMITS.values())}, got {part!r}")
        if text == ANY and name == "gone":
            limits.pop(name, None)
            continue
        try:
            number = float(text.removesuffix("%") or 0)
        except ValueError:
            number = math.nan
        limits[name] = number / 100 if "%" in text or name == "solved" else number
        if not 0 <= limits[name] < math.inf:
            raise ValueError(f"--fail: expected a number such as 10% or 0.1, got {part!r}")
    return limits


def failing(rows: Iterable[RowChange], limits: Mapping[str, float]) -> list[RowChange]:
    """Return the rows failing a gate, with the limit at the end of their sentence."""
    exceeded = ((row, _exceeded_limit(row, limits)) for row in rows)
    return [replace(row, why=f"{row.why} ({limit})") for row, limit in exceeded if limit]


def _exceeded_limit(row: RowChange, limits: Mapping[str, float]) -> str:
    """Return in words the limit exceeded by a row, "" if there is none."""
    names = {SHARE: "solved", ERROR: "error"}
    name = names.get(row.quantity, "accuracy")
    limit = limits.get(name, math.inf)
    if "gone" in limits and _is_lost(row):
        return "no row may be gone or fail"
    if row.verdict == ChangeVerdict.SLOWER and row.ratio:
        limit = 1 + limits.get("time", math.inf)
        return f"limit {limit:.4g}" if row.ratio.ratio >= limit else ""
    if row.verdict == ChangeVerdict.LESS_RIGHT and name == "solved" and row.change > limit + 1e-9:
        return f"limit {100 * limit:.3g} point{'' if limit == 0.01 else 's'}"
    if row.verdict == ChangeVerdict.LESS_RIGHT and name == "error" and row.change > limit:
        return f"limit {1 + limit:.4g} times"
    is_changed = row.verdict in (ChangeVerdict.LESS_RIGHT, ChangeVerdict.CHANGED)
    return f"limit {limit:g}" * (name == "accuracy" and is_changed and row.change >= limit)


def _is_lost(row: RowChange) -> bool:
    """Return whether a measured row is gone or has failed."""
    has_failed = row.verdict == ChangeVerdict.LESS_RIGHT and not row.quantity
    return row.verdict == ChangeVerdict.GONE or has_failed


def headline(comparison: RunComparison, failed: Sequence[RowChange]) -> str:
    """Return the result in a sentence."""
    if failed:
        return f"STOP: {counted(len(failed), 'row')} beyond the limits"
    bad = (ChangeVerdict.LESS_RIGHT, ChangeVerdict.SLOWER)
    worse = sum(row.verdict in bad for row in comparison.rows)
    gone = sum(row.verdict == ChangeVerdict.GONE for row in comparison.rows)
    result = f"{counted(worse, 'row')} worse" if worse else "No row is less accurate or slower"
    return f"{result}, but {gone:,} gone" if gone else result


def verdict_counts(comparison: RunComparison) -> str:
    """Return the number of rows of each verdict, the worst first."""
    counts = Counter(row.verdict for row in comparison.rows)
    listed = ", ".join(f"{counts[verdict]:,} {verdict}" for verdict in ORDER if counts[verdict])
    return listed or "No rows in common"


def summary(comparison: RunComparison, failed: Sequence[RowChange], width: int) -> list[str]:
    """Return at most ten lines of at most this width, with as many rows as fit, the worst first."""
    rows = _changes(comparison, failed)
    settings = distinguishing(row.key for row in comparison.rows)
    first = [headline(comparison, failed), verdict_counts(comparison)]
    last = [f"Drift of the machine: {comparison.drift.sentence}"]
    if any(row.verdict == ChangeVerdict.UNDECIDED for row in rows) and not comparison.is_rerun:
        last[0] += "; --rerun REV decides"
    if comparison.short:
        last.append(_not_compared(comparison))
    for count in range(min(MAX_LINES, len(rows)), -1, -1):
        more = [f"  and {len(rows) - count:,} more: --markdown FILE or --json FILE writes all"]
        texts = [*first, *(_line(row, settings[row.key]) for row in rows[:count])]
        texts += [*(more if count < len(rows) else ()), *last]
        lines = [line for text in texts for line in wrap(text, width, subsequent_indent=_INDENT)]
        if len(lines) <= MAX_LINES:
            break
    return lines


def _changes(comparison: RunComparison, failed: Sequence[RowChange]) -> list[RowChange]:
    """Return the rows that differ or are undecided, rows that fail the gate first."""
    names = {(row.key, row.quantity) for row in failed}
    rows = [row for row in comparison.rows if row.verdict != ChangeVerdict.SAME]
    return [*failed, *(row for row in rows if (row.key, row.quantity) not in names)]


def _line(row: RowChange, settings: str) -> str:
    title = row.title
    if row.why.startswith(row.quantity):
        title = title.removesuffix(f", {row.quantity}")
    name = f"{title} ({settings})" if settings else title
    return f"  {row.verdict:<{len(_INDENT) - 2}}" + visible(f"{name}: {row.why}")


def _not_compared(comparison: RunComparison) -> str:
    return (
        f"Not compared: {counted(comparison.short, 'time')} with fewer than {times.ROUNDS} rounds, "
        "for which there is no interval"
    )


def table(comparison: RunComparison, failed: Sequence[RowChange], old: str, new: str) -> Table:
    """Return the rows that differ or are undecided, with the reasons."""
    rows = _changes(comparison, failed)
    settings = distinguishing(row.key for row in comparison.rows)
    points = [f"{counted(len(rows) - MAX_ROWS, 'more row')} in the JSON"] * (len(rows) > MAX_ROWS)
    points += [_not_compared(comparison)] if comparison.short else []
    columns = (
        text("verdict", lambda row: str(row.verdict)),
        text("problem", lambda row: row.key[1]),
        text("solver", lambda row: row.key[2]),
        text("settings", lambda row: settings[row.key]),
        text("quantity", lambda row: row.quantity),
        text("change", lambda row: row.why),
    )
    return Table(
        "compare",
        f"plumbob compare: {headline(comparison, failed)}",
        columns,
        cells(columns, rows[:MAX_ROWS]),
        shows=f"{old} beside {new}.",
        measured=f"{comparison.method} Drift of the machine: {comparison.drift.sentence}.",
        summary=Summary(verdict_counts(comparison), tuple(points)),
    )


def as_json(comparison: RunComparison, failed: Sequence[RowChange], old: str, new: str) -> str:
    """Return all rows as standard JSON."""
    stops = {(row.key, row.quantity): row for row in failed}
    content = {
        "format": 1,
        "old": old,
        "new": new,
        "stop": len(failed),
        "drift": comparison.drift.half_width,
        "drift_source": comparison.drift.source,
        "how": comparison.method,
        "short": comparison.short,
        "counts": Counter(str(row.verdict) for row in comparison.rows),
        "rows": [
            _row_as_json(stops.get((row.key, row.quantity), row), (row.key, row.quantity) in stops)
            for row in comparison.rows
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _row_as_json(row: RowChange, stops: bool) -> dict[str, object]:
    suite, problem, solver, settings = row.key
    numbers = dict(zip(("ratio", "low", "high", "chance"), row.ratio or [None] * 4, strict=True))
    return {
        "verdict": str(row.verdict), "stops": stops, "suite": suite, "problem": problem,
        "solver": solver, "settings": json.loads(settings), "quantity": row.quantity,
        "change": row.change, "why": row.why,
        **{name: x if x is None or math.isfinite(x) else None for name, x in numbers.items()},
    }  # fmt: skip
