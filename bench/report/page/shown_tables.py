"""A table as the page shows it: cells as markup, an address for each row, columns folded."""

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from ...figures.sketch import Drawing
from ...harness.metrics import Share
from ...tables.results import label
from ...tables.table import POWER, Cell, Column, Source, Summary, Table, best_cells, words


class Head(NamedTuple):
    """The heading of a column: its classes, what is best in it, whether rows are filtered by it.

    What its title has from the heading of its group leads, and is not seen.
    """

    column: Column
    classes: str
    best: str
    filter: bool

    @property
    def lead(self) -> str:
        """What stands in the heading of its group already."""
        return self.column.title.removesuffix(self.column.below) if self.column.group else ""

    @property
    def rest(self) -> str:
        """What does not."""
        return self.column.titled.removeprefix(self.lead)


class Group(NamedTuple):
    """A heading that neighbouring columns have in common."""

    name: str
    span: int


class ShownCell(NamedTuple):
    """A cell as markup, and its value to six digits where it is a number or a share."""

    tag: str
    text: Markup
    classes: str
    value: str
    ties: bool


class Row(NamedTuple):
    """A row: its address within the page, its cells, and the command that measures it again."""

    id: str
    cells: list[ShownCell]
    command: str


class ShownTable(NamedTuple):
    """A table as the page shows it.

    Attributes:
        name: its address within the page.
        question: what it answers.
        table: what it is made of.
        groups: headings that columns have in common, none where no columns have one.
        heads: headings of the columns.
        rows: its rows.
        best: "best" if cells are marked as best, "ties" if some of them tie, else "".
        gist: what it says, in a line.
        drawings: figures beside it.
    """

    name: str
    question: str
    table: Table
    groups: list[Group]
    heads: list[Head]
    rows: list[Row]
    best: str
    gist: str
    drawings: list[Drawing]


def shown_table(
    question: str, table: Table, drawings: Sequence[Drawing], most: int | None = None
) -> ShownTable:
    """Return a table for the page; all but `most` of its columns are folded."""
    solver, best = _solver_column(table), best_cells(table)
    classes = _column_classes(table, most, solver)
    rows = _rows(table, classes, best)
    heads = [
        Head(column, of, column.best, j < table.compared or j in (0, solver))
        for j, (column, of) in enumerate(zip(table.columns, classes, strict=True))
    ]
    return ShownTable(
        table.name,
        question,
        table,
        _groups(table),
        heads,
        rows,
        "ties" if any(cell.ties for row in rows for cell in row.cells) else "best" * bool(best),
        gist(table.summary),
        list(drawings),
    )


def gist(summary: Summary) -> str:
    """Return what is said in a line: of a list that is announced, the first point."""
    if not summary.sentence.endswith(":") or not summary.points:
        return summary.sentence
    return f"{summary.sentence} {summary.points[0]}" + ("; …" if len(summary.points) > 1 else "")


def _column_classes(table: Table, most: int | None, solver: int | None) -> list[str]:
    """Return the classes of each column: set as words, folded, names who."""
    unfolded = [j for j, column in enumerate(table.columns) if not column.folded][:most]
    said = (
        ("words" * column.words, "folded" * (j not in unfolded), "who" * (j == solver))
        for j, column in enumerate(table.columns)
    )
    return [" ".join(filter(None, classes)) for classes in said]


def _groups(table: Table) -> list[Group]:
    """Return the headings in common, none where no columns have one."""
    if not any(column.group for column in table.columns):
        return []
    runs = itertools.groupby(table.columns, key=lambda column: column.group)
    return [Group(name, len(list(columns))) for name, columns in runs]


def _solver_column(table: Table) -> int | None:
    """Return the column that names the solver of each row, None if there is none."""
    titled = [j for j, column in enumerate(table.columns) if column.title == "solver"]
    named = [j for j in range(len(table.columns)) if _names_solvers(table, j)]
    return next(iter([*titled, *named]), None)


def _names_solvers(table: Table, j: int) -> bool:
    named = zip(table.rows, table.sources, strict=bool(table.sources))
    found = [(row[j], source.solvers) for row, source in named if source.solvers]
    return bool(found) and all(
        len(names) == 1 and cell in (*names, label(names[0])) for cell, names in found
    )


def _rows(table: Table, classes: Sequence[str], best: set[tuple[int, int]]) -> list[Row]:
    """Return the rows; a first cell that says the same as the one above is marked so."""
    several = Counter((table.rows[i][: table.compared], j) for i, j in best)
    made, before, named = [], None, Counter[str]()
    for i, row in enumerate(table.rows):
        cells = [
            _cell(cell, j, column, classes[j], several[row[: table.compared], j] * ((i, j) in best))
            for j, (cell, column) in enumerate(zip(row, table.columns, strict=True))
        ]
        if row[0] == before:
            cells[0] = cells[0]._replace(classes=f"{cells[0].classes} same".strip())
        source = table.sources[i] if table.sources else Source()
        made.append(Row(_address(table, row, named), cells, source.command))
        before = row[0]
    return made


def _address(table: Table, row: Sequence[Cell], named: Counter[str]) -> str:
    """Return the address of a row, made of what its first words say; no two are alike."""
    leading = itertools.takewhile(lambda pair: pair[1].words, zip(row, table.columns, strict=True))
    said = [words(cell) for cell, _ in leading][:3] or list(map(words, row[:2]))
    slug = re.sub(r"[^a-z0-9]+", "-", " ".join(said).lower()).strip("-")[:60] or "row"
    named[slug] += 1
    return f"{table.name}:{slug}" + (f":{named[slug]}" if named[slug] > 1 else "")


def _cell(cell: Cell, j: int, column: Column, classes: str, best: int) -> ShownCell:
    """Return a cell; `best` counts those that are best with it, 0 if it is not."""
    more = [_verdict(cell) if column.title == "verdict" else "", "best" if best else ""]
    of = " ".join(filter(None, [classes, *more, "tie" if best > 1 else ""]))
    return ShownCell("td" if j else "th", rich(words(cell)), of, _value(cell), best > 1)


def _verdict(cell: Cell) -> str:
    return "held" if cell == "held" else "missed"


def _value(cell: Cell) -> str:
    """Return a number to six digits, a share as its four parts, "" for anything else.

    The files beside the page hold all digits.
    """
    if isinstance(cell, Share):
        return "/".join(map(_value, cell))
    if isinstance(cell, float):
        return f"{cell:.6g}"
    return str(cell) if isinstance(cell, int) and not isinstance(cell, bool) else ""


def rich(text: str) -> Markup:
    """Return escaped text in which powers of ten are set as such."""
    return Markup(POWER.sub(_power, str(Markup.escape(text))))


def _power(match: re.Match[str]) -> str:
    mantissa, exponent = match[1].replace("-", "−"), match[2].replace("-", "−")
    return f'<span class="number">{mantissa} · 10<sup>{exponent}</sup></span>'
