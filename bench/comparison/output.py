"""A comparison in words: ten lines for a terminal, a table for a pull request, JSON."""

import json
from collections import Counter
from collections.abc import Sequence
from textwrap import wrap

from ..tables.columns import text
from ..tables.results import counted
from ..tables.table import Summary, Table, cells
from ..text import visible
from .compare import Comparison
from .rows import ORDER, Row, RowKey, Verdict, distinguishing
from .times import ROUNDS

# Lines of the summary on a terminal, its rows among them; rows of the table in a pull request.
LINES, MOST = 10, 50
# What stands before the further lines of a row on a terminal, as wide as its verdict.
_INDENT = " " * (3 + max(map(len, ORDER)))


def headline(comparison: Comparison, stopped: Sequence[Row]) -> str:
    """Return the answer in one sentence."""
    if stopped:
        return f"STOP: {_rows(len(stopped))} beyond the limits of --fail"
    worse = [row for row in comparison.rows if row.verdict in (Verdict.LESS_RIGHT, Verdict.SLOWER)]
    return f"{_rows(len(worse))} worse" if worse else "nothing is less right or slower"


def counts(comparison: Comparison) -> str:
    """Return how many rows there are of each verdict, the worst first."""
    found = Counter(row.verdict for row in comparison.rows)
    return ", ".join(f"{found[verdict]} {verdict}" for verdict in ORDER if found[verdict])


def summary(comparison: Comparison, stopped: Sequence[Row], width: int) -> list[str]:
    """Return ten lines of at most so many letters, the worst rows first, as many as fit."""
    changed, names = _changed(comparison)
    begin = [headline(comparison, stopped), counts(comparison) or "no rows in common"]
    drift = f"the machine's drift: {comparison.drift.sentence}"
    if comparison.short:
        drift += f"; {_short(comparison)}"
    if any(row.verdict == Verdict.UNDECIDED for row in changed) and not comparison.is_rerun:
        drift += "; --rerun REV decides"
    for count in range(min(LINES, len(changed)), -1, -1):
        more = f"  and {len(changed) - count} more: --markdown FILE or --json FILE has all"
        rows = [_line(row, names[row.key]) for row in changed[:count]]
        texts = [*begin, *rows, *([more] if count < len(changed) else []), drift]
        lines = [line for text in texts for line in wrap(text, width, subsequent_indent=_INDENT)]
        if len(lines) <= LINES:
            break
    return lines


def _line(row: Row, settings: str) -> str:
    what = f"{row.title} ({settings})" if settings else row.title
    return f"  {row.verdict:<{len(_INDENT) - 2}}" + visible(f"{what}: {row.why}")


def table(comparison: Comparison, stopped: Sequence[Row], old: str, new: str) -> Table:
    """Return the rows that are not known to be the same, with what decides them."""
    changed, names = _changed(comparison)
    points = [f"{_rows(len(changed) - MOST)} more are in the JSON"] if len(changed) > MOST else []
    points += [_short(comparison)] if comparison.short else []
    columns = (
        text("verdict", lambda row: str(row.verdict)),
        text("problem", lambda row: row.key[1]),
        text("solver", lambda row: row.key[2]),
        text("settings", lambda row: names[row.key]),
        text("quantity", lambda row: row.quantity),
        text("change", lambda row: row.why),
    )
    return Table(
        "compare",
        f"plumbob compare: {headline(comparison, stopped)}",
        columns,
        cells(columns, changed[:MOST]),
        shows=f"{old} beside {new}.",
        measured=f"{comparison.how} The machine's drift: {comparison.drift.sentence}.",
        summary=Summary(counts(comparison) or "No rows in common", tuple(points)),
    )


def as_json(comparison: Comparison, stopped: Sequence[Row], old: str, new: str) -> str:
    """Return all rows as standard JSON."""
    content = {
        "format": 1,
        "old": old,
        "new": new,
        "stop": len(stopped),
        "drift": comparison.drift.value,
        "drift_source": comparison.drift.source,
        "how": comparison.how,
        "short": comparison.short,
        "counts": Counter(str(row.verdict) for row in comparison.rows),
        "rows": [_as_json(row, row in stopped) for row in comparison.rows],
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _as_json(row: Row, stops: bool) -> dict[str, object]:
    suite, problem, solver, _ = row.key
    ratio = row.ratio
    return {
        "verdict": str(row.verdict), "stops": stops, "suite": suite, "problem": problem,
        "solver": solver, "settings": row.settings, "quantity": row.quantity,
        "change": row.change, "why": row.why,
        "ratio": ratio and _finite(ratio.value), "low": ratio and _finite(ratio.low),
        "high": ratio and _finite(ratio.high), "chance": ratio and ratio.chance,
    }  # fmt: skip


def _changed(comparison: Comparison) -> tuple[list[Row], dict[RowKey, str]]:
    """Return the rows that are not known to be the same, and what tells rows apart."""
    rows = comparison.rows
    changed = [row for row in rows if row.verdict != Verdict.SAME]
    return changed, distinguishing(row.key for row in rows)


def _short(comparison: Comparison) -> str:
    return f"{counted(comparison.short, 'time')} of fewer than {ROUNDS} rounds not compared"


def _finite(value: float) -> float | None:
    return value if abs(value) < float("inf") else None


def _rows(count: int) -> str:
    return counted(count, "row")
