"""A table on the page: aligned numbers, bars, an address for each row, folded columns."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from ..figures.sketch import Drawing
from ..measure.metrics import Share
from ..tables.columns import extent_in_words
from ..tables.results import label
from ..tables.table import Cell, Source, Table, best_cells, decimals, number_of, words
from ..tables.writers import POWER, csv_names

# The column replaced by the page's switch between one start and restarts.
STARTS = "starts"
# Spaces as wide as a digit and as a decimal point.
_DIGIT, _POINT = "\u2007", "\u2008"


class PageHead(NamedTuple):
    """A heading: its classes, the best of the column, and whether it filters rows.

    `lead` is the part of the title repeated in the heading of its group, and hidden. `unit` is the
    unit of numbers, or the number of trials behind shares. `names` are those of its columns in CSV.
    """

    classes: str
    best: str
    filter: bool
    lead: str
    rest: str
    unit: str
    names: str


class PageCell(NamedTuple):
    """A cell as markup; numbers and shares also as digits for sorting, and as a bar [%]."""

    text: Markup
    classes: str
    digits: str
    bar: str


class PageRow(NamedTuple):
    """A row: its address within the page, its cells, its start, and the command that repeats it."""

    address: str
    cells: list[PageCell]
    start: str
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
    marks: set[str]  # the classes of its cells, such as "best" and "tie"
    drawings: list[Drawing]  # figures beside it


def page_table(
    question: str, table: Table, drawings: Sequence[Drawing], unfolded: int | None = None
) -> PageTable:
    """Return a table for the page, with at most so many unfolded columns."""
    solver = _solver_column(table)
    is_folded = [column.folded or column.title == STARTS for column in table.columns]
    visible = [j for j, folded in enumerate(is_folded) if not folded][:unfolded]
    heads = [_head(table, j, j not in visible, j == solver) for j in range(len(table.columns))]
    rows = _rows(table)
    groups: list[tuple[str, int]] = []
    if any(column.group for column in table.columns):
        runs = itertools.groupby(table.columns, key=lambda column: column.group)
        groups = [(name, len(list(columns))) for name, columns in runs]
    marks = {mark for row in rows for cell in row.cells for mark in cell.classes.split()}
    return PageTable(table.name, question, table, groups, heads, rows, marks, list(drawings))


def _head(table: Table, j: int, folded: bool, names_solver: bool) -> PageHead:
    """Return the heading of a column."""
    column = table.columns[j]
    marks = ("words" * column.words, "folded" * folded, "who" * names_solver)
    lead = column.title.removesuffix(column.below) if column.group else ""
    has_filter = (j < table.compared or j == 0 or names_solver) and column.title != STARTS
    sizes = extent_in_words({cell.total for row in table.rows if isinstance(cell := row[j], Share)})
    unit = f"n = {sizes}" if sizes else column.unit and f"[{column.unit}]"
    title = column.titled.removeprefix(lead)
    classes = " ".join(filter(None, marks))
    names = ",".join(csv_names(column, is_share=bool(sizes)))
    return PageHead(classes, column.best, has_filter, lead, title, unit, names)


def _solver_column(table: Table) -> int | None:
    """Return the column that names the solver of each row, None without any."""
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


def _rows(table: Table) -> list[PageRow]:
    """Return the rows; a first cell equal to the cell above is marked."""
    best = best_cells(table)
    ties = Counter((table.rows[i][: table.compared], j) for i, j in best)
    columns, titles = range(len(table.columns)), [column.title for column in table.columns]
    texts, bars = [_texts(table, j) for j in columns], [_bars(table, j) for j in columns]
    rows: list[PageRow] = []
    addresses = Counter[str]()
    for i, row in enumerate(table.rows):
        cells = []
        for j, cell in enumerate(row):
            is_tie = (i, j) in best and ties[row[: table.compared], j] > 1
            is_same = j == 0 and i > 0 and cell == table.rows[i - 1][0]
            marks = ["best" * ((i, j) in best), "tie" * is_tie, "same" * is_same]
            if titles[j] == "verdict":
                marks.append("held" if cell == "held" else "missed")
            classes = " ".join(filter(None, marks))
            cells.append(PageCell(texts[j][i], classes, _digits(cell), bars[j][i]))
        address = _address(table, row)
        addresses[address] += 1
        number = f":{addresses[address]}" if addresses[address] > 1 else ""
        start = words(row[titles.index(STARTS)]) if STARTS in titles else ""
        source = table.sources[i] if table.sources else Source()
        rows.append(PageRow(f"{address}{number}", cells, start, source.command))
    return rows


def _texts(table: Table, j: int) -> list[Markup]:
    """Return the cells of a column, their decimal points below each other."""
    texts = [words(row[j]) for row in table.rows]
    plain = [not isinstance(row[j], str | Share) and "e" not in words(row[j]) for row in table.rows]
    decimals = [len(text.partition(".")[2]) for text in texts]
    places = max(itertools.compress(decimals, plain), default=0)
    markups = []
    for row, text, is_plain, count in zip(table.rows, texts, plain, decimals, strict=True):
        padding = _POINT * (count == 0 < places) + _DIGIT * (places - count) if is_plain else ""
        markup = _share(cell) if isinstance(cell := row[j], Share) else rich(text)
        markups.append(markup + padding)
    return markups


def _share(share: Share) -> Markup:
    """Return a share with its interval, rounded as in other texts, with all of its decimals."""
    if not share.total:
        return Markup("–")
    rates, digits = (share.hits / share.total, share.low, share.high), decimals(share.total)
    rate, low, high = (f"{100 * rate:.{digits}f}" for rate in rates)
    title = f"{words(share.hits)} of {words(share.total)}"
    return Markup(f'<span title="{title}">{rate} %</span> <small>({low}–{high})</small>')


def _bars(table: Table, j: int) -> list[str]:
    """Return shares, and results relative to the best of their group, as lengths of bars [%]."""
    column, numbers = table.columns[j], [number_of(row[j]) for row in table.rows]
    groups = [row[: table.compared] for row in table.rows]
    firsts: dict[tuple[Cell, ...], float] = {}
    for group, number in zip(groups, numbers, strict=True):
        if not math.isnan(number):
            pick = max if column.best == "greatest" else min
            firsts[group] = pick(number, firsts.get(group, number))
    bars = []
    for row, group, number in zip(table.rows, groups, numbers, strict=True):
        if isinstance(row[j], Share):
            length = number
        elif column.best and number > 0:
            first = firsts[group]
            length = number / first if column.best == "greatest" else first / number
        else:
            length = math.nan
        bars.append("" if math.isnan(length) else f"{100 * length:.3g}")
    return bars


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
