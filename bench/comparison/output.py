"""A comparison in words: ten lines for a terminal, a table for a pull request, JSON."""

import json
from collections import Counter
from collections.abc import Sequence

from ..presentation.tables.aligned import filled
from ..presentation.tables.columns import text
from ..presentation.tables.table import Summary, Table, cells
from ..text import visible
from .compare import Comparison
from .rows import ORDER, Row, Verdict, distinguishing

# Lines of the summary on a terminal, its rows among them; rows of the table in a pull request.
LINES, MOST = 10, 50
# Behind so many letters a row on a terminal says what changed.
_INDENT = 3 + max(map(len, ORDER))


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
    """Return ten lines of at most so many letters, or fewer, the worst rows first."""
    changed = [row for row in comparison.rows if row.verdict != Verdict.SAME]
    names = distinguishing(comparison.rows)
    drift = f"the machine's drift: {comparison.drift.sentence}"
    if any(row.verdict == Verdict.UNDECIDED for row in changed) and not comparison.is_rerun:
        drift += "; --rerun REV decides"
    first = (headline(comparison, stopped), counts(comparison) or "no rows in common")
    begin, end = [line for text in first for line in filled(text, width)], filled(drift, width)
    blocks = [_block(row, names[row.key], width) for row in changed[:LINES]]
    room = LINES - len(begin) - len(end)
    lengths = [sum(map(len, blocks[:n])) + (n < len(changed)) for n in range(len(blocks) + 1)]
    count = max((n for n, length in enumerate(lengths) if length <= room), default=0)
    lines = [line for block in blocks[:count] for line in block]
    if count < len(changed):
        lines.append(f"  and {len(changed) - count} more: --markdown FILE or --json FILE has all")
    return [*begin, *lines, *end]


def _block(row: Row, settings: str, width: int) -> list[str]:
    """Return the lines of a row: its verdict, and behind it what changed."""
    what = f"{row.title} ({settings})" if settings else row.title
    first, *more = filled(visible(f"{what}: {row.why}"), width - _INDENT)
    return [f"  {row.verdict:<{_INDENT - 2}}{first}", *(" " * _INDENT + line for line in more)]


def table(comparison: Comparison, stopped: Sequence[Row], old: str, new: str) -> Table:
    """Return the rows that are not known to be the same, with what decides them."""
    told = [row for row in comparison.rows if row.verdict != Verdict.SAME]
    names = distinguishing(comparison.rows)
    points = [f"{_rows(len(told) - MOST)} more are in the JSON"] if len(told) > MOST else []
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
        cells(columns, told[:MOST]),
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


def _finite(value: float) -> float | None:
    return value if abs(value) < float("inf") else None


def _rows(count: int) -> str:
    return f"{count} row{'' if count == 1 else 's'}"
