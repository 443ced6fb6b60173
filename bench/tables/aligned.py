"""A table as lines of a terminal: columns are dropped before a digit or a part of a name is.

A cell that is wider than its column goes on in the next line. It is broken at spaces and dashes, in
a narrow column between any two letters, and never within a number.
"""

import functools
import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from rich.cells import cell_len

from plumbob.reference.arguments import name_list

from ..text import chunks
from .fitting import Need, assigned, fits, fitting
from .table import Table, best_cells, without_empty, words

GAP = 2
# Words are broken into pieces of so many letters where columns do not fit otherwise; where even
# that does not suffice, into those of the next.
_PIECES = (24, 10, 5)
_NUMBER = re.compile(r"([-+−]?\d[\d.,]*(?:e-?\d+)?)")
_BEST, _MISSED = "bold", "bold red"


class Span(NamedTuple):
    """A part of a line, and how it is set: plain, "bold", or red where something is missed."""

    text: str
    style: str = ""


class Aligned(NamedTuple):
    """A table as lines, and the headings of the columns that had no place in them."""

    lines: list[list[Span]]
    left_out: list[str]


def aligned(table: Table, width: int) -> Aligned:
    """Return a table in lines of at most so many letters, as long as its names and numbers are."""
    table = without_empty(table)
    shown, widths = _columns(table, width)
    best = best_cells(table)
    head = [filled(table.columns[j].heading, w) for j, w in zip(shown, widths, strict=True)]
    above = max(map(len, head))
    head = [[*[""] * (above - len(lines)), *lines] for lines in head]
    lines = _side_by_side(table, shown, widths, head, [_BEST] * len(shown))
    for i, row in enumerate(table.rows):
        missed = any(str(cell).startswith("MISSED") for cell in row)
        styles = [_MISSED if missed else _BEST if (i, j) in best else "" for j in shown]
        cells = [filled(words(row[j]), w) for j, w in zip(shown, widths, strict=True)]
        lines += _side_by_side(table, shown, widths, cells, styles)
    left_out = [column.heading for j, column in enumerate(table.columns) if j not in shown]
    return Aligned(lines, left_out)


def _columns(table: Table, width: int) -> tuple[list[int], list[int]]:
    """Return the columns that are shown and how wide each is."""
    for pieces in _PIECES:
        needs = [_need(table, j, pieces) for j in range(len(table.columns))]
        shown = fitting(table, needs, width, GAP)
        if fits([needs[j] for j in shown], width, GAP):
            break
    else:
        width = int(sum(needs[j].least for j in shown)) + GAP * (len(shown) - 1)
    whole = [max(needs[j].natural, cell_len(table.columns[j].heading)) for j in shown]
    if sum(whole) + GAP * (len(shown) - 1) <= width:
        return shown, list(map(int, whole))
    return shown, [int(w + 1e-6) for w in assigned([needs[j] for j in shown], width, GAP)]


def _need(table: Table, j: int, pieces: int) -> Need:
    """Return how wide a column is, its words broken into pieces of so many letters."""
    texts = [words(row[j]) for row in table.rows]
    heading = table.columns[j].heading
    body = max(map(cell_len, texts), default=0)
    in_pieces = [piece for text in (heading, *texts) for piece in _pieces(text, pieces)]
    least = max((cell_len(piece.rstrip()) for piece in in_pieces), default=0)
    is_words = table.columns[j].words
    if not is_words and pieces == _PIECES[0]:
        least = max(least, body)
    return Need(least, max(least, body, _in_two(heading) if not is_words else 0), is_words)


def _in_two(heading: str) -> int:
    """Return how wide a heading is in at most two lines."""
    of = heading.split()
    halves = ((" ".join(of[:i]), " ".join(of[i:])) for i in range(1, len(of)))
    return min((max(map(cell_len, both)) for both in halves), default=cell_len(heading))


def _side_by_side(
    table: Table,
    shown: Sequence[int],
    widths: Sequence[int],
    cells: Sequence[Sequence[str]],
    styles: Sequence[str],
) -> list[list[Span]]:
    """Return the lines of a row."""
    lines = []
    for k in range(max(map(len, cells), default=0)):
        line = []
        for place, (j, wide) in enumerate(zip(shown, widths, strict=True)):
            text = cells[place][k] if k < len(cells[place]) else ""
            blank = " " * (wide - cell_len(text))
            padded = text + blank if table.columns[j].words else blank + text
            line.append(Span(padded + " " * GAP * (place < len(shown) - 1), styles[place]))
        lines.append(line)
    return lines


@functools.lru_cache(maxsize=10_000)
def filled(text: str, width: int) -> Sequence[str]:
    """Return a text in lines that are no wider, but for numbers that are."""
    lines = [""]
    for piece in _pieces(text, width):
        if lines[-1] and cell_len((lines[-1] + piece).rstrip()) > width:
            lines.append("")
        lines[-1] += piece
    return [line.rstrip() for line in lines]


@functools.lru_cache(maxsize=10_000)
def _pieces(text: str, most: int) -> Sequence[str]:
    """Return what a line may be made of: words with the space behind, parts of those too long."""
    found: list[str] = []
    for token in text.split():
        parts = [token] if cell_len(token) <= most else _parts(token, most)
        found += [*parts[:-1], f"{parts[-1]} "]
    return found


def _parts(token: str, most: int) -> list[str]:
    return [
        part
        for chunk in chunks(token)
        for part in ([chunk] if cell_len(chunk) <= most else _joined(_atoms(chunk), most))
    ]


def _atoms(chunk: str) -> list[str]:
    """Return numbers as a whole and all else letter by letter."""
    return [
        atom
        for part in _NUMBER.split(chunk)
        for atom in ([part] if _NUMBER.fullmatch(part) else part)
    ]


def _joined(atoms: Iterable[str], most: int) -> list[str]:
    parts = [""]
    for atom in atoms:
        if parts[-1] and cell_len(parts[-1] + atom) > most:
            parts.append("")
        parts[-1] += atom
    return parts


def left_out(table: Table, missing: Sequence[str], shown_by: str) -> str:
    """Return a sentence on the columns that are left out, and what shows them."""
    columns = f"{len(missing)} of {len(table.columns)} columns"
    return f"{columns} left out ({name_list(missing)}); all: {shown_by}"
