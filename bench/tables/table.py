"""A table as a value, and its forms Markdown and CSV.

Tables compute nothing: the cells arrive as numbers and leave as text.
"""

import csv
import io
import itertools
import math
import re
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ..harness.metrics import Share

Cell = str | int | float | bool | Share | None


class Summary(NamedTuple):
    """What a table says: a sentence, and points below it; empty where it says nothing."""

    sentence: str = ""
    points: tuple[str, ...] = ()


NO_SUMMARY = Summary()

# How a share is written: with the interval that holds the true rate.
INTERVAL = "95 % interval"
# How an infinite number is written: as far from the target as one without an answer.
NO_ANSWER = "no answer"
# What one metre, second, radian, byte or whole is in other units.
UNITS = {"ms": 1e3, "µs": 1e6, "ns": 1e9, "°": 180.0 / math.pi, "%": 100.0, "GiB": 2.0**-30}


def in_unit(value: float, unit: str) -> float:
    """Return a value in SI units, or a share of one, in a unit such as "ms", "°" or "ns/solve"."""
    return UNITS.get(unit.partition("/")[0], 1.0) * value


def _itself(subject: Any) -> Cell:
    cell: Cell = subject
    return cell


@dataclass(frozen=True)
class Column:
    """A heading with its unit, such as `Column("median", "µs")`; words are set to the left.

    The note says how a cell is written, such as `INTERVAL`; it is left out where parts of the cell
    have columns of their own. `read` takes the cell from what a row is about, in SI units or as a
    share of one; `cell` converts it to the column's unit, or multiplies it by `factor`. `best` says
    whether the "least" or the "greatest" is best, "" where neither is; neighbours of one `group`
    stand under a heading in common; a `folded` column is shown only to those who ask for it.
    """

    title: str
    unit: str = ""
    words: bool = False
    note: str = ""
    read: Callable[[Any], Any] = field(default=_itself, compare=False)
    factor: float | None = None
    best: str = ""
    group: str = ""
    folded: bool = False

    def cell(self, subject: Any) -> Cell:
        """Return the cell of the row that is about this subject."""
        value = self.read(subject)
        plain: Cell = value.item() if hasattr(value, "item") else value
        if not isinstance(plain, float):
            return plain
        return in_unit(plain, self.unit) if self.factor is None else self.factor * plain

    @property
    def below(self) -> str:
        """The title as it stands under the heading of its group: "median" under "residual"."""
        return self.title.removeprefix(self.group).lstrip(",: ") or self.title

    @property
    def titled(self) -> str:
        """Title and note in one."""
        return f"{self.title} ({self.note})" if self.note else self.title

    @property
    def heading(self) -> str:
        """Title, note and unit in one."""
        return f"{self.titled} [{self.unit}]" if self.unit else self.titled


class Source(NamedTuple):
    """The measurements behind a row: their suite, and the problems and solvers in it."""

    suite: str = ""
    problems: tuple[str, ...] = ()
    solvers: tuple[str, ...] = ()

    @property
    def command(self) -> str:
        """The command that measures the row again, "" where nothing was measured.

        Where a row is about many problems or solvers, it measures all of the suite.
        """
        named = (("--solver", self.solvers), ("--problem", self.problems))
        options = [
            (option, name) for option, names in named if len(names) <= MOST for name in names
        ]
        told = (word for option in options for word in option)
        return shlex.join(["plumbob", "bench", self.suite, *told]) if self.suite else ""


# A command names so many problems or solvers at most.
MOST = 3


def cells(columns: Sequence[Column], subjects: Iterable[Any]) -> tuple[tuple[Cell, ...], ...]:
    """Return a row for each subject, with a cell under each column as that reads it."""
    return tuple(tuple(column.cell(subject) for column in columns) for subject in subjects)


