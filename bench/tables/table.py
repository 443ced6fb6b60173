"""A table as a value: columns, rows, best cells, and the text of a cell."""

import itertools
import math
import re
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ..measure.metrics import Share

Cell = str | int | float | bool | Share | None


class Summary(NamedTuple):
    """The message of a table: a sentence, and points below; empty without a message."""

    sentence: str = ""
    points: tuple[str, ...] = ()


NO_SUMMARY = Summary()

# The note of a column of shares.
INTERVAL = "95 % interval"
# How an infinite number is written: as far from the target as a solver without an answer.
NO_ANSWER = "no answer"
# One metre, second, radian, byte or whole in other units.
UNITS = {"ms": 1e3, "µs": 1e6, "ns": 1e9, "°": 180.0 / math.pi, "%": 100.0, "GiB": 2.0**-30}
# The most problems or solvers in a command, and the most columns that name a row.
MAX_OPTIONS, _MAX_NAMES = 3, 3


def in_unit(value: float, unit: str) -> float:
    """Return a value in SI units, or a share of 1, in a unit like "ms", "°" or "ns/solve"."""
    return UNITS.get(unit.partition("/")[0], 1.0) * value


@dataclass(frozen=True)
class Column:
    """A column: its heading, and how a cell is read from the subject of a row."""

    title: str  # of the column
    unit: str = ""  # of its numbers
    words: bool = False  # whether the cells are text, aligned left
    # format of a cell, for example `INTERVAL`; left out where its parts have own columns
    note: str = ""
    # returns the cell of a subject, in SI units or as a share of 1
    read: Callable[[Any], Any] = field(default=lambda subject: subject, compare=False)
    best: str = ""  # "least" or "greatest", "" if no cell is best
    group: str = ""  # common heading of neighbouring columns
    folded: bool = False  # whether the column is shown on demand only

    def cell(self, subject: Any) -> Cell:
        """Return the cell of the row of this subject, in the column's unit."""
        value = self.read(subject)
        plain: Cell = value.item() if hasattr(value, "item") else value
        return in_unit(plain, self.unit) if isinstance(plain, float) else plain

    @property
    def below(self) -> str:
        """The title below the heading of its group: "median" below "residual"."""
        return self.title.removeprefix(self.group).lstrip(",: ") or self.title

    @property
    def titled(self) -> str:
        """Title and note."""
        return f"{self.title} ({self.note})" if self.note else self.title

    @property
    def heading(self) -> str:
        """Title, note and unit."""
        return f"{self.titled} [{self.unit}]" if self.unit else self.titled


class Source(NamedTuple):
    """The measurements behind a row: their suite, problems and solvers."""

    suite: str = ""
    problems: tuple[str, ...] = ()
    solvers: tuple[str, ...] = ()

    @property
    def command(self) -> str:
        """The command to measure the row again, "" without measurements.

        For a row of many problems or solvers, the command measures the whole suite.
        """
        options = []
        for option, names in (("--solver", self.solvers), ("--problem", self.problems)):
            if len(names) <= MAX_OPTIONS:
                options += [word for name in names for word in (option, name)]
        return shlex.join(["plumbob", "bench", self.suite, *options]) if self.suite else ""


def cells(columns: Sequence[Column], subjects: Iterable[Any]) -> tuple[tuple[Cell, ...], ...]:
    """Return a row of cells for each subject."""
    return tuple(tuple(column.cell(subject) for column in columns) for subject in subjects)


@dataclass(frozen=True)
class Table:
    """A named table."""

    name: str  # the stem of its files
    title: str  # its heading
    columns: tuple[Column, ...]  # with distinct headings; the first names the row
    rows: tuple[tuple[Cell, ...], ...]  # the cells; None without measurements
    shows: str = ""  # a sentence on the contents
    measured: str = ""  # a sentence on how the numbers were measured
    summary: Summary = NO_SUMMARY  # generated from the numbers
    compared: int = 1  # rows with so many equal first cells are compared; 0: all are
    # numbers of rows that are never best, for example a solver cut short
    unranked: frozenset[int] = frozenset()
    sources: tuple[Source, ...] = ()  # the measurements behind each row; empty if unknown
    provenance: str = ""  # number of samples, machine and versions
    # row and column of the best cells, if not by the columns
    best: frozenset[tuple[int, int]] | None = None

    @property
    def note(self) -> str:
        """The first sentence on the contents, printed below the table on the page."""
        return re.split(r"(?<=[.?!]) (?=[A-Z“])", self.shows, maxsplit=1)[0]

    def __post_init__(self) -> None:
        """Check that headings are distinct, and rows and sources complete."""
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
    """Return whether a table has no rows, or has columns of numbers without any number."""
    numbers = [j for j, column in enumerate(table.columns) if not column.words]
    return not table.rows or (
        bool(numbers) and all(row[j] is None for row in table.rows for j in numbers)
    )


def best_cells(table: Table) -> set[tuple[int, int]]:
    """Return row and column of each cell that is best among the compared rows.

    Ties are all best: shares whose intervals overlap with the best's interval, or numbers written
    alike. Where all rows tie, as in a single row, no cell is best.
    """
    if table.best is not None:
        return set(table.best)
    groups: dict[tuple[Cell, ...], list[int]] = {}
    for i, row in enumerate(table.rows):
        if i not in table.unranked:
            groups.setdefault(row[: table.compared], []).append(i)
    return {
        (i, j)
        for members in groups.values()
        for j, column in enumerate(table.columns)
        if column.best
        for i in _best_rows(table, members, j)
    }


