"""A table as lines of a terminal: columns are left out before a number or a name is cut."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from plumbob.text.printable import harmless

from .table import Table, best_cells, column_widths, naming, without_empty, words

GAP = 2  # letters between columns
# Longer words may be broken, into parts of the next length where columns do not fit otherwise.
_PARTS = (24, 10, 5)


class AlignedTable(NamedTuple):
    """A table as styled lines."""

    lines: list[Text]  # of text
    widths: list[int]  # of the columns, with `GAP` between them
    left_out: list[str]  # the headings of the columns that did not fit


def aligned(table: Table, width: int) -> AlignedTable:
    """Return a table in lines of at most this width, unless its names and numbers are longer."""
    table = without_empty(table)
    columns, lowest = _fitting(table, width)
    natural = [max(low, _natural_width(table, j)) for j, low in zip(columns, lowest, strict=True)]
    headings = [cell_len(table.columns[j].heading) for j in columns]
    full = list(map(max, natural, headings))
    space = width - GAP * (len(columns) - 1)
    if sum(full) > space:
        full = [wide + 1e-9 for wide in column_widths(lowest, natural, space)]
    widths = list(map(int, full))
    lines = _lines(_grid(table, columns, widths), sum(widths) + GAP * len(columns))
    left_out = [column.heading for j, column in enumerate(table.columns) if j not in columns]
    return AlignedTable(lines, widths, left_out)


def _fitting(table: Table, width: int) -> tuple[list[int], list[float]]:
    """Return the columns that fit, and the lowest width of each.

    The columns that name a row always stay, with one other column; folded columns never stay. The
    others are left out from the right, columns with best cells last.
    """
    names = naming(table)
    for part in _PARTS:
        lowest = {j: _lowest_width(table, j, part) for j in range(len(table.columns))}
        columns = [j for j in lowest if j < names or not table.columns[j].folded]
        for j in sorted(columns[names:], key=lambda j: (bool(table.columns[j].best), -j)):
            if _fits([lowest[j] for j in columns], width) or len(columns) <= names + 1:
                break
            columns.remove(j)
        if _fits([lowest[j] for j in columns], width):
            break
    return columns, [lowest[j] for j in columns]


def _fits(widths: Sequence[float], width: int) -> bool:
    return sum(widths) + GAP * (len(widths) - 1) <= width


def _lowest_width(table: Table, j: int, part: int) -> float:
    """Return the lowest width of a column: numbers are never broken, words only if long."""
    texts = [words(row[j]) for row in table.rows]
    tokens = table.columns[j].heading.split()
    if not table.columns[j].words and part == _PARTS[0]:
        return max(map(cell_len, [*texts, *tokens]), default=0)
    tokens += [token for text in texts for token in text.split()]
    return max((min(cell_len(token), part) for token in tokens), default=0)


def _natural_width(table: Table, j: int) -> int:
    """Return the width of the cells in a line, and of a heading over numbers in two."""
    widest = max((cell_len(words(row[j])) for row in table.rows), default=0)
    tokens = table.columns[j].heading.split()
    if table.columns[j].words or not tokens:
        return widest
    halves = ((" ".join(tokens[:i]), " ".join(tokens[i:])) for i in range(len(tokens)))
    return max(widest, min(max(map(cell_len, lines)) for lines in halves))


def _grid(table: Table, columns: Sequence[int], widths: Sequence[int]) -> Grid:
    grid = Grid(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style="bold")
    for j, width in zip(columns, widths, strict=True):
        column = table.columns[j]
        grid.add_column(
            Text(column.heading),
            width=width,
            overflow="fold",
            justify="left" if column.words else "right",
        )
    best = best_cells(table)
    for i, row in enumerate(table.rows):
        is_missed = any(str(cell).startswith("MISSED") for cell in row)
        styles = ["bold red" if is_missed else "bold" * ((i, j) in best) for j in columns]
        cells = zip(columns, styles, strict=True)
        grid.add_row(*(Text(words(row[j]), style) for j, style in cells))
    return grid


def _lines(grid: Grid, width: int) -> list[Text]:
    lines = []
    for segments in _console(width).render_lines(grid, pad=False):
        line = Text.assemble(*((segment.text, segment.style or "") for segment in segments))
        line.rstrip()
        safe = harmless(line.plain)
        lines.append(line if safe == line.plain else Text(safe))
    return lines


@functools.lru_cache(maxsize=100)
def _console(width: int) -> Console:
    return Console(width=width, color_system="standard", legacy_windows=False)


def filled(text: str, width: int) -> list[str]:
    """Return a text in lines of at most this width."""
    plain = Text(" ".join(text.split()))
    return [harmless(line.plain.rstrip()) for line in plain.wrap(_console(width), width)] or [""]