@dataclass(frozen=True)
class Table:
    """A named table.

    Attributes:
        name: the stem of its files.
        title: what it is called.
        columns: one heading a column; the first names the row.
        rows: the cells; None where nothing was measured.
        shows: one sentence on what can be read off.
        measured: one sentence on how the numbers came about.
        summary: what the numbers say, generated from them.
        compared: rows whose first so many cells agree are compared with one another; 0: all are.
        unranked: the numbers of rows that are never best, such as those of a solver cut short.
        sources: what is behind each row; empty where no row says it.
        provenance: how many samples, on which machine, with which versions.
        best: row and column of the cells that are best, where not the columns say it.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    shows: str = ""
    measured: str = ""
    summary: Summary = NO_SUMMARY
    compared: int = 1
    unranked: frozenset[int] = frozenset()
    sources: tuple[Source, ...] = ()
    provenance: str = ""
    best: frozenset[tuple[int, int]] | None = None

    def __post_init__(self) -> None:
        """Refuse ragged rows, headings that stand twice, and sources of some rows only."""
        if len({column.heading for column in self.columns}) < len(self.columns):
            raise ValueError(f"columns: expected distinct headings in table {self.name}")
        if len(self.sources) not in (0, len(self.rows)):
            raise ValueError(f"sources: expected none or one a row in table {self.name}")
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(
                    f"rows: expected {len(self.columns)} cells in table {self.name}, got {len(row)}"
                )


def is_blank(table: Table) -> bool:
    """Return whether a table has no rows, or is to hold numbers and holds none."""
    numbers = [j for j, column in enumerate(table.columns) if not column.words]
    cells = [row[j] for row in table.rows for j in numbers]
    return not table.rows or (bool(cells) and all(cell is None for cell in cells))


def best_cells(table: Table) -> set[tuple[int, int]]:
    """Return row and column of each cell that is best among the rows it is compared with.

    Ties are all best: shares whose intervals overlap with that of the best, numbers that are
    written alike. A cell that nothing is compared with is not best.
    """
    if table.best is not None:
        return set(table.best)
    groups: dict[tuple[Cell, ...], list[int]] = {}
    for i, row in enumerate(table.rows):
        groups.setdefault(row[: table.compared], []).append(i)
    return {
        (i, j)
        for members in groups.values()
        for j, column in enumerate(table.columns)
        if column.best
        for i in _best(table, [i for i in members if i not in table.unranked], j, column.best)
    }


def _best(table: Table, members: list[int], j: int, which: str) -> list[int]:
    """Return those of some rows whose cell in column j is best, ties included."""
    sign = 1.0 if which == "least" else -1.0
    values = {i: sign * _rank(table.rows[i][j]) for i in members}
    known = {i: value for i, value in values.items() if not math.isnan(value)}
    if len(known) < 2:
        return []
    first = table.rows[min(known, key=lambda i: known[i])][j]
    return [i for i in known if _ties(table.rows[i][j], first)]


def _rank(cell: Cell) -> float:
    if isinstance(cell, Share):
        return cell.hits / cell.total if cell.total else math.nan
    return math.nan if cell is None or isinstance(cell, str) else float(cell)


def _ties(cell: Cell, best: Cell) -> bool:
    if isinstance(cell, Share) and isinstance(best, Share):
        return cell.low <= best.high and best.low <= cell.high
    return words(cell) == words(best)


def without_empty(table: Table) -> Table:
    """Return a table without columns in which nothing stands, such as remarks that nobody made."""
    filled = [j for j in range(len(table.columns)) if any(words(row[j]) for row in table.rows)]
    kept = filled or list(range(len(table.columns)))
    best = {(i, kept.index(j)) for i, j in best_cells(table) if j in kept}
    return replace(
        table,
        columns=tuple(table.columns[j] for j in kept),
        rows=tuple(tuple(row[j] for j in kept) for row in table.rows),
        best=frozenset(best),
    )


# So many columns at most name a row.
_MOST_NAMES = 3


def naming(table: Table) -> int:
    """Return how many of the first columns name a row: as few as tell all rows apart, or so."""
    last = len(table.columns) - 1
    for count in range(1, min(_MOST_NAMES, last) + 1):
        if len({row[:count] for row in table.rows}) == len(table.rows):
            return count
    in_words = itertools.takewhile(lambda column: column.words, table.columns[:last])
    return max(1, min(_MOST_NAMES, len(list(in_words))))


def listing(sentence: str, points: Iterable[str]) -> Summary:
    """Return a sentence with points below it, or nothing where there are no points."""
    made = tuple(points)
    return Summary(sentence, made) if made else NO_SUMMARY


def words(cell: Cell) -> str:
    """Return a cell as plain text: three significant digits, powers of ten as 1.2e-5."""
    if cell is None:
        return "–"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, Share):
        return _share(cell)
    if isinstance(cell, str):
        return " ".join(cell.split())
    return f"{cell:,}" if isinstance(cell, int) else _number(float(cell))


def markdown(table: Table) -> str:
    """Return the table in GitHub's Markdown, titled and explained, the best cells bold."""
    head = [_markdown(column.heading) for column in table.columns]
    rule = ["---" if column.words else "---:" for column in table.columns]
    best = best_cells(table)
    body = [
        [_bold(_markdown(words(cell)), (i, j) in best) for j, cell in enumerate(row)]
        for i, row in enumerate(table.rows)
    ]
    lines = ["| " + " | ".join(row) + " |" for row in (head, rule, *body)]
    points = "\n".join(f"- {_markdown(point)}" for point in table.summary.points)
    about = [_markdown(text) for text in (table.shows, table.measured)]
    parts = [f"# {_markdown(table.title)}", _markdown(table.summary.sentence), points, *about]
    return "\n\n".join([*filter(None, parts), "\n".join(lines)]) + "\n"


