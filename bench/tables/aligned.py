"""A table as lines of a terminal: columns are dropped before a digit or a part of a name is."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text

from plumbob.reference.arguments import name_list

from .fitting import assigned
from .table import Table, best_cells, naming, without_empty, words

GAP = 2
# Longer words may be broken, into pieces of the next length where columns do not fit otherwise.
_PIECES = (24, 10, 5)
_BEST, _MISSED = "bold", "bold red"


class Aligned(NamedTuple):
    """A table as lines, and the headings of the columns that had no place in them.

    Attributes:
        lines: the lines, styled.
        widths: how wide each column is, with `GAP` between them.
        left_out: the headings of the columns that had no place.
    """

    lines: list[Text]
    widths: list[int]
    left_out: list[str]


def aligned(table: Table, width: int) -> Aligned:
    """Return a table in lines of at most so many letters, as long as its names and numbers are."""
    table = without_empty(table)
    columns, least = _fitting(table, width)
    natural = [max(low, _natural(table, j)) for j, low in zip(columns, least, strict=True)]
    room = width - GAP * (len(columns) - 1)
    widths = [int(wide + 1e-9) for wide in assigned(least, natural, room)]
    if (
        sum(whole := [max(w, _heading(table, j)) for j, w in zip(columns, natural, strict=True)])
        <= room
    ):
        widths = [int(wide) for wide in whole]
    lines = _lines(_grid(table, columns, widths), sum(widths) + GAP * len(columns))
    left_out = [column.heading for j, column in enumerate(table.columns) if j not in columns]
    return Aligned(lines, widths, left_out)


def _fitting(table: Table, width: int) -> tuple[list[int], list[float]]:
    """Return the columns that are shown, and the least width of each.

    Those that name a row always are, and one more; folded ones never are. The others are dropped
    from the right, those in which something is best last.
    """
    names = naming(table)
    for piece in _PIECES:
        least = {j: _least(table, j, piece) for j in range(len(table.columns))}
        columns = [j for j in least if j < names or not table.columns[j].folded]
        for j in sorted(columns[names:], key=lambda j: (bool(table.columns[j].best), -j)):
            if _fits([least[j] for j in columns], width) or len(columns) <= names + 1:
                break
            columns.remove(j)
        if _fits([least[j] for j in columns], width):
            break
    return columns, [least[j] for j in columns]


def _fits(widths: Sequence[float], width: int) -> bool:
    return sum(widths) + GAP * (len(widths) - 1) <= width


def _least(table: Table, j: int, piece: int) -> float:
    """Return the least width of a column: a number is never broken, a word only if it is long."""
    cells = [words(row[j]) for row in table.rows]
    tokens = table.columns[j].heading.split()
    if not table.columns[j].words and piece == _PIECES[0]:
        return max(map(cell_len, [*cells, *tokens]), default=0)
    tokens += [token for cell in cells for token in cell.split()]
    return max((min(cell_len(token), piece) for token in tokens), default=0)


def _natural(table: Table, j: int) -> int:
    """Return the width of the cells in one line, with a heading over numbers in two."""
    body = max((cell_len(words(row[j])) for row in table.rows), default=0)
    if table.columns[j].words:
        return body
    tokens = table.columns[j].heading.split()
    halves = [(" ".join(tokens[:i]), " ".join(tokens[i:])) for i in range(len(tokens))]
    return max(body, min((max(map(cell_len, both)) for both in halves), default=0))


def _heading(table: Table, j: int) -> int:
    return cell_len(table.columns[j].heading)


def _grid(table: Table, columns: Sequence[int], widths: Sequence[int]) -> Grid:
    grid = Grid(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style=_BEST)
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
        missed = any(str(cell).startswith("MISSED") for cell in row)
        styles = [_MISSED if missed else _BEST if (i, j) in best else "" for j in columns]
        cells = zip(columns, styles, strict=True)
        grid.add_row(*(Text(words(row[j]), style) for j, style in cells))
    return grid


def _lines(grid: Grid, width: int) -> list[Text]:
    console = _console(width)
    lines = []
    for segments in console.render_lines(grid, pad=False):
        line = Text.assemble(*((segment.text, segment.style or "") for segment in segments))
        line.rstrip()
        lines.append(line)
    return lines


@functools.lru_cache(maxsize=100)
def _console(width: int) -> Console:
    return Console(width=width, color_system="standard", legacy_windows=False)


def filled(text: str, width: int) -> list[str]:
    """Return a text in lines that are no wider."""
    plain = Text(" ".join(text.split()))
    return [line.plain.rstrip() for line in plain.wrap(_console(width), width)] or [""]


def left_out(table: Table, missing: Sequence[str], shown_by: str) -> str:
    """Return a sentence on the columns that are left out, and what shows them."""
    columns = f"{len(missing)} of {len(table.columns)} columns"
    return f"{columns} left out ({name_list(missing)}); all: {shown_by}"
