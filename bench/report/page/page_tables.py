"""A table on the page: cells as markup, an address for each row, folded columns."""

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from ...figures.sketch import Drawing
from ...harness.metrics import Share
from ...tables.results import label
from ...tables.table import Cell, Column, Source, Summary, Table, best_cells, words
from ...tables.writers import POWER


class PageHead(NamedTuple):
    """A heading: its classes, the best of the column, and whether it filters rows.

    `lead` is the part of the title that the heading of its group repeats, and is hidden.
    """

    column: Column
    classes: str
    best: str
    filter: bool
    lead: str
    rest: str


class PageCell(NamedTuple):
    """A cell as markup; numbers and shares also as digits, for sorting."""

    tag: str
    text: Markup
    classes: str
    digits: str
    ties: bool


class PageRow(NamedTuple):
    """A row: its address within the page, its cells, and the command that measures it again."""

    address: str
    cells: list[PageCell]
    command: str


class PageTable(NamedTuple):
    """A table on the page."""

    name: str  # its address within the page
    question: str  # that it answers
    table: Table  # whose cells it shows
    # name and span of headings above several columns; empty if there are none
    groups: list[tuple[str, int]]
    heads: list[PageHead]  # headings of the columns
    rows: list[PageRow]  # its rows
    best: str  # "best" if some cells are best, "ties" if some of them tie, else ""
    gist: str  # its message in a line
    drawings: list[Drawing]  # figures beside it


def page_table(
    question: str, table: Table, drawings: Sequence[Drawing], unfolded: int | None = None
) -> PageTable:
    """Return a table for the page, with at most so many unfolded columns."""
    solver, best = _solver_column(table), best_cells(table)
    open_columns = [j for j, column in enumerate(table.columns) if not column.folded][:unfolded]
    heads = []
    for j, column in enumerate(table.columns):
        marks = ("words" * column.words, "folded" * (j not in open_columns), "who" * (j == solver))
        lead = column.title.removesuffix(column.below) if column.group else ""
        heads.append(
            PageHead(
                column,
                " ".join(filter(None, marks)),
                column.best,
                j < table.compared or j in (0, solver),
                lead,
                column.titled.removeprefix(lead),
            )
        )
    rows = _rows(table, heads, best)
    groups: list[tuple[str, int]] = []
    if any(column.group for column in table.columns):
        runs = itertools.groupby(table.columns, key=lambda column: column.group)
        groups = [(name, len(list(columns))) for name, columns in runs]
    has_ties = any(cell.ties for row in rows for cell in row.cells)
    mark = "ties" if has_ties else "best" * bool(best)
    message = gist(table.summary)
    return PageTable(
        table.name, question, table, groups, heads, rows, mark, message, list(drawings)
    )


def gist(summary: Summary) -> str:
    """Return a summary in a line: of a list only the first point."""
    if not summary.sentence.endswith(":") or not summary.points:
        return summary.sentence
    return f"{summary.sentence} {summary.points[0]}" + ("; …" if len(summary.points) > 1 else "")


def _solver_column(table: Table) -> int | None:
    """Return the column that names the solver of each row, None if there is none."""
    titles = [column.title for column in table.columns]
    if "solver" in titles:
        return titles.index("solver")
    return next((j for j in range(len(titles)) if _names_solvers(table, j)), None)


def _names_solvers(table: Table, j: int) -> bool:
    pairs = zip(table.rows, table.sources, strict=bool(table.sources))
    cells = [(row[j], source.solvers) for row, source in pairs if source.solvers]
    return bool(cells) and all(
        len(names) == 1 and cell in (*names, label(names[0])) for cell, names in cells
    )


def _rows(table: Table, heads: Sequence[PageHead], best: set[tuple[int, int]]) -> list[PageRow]:
    """Return the rows; a first cell that repeats the cell above it is marked."""
    ties = Counter((table.rows[i][: table.compared], j) for i, j in best)
    rows: list[PageRow] = []
    addresses = Counter[str]()
    for i, row in enumerate(table.rows):
        cells = []
        for j, (cell, head) in enumerate(zip(row, heads, strict=True)):
            marks = [head.classes]
            if head.column.title == "verdict":
                marks.append("held" if cell == "held" else "missed")
            is_tie = (i, j) in best and ties[row[: table.compared], j] > 1
            marks += ["best" * ((i, j) in best), "tie" * is_tie]
            if j == 0 and i and cell == table.rows[i - 1][0]:
                marks.append("same")
            classes = " ".join(filter(None, marks))
            tag = "td" if j else "th"
            cells.append(PageCell(tag, rich(words(cell)), classes, _digits(cell), is_tie))
        address = _address(table, row)
        addresses[address] += 1
        number = f":{addresses[address]}" if addresses[address] > 1 else ""
        source = table.sources[i] if table.sources else Source()
        rows.append(PageRow(f"{address}{number}", cells, source.command))
    return rows


def _address(table: Table, row: Sequence[Cell]) -> str:
    """Return the address of a row, from the words in its first cells."""
    pairs = zip(row, table.columns, strict=True)
    texts = [words(cell) for cell, _ in itertools.takewhile(lambda pair: pair[1].words, pairs)]
    texts = texts[:3] or list(map(words, row[:2]))
    slug = re.sub(r"[^a-z0-9]+", "-", " ".join(texts).lower()).strip("-")[:60]
    return f"{table.name}:{slug or 'row'}"


def _digits(cell: Cell) -> str:
    """Return a number to six digits, a share as its four parts, "" for words."""
    if isinstance(cell, Share):
        return "/".join(map(_digits, cell))
    if isinstance(cell, float):
        return f"{cell:.6g}"
    return str(cell) if isinstance(cell, int) and not isinstance(cell, bool) else ""


def rich(text: str) -> Markup:
    """Return escaped text with powers of ten as superscripts."""
    return Markup(POWER.sub(_power, str(Markup.escape(text))))


def _power(match: re.Match[str]) -> str:
    mantissa, exponent = match[1].replace("-", "−"), match[2].replace("-", "−")
    return f'<span class="number">{mantissa} · 10<sup>{exponent}</sup></span>'