def comma_separated(table: Table) -> str:
    """Return the table as CSV, all digits kept; a share becomes hits, total and interval.

    A text that a spreadsheet would compute stands behind an apostrophe.
    """
    spread_out = [
        any(isinstance(row[i], Share) for row in table.rows) for i in range(len(table.columns))
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_csv_head(table, spread_out))
    for row in table.rows:
        writer.writerow([part for i, cell in enumerate(row) for part in _csv(cell, spread_out[i])])
    return text.getvalue()


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else NO_ANSWER
    if value == 0:
        return "0"
    power = int(f"{value:.2e}".split("e")[1])
    if power < -3 or power > 6:
        mantissa, exponent = f"{value:.1e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{float(f'{value:.3g}'):,.{max(0, 2 - power)}f}"


def _share(share: Share) -> str:
    if share.total == 0:
        return "–"
    rates = (share.hits / share.total, share.low, share.high)
    digits = max(1, len(str(share.total - 1)) - 2)  # one missed of all is seen
    percent, low, high = (_trimmed(f"{100 * rate:.{digits}f}") for rate in rates)
    return f"{share.hits}/{share.total} = {percent} % ({low}–{high})"


def _trimmed(digits: str) -> str:
    return digits.rstrip("0").rstrip(".")


# An apostrophe, or what a spreadsheet takes for a formula; not a number, nor a sign alone.
_FORMULA = re.compile(r"'|[=@＝＠]|[-+－＋](?![\d.]*$|[\d.]+e[-+]?\d+$)", re.IGNORECASE)
# Marks anywhere, and what begins a list, a rule or a heading; a number is none of these.
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>|#&~$]|^[-+=](?=[-+=\s]|$)|(?<=^\d)[.)](?=\s|$))")


def _bold(text: str, bold: bool) -> str:
    return f"**{text}**" if bold else text


def _markdown(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", " ".join(text.split()))


POWER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e(-?\d+)(?!\w)")


def _csv_head(table: Table, spread_out: list[bool]) -> list[str]:
    parts = ("hits", "total", "95 % low", "95 % high")
    head: list[str] = []
    for column, several in zip(table.columns, spread_out, strict=True):
        head += [f"{column.title}, {part}" for part in parts] if several else [column.heading]
    return [_csv_text(words(heading)) for heading in head]


def _csv(cell: Cell, spread_out: bool) -> list[Any]:
    if spread_out:
        return list(cell) if isinstance(cell, Share) else ["", "", "", ""]
    if cell is None:
        return [""]
    return [_csv_text(words(cell))] if isinstance(cell, bool | str) else [repr(cell)]


def _csv_text(text: str) -> str:
    """Return a text as a cell that no spreadsheet computes; one apostrophe less is the text."""
    return f"'{text}" if _FORMULA.match(text) else text