def _best_rows(table: Table, members: list[int], j: int) -> list[int]:
    """Return the rows of a group that are best in column j."""
    sign = 1.0 if table.columns[j].best == "least" else -1.0
    numbers = {i: sign * number_of(table.rows[i][j]) for i in members}
    ranked = {i: number for i, number in numbers.items() if not math.isnan(number)}
    first = min(ranked, key=lambda i: ranked[i], default=0)
    best = [i for i in ranked if _ties(table.rows[i][j], table.rows[first][j])]
    return best if len(best) < len(ranked) else []


def ranked_rows(table: Table) -> list[int]:
    """Return the numbers of the rows, in each group of compared rows the best first.

    The first column that has best cells decides, then the next; unranked rows come last.
    """
    signs = {
        j: -1.0 if c.best == "greatest" else 1.0 for j, c in enumerate(table.columns) if c.best
    }
    groups: dict[tuple[Cell, ...], int] = {}

    def rank(i: int) -> tuple[int, bool, list[float]]:
        group = groups.setdefault(table.rows[i][: table.compared], len(groups))
        numbers = (sign * number_of(table.rows[i][j]) for j, sign in signs.items())
        return group, i in table.unranked, [math.inf if math.isnan(x) else x for x in numbers]

    return sorted(range(len(table.rows)), key=rank) if signs else [*range(len(table.rows))]


def with_rows(table: Table, places: Sequence[int]) -> Table:
    """Return a table with the rows of these numbers, in their order."""
    best = table.best
    return replace(
        table,
        rows=tuple(table.rows[i] for i in places),
        unranked=frozenset(new for new, i in enumerate(places) if i in table.unranked),
        best=best
        and frozenset((new, j) for new, i in enumerate(places) for k, j in best if k == i),
        sources=tuple(table.sources[i] for i in places) if table.sources else (),
    )


def number_of(cell: Cell) -> float:
    """Return a cell as a number: a share as a part of 1, NaN for words or without trials."""
    if isinstance(cell, Share):
        return cell.hits / cell.total if cell.total else math.nan
    return math.nan if cell is None or isinstance(cell, str) else float(cell)


def _ties(cell: Cell, best: Cell) -> bool:
    if isinstance(cell, Share) and isinstance(best, Share):
        return cell.low <= best.high and best.low <= cell.high
    return words(cell) == words(best)


def with_columns(table: Table, numbers: Sequence[int]) -> Table:
    """Return a table with the columns of these numbers, and the best cells as before."""
    best = ((i, numbers.index(j)) for i, j in best_cells(table) if j in numbers)
    rows = tuple(tuple(row[j] for j in numbers) for row in table.rows)
    columns = tuple(table.columns[j] for j in numbers)
    return replace(table, columns=columns, rows=rows, best=frozenset(best))


def without_empty(table: Table) -> Table:
    """Return a table without empty columns."""
    numbers = range(len(table.columns))
    filled = [j for j in numbers if any(words(row[j]) for row in table.rows)]
    return with_columns(table, filled or numbers)


def naming(table: Table) -> int:
    """Return how many of the first columns name a row: as few as distinguish all rows."""
    last = len(table.columns) - 1
    for count in range(1, min(_MAX_NAMES, last) + 1):
        if len({row[:count] for row in table.rows}) == len(table.rows):
            return count
    texts = itertools.takewhile(lambda column: column.words, table.columns[:last])
    return max(1, min(_MAX_NAMES, len(list(texts))))


def column_widths(lowest: Sequence[float], natural: Sequence[float], space: float) -> list[float]:
    """Return widths of columns to fill a space, each between its lowest and natural width.

    Columns in need of little more get their natural width; the others share the rest evenly.
    """
    widths, spare = list(lowest), space - sum(lowest)
    needs = [max(0.0, wide - narrow) for narrow, wide in zip(lowest, natural, strict=True)]
    for place, j in enumerate(sorted(range(len(widths)), key=lambda j: needs[j])):
        share = max(0.0, min(needs[j], spare / (len(widths) - place)))
        widths[j] += share
        spare -= share
    return widths


def listing(sentence: str, points: Iterable[str]) -> Summary:
    """Return a summary of a sentence and points, empty without points."""
    listed = tuple(points)
    return Summary(sentence, listed) if listed else NO_SUMMARY


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


def _number(number: float) -> str:
    if not math.isfinite(number):
        return "not a number" if math.isnan(number) else NO_ANSWER
    if number == 0:
        return "0"
    power = int(f"{number:.2e}".split("e")[1])
    if power < -3 or power > 6:
        mantissa, exponent = f"{number:.1e}".split("e")
        return f"{mantissa}e{int(exponent)}"
    return f"{float(f'{number:.3g}'):,.{max(0, 2 - power)}f}"


def _share(share: Share) -> str:
    if share.total == 0:
        return "–"
    rates = (share.hits / share.total, share.low, share.high)
    rate, low, high = (percent(rate, share.total) for rate in rates)
    return f"{share.hits:,}/{share.total:,} = {rate} % ({low}–{high})"


def percent(rate: float, total: int) -> str:
    """Return a share of so many trials in per cent: "96.7", never "100" if one is missed."""
    return f"{100 * rate:.{decimals(total)}f}".rstrip("0").rstrip(".")


def decimals(total: int) -> int:
    """Return the decimals of a share of so many trials in per cent, by which one miss shows."""
    return max(1, len(str(total - 1)) - 2)
