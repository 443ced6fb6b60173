"""A table as LaTeX for a paper: booktabs, siunitx and tabularx, nothing below eight points.

A table is set in the largest of 10, 9 and 8 points in which it fits the width, by the number of its
letters; columns of long words share what the others leave. One that does not fit in 8 points loses
its folded columns, then stands in several parts of the same rows. Nothing is scaled.
"""

import functools
import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from ..harness.metrics import Share
from ..text import shortened
from .fitting import assigned
from .table import Cell, Table, best_cells, naming, without_empty, words
from .tex_text import breakable, escaped, pieces

# A column and a page of most journals [pt], 84 and 177 mm.
WIDTHS = {"column": 240.0, "page": 504.0}
_UNITS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}
NARROWEST, WIDEST = 160.0, 2000.0
SIZES = (10, 9, 8)
# Tables of more rows, or lines with those of the caption, break over pages.
MOST_ROWS, MOST_LINES = 40, 50
# Letters of a name, of which a paper needs no more.
_LONGEST = 200
# Words are broken into pieces of so many letters where columns do not fit otherwise.
_PIECES = (12, 6)
# The width of a letter, in units of the size: digits of Latin Modern take 0.53, bold ones 0.61.
_LETTER, _BOLD = 0.56, 0.62
# What is between two columns [pt].
_GAP = 8.0
_PACKAGES = r"% needs \usepackage{booktabs,xltabular} and siunitx of 2021 or newer (version 3)"
# Room between a caption and what stands below it, of which the classes of LaTeX leave none.
_SKIP = r"\setlength{\belowcaptionskip}{5pt}"
_NUMBERS = (
    r"\sisetup{mode=text, reset-text-series=false, reset-text-family=false, "
    r"reset-text-shape=false, group-digits=integer, group-minimum-digits=4, group-separator={,}, "
    r"output-exponent-marker=e, table-align-exponent=false}"
)
_FLEXIBLE = r">{\raggedright\arraybackslash}X"
_NUMBER = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?")


class Paper(NamedTuple):
    """How wide a table may be [pt], and whether it stands across the columns of a page."""

    width: float
    is_page: bool


def paper(width: str) -> Paper:
    """Return what is meant by "column", "page" or a length such as "120mm".

    Raises:
        ValueError: if it is none of these, or too narrow for any table.
    """
    if width in WIDTHS:
        return Paper(WIDTHS[width], width == "page")
    match = re.fullmatch(r"(\d+(?:\.\d+)?) *(pt|mm|cm|in)", width)
    points = float(match[1]) * _UNITS[match[2]] if match else 0.0
    if not NARROWEST <= points <= WIDEST:
        least = f"{NARROWEST / _UNITS['mm']:.0f}mm"
        raise ValueError(
            f"--width: expected column, page or a length of {least} or more such as 120mm, "
            f"got {width!r}"
        )
    return Paper(points, points > WIDTHS["column"])


def latex(table: Table, width: str = "page") -> str:
    """Return the table as LaTeX for a column, a page, or another width."""
    page, table = paper(width), without_empty(table)
    best = best_cells(table)
    columns = [_Typeset(table, j, best) for j in range(len(table.columns))]
    size = next((size for size in SIZES if _fits(columns, page.width, size)), SIZES[-1])
    if not _fits(columns, page.width, size):
        columns = [column for column in columns if not column.column.folded]
    parts = [_Part(table, part, page.width, size) for part in _parts(table, columns, page, size)]
    lines = sum(part.lines for part in parts) + _LETTER * SIZES[0] * len(_said(table)) / page.width
    is_long = len(table.rows) > MOST_ROWS or lines > MOST_LINES
    body = _long(table, parts, page) if is_long else _float(table, parts, page)
    return "\n".join([_PACKAGES, *_comments(table, len(columns)), *body, ""])


def _comments(table: Table, count: int) -> Iterator[str]:
    if table.shows:
        yield f"% {' '.join(table.shows.split())}"
    if left_out := len(table.columns) - count:
        yield f"% {left_out} of {len(table.columns)} columns left out, for which there is no room"


class _Typeset:
    """A column as it is typeset; widths are in units of the size of its text."""

    def __init__(self, table: Table, j: int, best: set[tuple[int, int]]) -> None:
        self.column = table.columns[j]
        self.bold = {row for row, column in best if column == j}
        self.cells = [row[j] for row in table.rows]
        self.total = _common_total(self.cells)
        self.numbers = [_is_number(cell) for cell in self.cells]
        self.is_number = any(self.numbers)
        has_words = all(cell is None or isinstance(cell, str) for cell in self.cells)
        self.is_words = not self.is_number and (self.column.words or has_words)
        self.texts = [self._text(cell) for cell in self.cells]
        self.letter = _BOLD if self.bold else _LETTER
        self.piece = _PIECES[0]

    def _text(self, cell: Cell) -> str:
        if isinstance(cell, Share):
            percent = words(cell).partition(" = ")[2].replace(" %", "")
            return percent if self.total or not percent else f"{percent} of {cell.total:,}"
        return shortened(words(cell), _LONGEST)

    def heading(self, title: str) -> str:
        unit = "%" if self.total else self.column.unit
        note = f"of {self.total:,}" if self.total else self.column.note
        title = shortened(title, _LONGEST // 3)
        return " ".join(filter(None, (title, note and f"({note})", unit and f"[{unit}]")))

    @functools.cached_property
    def format(self) -> tuple[str, str]:
        """The format of siunitx for its numbers, such as -3.4e-2, and a number that wide."""
        texts = [
            text.replace(",", "") for text, n in zip(self.texts, self.numbers, strict=True) if n
        ]
        parts = [match.groups("") for match in map(_NUMBER.fullmatch, texts) if match]
        groups = zip(*parts, strict=True)
        sign, whole, decimals, power_sign, power = (max(map(len, group)) for group in groups)
        point = f".{decimals}" if decimals else ""
        exponent = f"e{'-' * power_sign}{power}" if power else ""
        widest = sign + whole + (whole - 1) // 3 + decimals + bool(point) + power_sign + power
        return f"{'-' * sign}{whole}{point}{exponent}", "0" * (widest + bool(power))

    @functools.cached_property
    def natural(self) -> float:
        """How wide the cells are, each in one line."""
        texts = [*self.texts, self.format[1]] if self.is_number else self.texts
        return self.letter * max(map(len, texts), default=0)

    @property
    def least(self) -> float:
        """How wide it is with its heading, and the words of its cells, broken into lines."""
        title = self.heading(self.column.title).split()
        parts = [part for word in title for part in pieces(word, self.piece)]
        head = _LETTER * max(map(len, parts), default=0)
        return max(
            head, min(self.natural, self.letter * self.piece) if self.is_words else self.natural
        )

    def stacked(self, title: str, width: float) -> str:
        """Return a heading in lines of at most this width."""
        line = max(int(width / _LETTER), 1)
        words = " ".join(
            part for word in self.heading(title).split() for part in pieces(word, line)
        )
        lines = [escaped(line) for line in textwrap.wrap(words, line)]
        align = "l" if self.is_words else "r"
        return _stack(lines, align)


def _stack(lines: Sequence[str], align: str) -> str:
    if len(lines) < 2:
        return "".join(lines)
    inner = r"\\".join(lines)
    return rf"\begin{{tabular}}[b]{{@{{}}{align}@{{}}}}{inner}\end{{tabular}}"


def _fits(columns: Sequence[_Typeset], width: float, size: int) -> bool:
    """Return whether columns can stand side by side in letters of a size [pt]."""
    return size * sum(c.least for c in columns) + _GAP * (len(columns) - 1) <= width


def _parts(
    table: Table, columns: Sequence[_Typeset], page: Paper, size: int
) -> list[list[_Typeset]]:
    """Return the columns in parts that fit, each begun by those that name a row.

    Raises:
        ValueError: if the width does not suffice for one column beside those that name a row.
    """
    count = min(naming(table), len(columns) - 1)
    for piece in _PIECES:
        for column in columns:
            column.piece = piece
        parts = _filled(columns, count, page.width, size)
        if all(_fits(part, page.width, size) for part in parts):
            return parts
    raise ValueError(f"--width: expected more for a column of {table.name}, got {page.width:g}pt")


def _filled(
    columns: Sequence[_Typeset], count: int, width: float, size: int
) -> list[list[_Typeset]]:
    """Return parts that take all columns that fit, and at least one beside the names."""
    parts = [list(columns[:count])]
    for column in columns[count:]:
        if len(parts[-1]) > count and not _fits([*parts[-1], column], width, size):
            parts.append(list(columns[:count]))
        parts[-1].append(column)
    return parts


class _Part:
    """Some columns of a table side by side."""

    def __init__(self, table: Table, columns: Sequence[_Typeset], width: float, size: int) -> None:
        self.table, self.columns, self.width, self.size = table, columns, width, size
        gaps = _GAP * (len(columns) - 1)
        least, natural = zip(*((c.least, c.natural) for c in columns), strict=True)
        self.widths = assigned(least, natural, (width - gaps) / size)
        self.flexible = {j for j, wide in enumerate(self.widths) if wide < natural[j] - 1e-9}

    @property
    def environment(self) -> str:
        return "tabularx" if self.flexible else "tabular"

    @property
    def preamble(self) -> str:
        """Width, where columns share it, and columns."""
        kinds = [
            _FLEXIBLE if j in self.flexible
            else f"S[table-format={column.format[0]}]" if column.is_number
            else "l" if column.is_words else "r"
            for j, column in enumerate(self.columns)
        ]  # fmt: skip
        return f"{self.given_width}{{@{{}}{' '.join(kinds)}@{{}}}}"

    @property
    def given_width(self) -> str:
        return f"{{{self.width:.1f}pt}}" if self.flexible else ""

    @property
    def lines(self) -> int:
        """Roughly how many lines it has, four of them in its head."""
        places = [(self.columns[j], self.widths[j]) for j in self.flexible]
        return 4 + sum(
            max((math.ceil(1.2 * c.letter * len(c.texts[i]) / w) for c, w in places), default=1)
            for i in range(len(self.table.rows))
        )  # fmt: skip

    def head(self) -> list[str]:
        """Return the head: a row of groups where there are some, and one of titles."""
        runs = self._runs()
        grouped = [count > 1 for _, count in runs for _ in range(count)]
        titles = []
        for column, width, is_grouped in zip(self.columns, self.widths, grouped, strict=True):
            title = column.column.below if is_grouped else column.column.title
            titles.append(f"{{{column.stacked(title, width)}}}")
        return [*(self._groups(runs) if any(grouped) else ()), " & ".join(titles) + r" \\"]

    def _runs(self) -> list[tuple[str, int]]:
        """Return neighbours of one group: its name and how many they are."""
        runs: list[tuple[str, int]] = []
        for group in (column.column.group for column in self.columns):
            if group and runs and runs[-1][0] == group:
                runs[-1] = (group, runs[-1][1] + 1)
            else:
                runs.append((group, 1))
        return runs

    def _groups(self, runs: Sequence[tuple[str, int]]) -> list[str]:
        cells, rules, begin = [], [], 0
        for group, count in runs:
            room = sum(self.widths[begin : begin + count])
            lines = [escaped(line) for line in textwrap.wrap(group, max(int(room / _LETTER), 1))]
            if count > 1:
                cells.append(rf"\multicolumn{{{count}}}{{c}}{{{_stack(lines, 'c')}}}")
                rules.append(rf"\cmidrule(lr){{{begin + 1}-{begin + count}}}")
            else:
                cells.append("")
            begin += count
        return [" & ".join(cells) + r" \\", " ".join(rules)]

    def rows(self) -> list[str]:
        """Return the rows; a first cell that repeats the one above it is left empty."""
        lines: list[str] = []
        firsts = [row[0] for row in self.table.rows]
        grouped = len(set(firsts)) < len(firsts)
        for i, first in enumerate(firsts):
            repeats = i > 0 and first == firsts[i - 1]
            if grouped and i and not repeats:
                lines.append(r"\addlinespace")
            cells = [_cell(column, i) for column in self.columns]
            lines.append(" & ".join(["" if repeats else cells[0], *cells[1:]]) + r" \\")
        return lines or [rf"\multicolumn{{{len(self.columns)}}}{{c}}{{not measured}} \\"]


def _cell(column: _Typeset, i: int) -> str:
    bold = r"\bfseries " if i in column.bold else ""
    if column.numbers[i]:
        return bold + column.texts[i].replace(",", "")
    text = breakable(column.texts[i])
    return f"{bold}{{{text}}}" if column.is_number else bold + text


def _float(table: Table, parts: Sequence[_Part], page: Paper) -> list[str]:
    """Return a table that stands on one page, its parts below one another."""
    name = "table*" if page.is_page else "table"
    body = [rf"\begin{{{name}}}", r"\centering", _SKIP, _NUMBERS, _caption(table)]
    body += _setting(parts[0].size)
    for i, part in enumerate(parts):
        body += [r"\par\medskip"] if i else []
        body += [
            rf"\begin{{{part.environment}}}{part.preamble}",
            *(r"\toprule", *part.head(), r"\midrule", *part.rows(), r"\bottomrule"),
            rf"\end{{{part.environment}}}",
        ]
    return [*body, rf"\end{{{name}}}"]


def _long(table: Table, parts: Sequence[_Part], page: Paper) -> list[str]:
    """Return a table that breaks over pages, which needs a document of one column."""
    body = ["% breaks over pages: stands where there is one column of text", "{", _NUMBERS]
    body += [*_setting(parts[0].size), rf"\setlength{{\LTcapwidth}}{{{page.width:.1f}pt}}"]
    for i, part in enumerate(parts):
        environment = "xltabular" if part.flexible else "longtable"
        head = [r"\toprule", *part.head(), r"\midrule"]
        ordinal = f" (part {i + 1} of {len(parts)})" if parts[1:] else ""
        again = rf"\caption[]{{{breakable(shortened(table.title, _LONGEST))}{ordinal}}}"
        body += [
            *([r"\addtocounter{table}{-1}"] if i else []),
            rf"\begin{{{environment}}}{part.preamble}",
            *(rf"{again if i else _caption(table, ordinal)}\\", *head, r"\endfirsthead"),
            *(*head, r"\endhead", r"\bottomrule", r"\endfoot"),
            *(*part.rows(), rf"\end{{{environment}}}"),
        ]
    return [*body, "}"]


def _setting(size: int) -> list[str]:
    return [
        rf"\fontsize{{{size}}}{{{1.2 * size:g}}}\selectfont",
        rf"\setlength{{\tabcolsep}}{{{_GAP / 2:g}pt}}",
    ]


def _said(table: Table, ordinal: str = "") -> str:
    """Return what the caption says: set-up, samples, machine and versions."""
    title = shortened(table.title, _LONGEST)
    sentences = [
        f"{title}{ordinal}.",
        shortened(table.measured, 6 * _LONGEST),
        "Best in bold, ties too." if best_cells(table) else "",
        f"{shortened(table.provenance, 3 * _LONGEST)}." if table.provenance else "",
    ]
    return " ".join(filter(None, sentences))


def _caption(table: Table, ordinal: str = "") -> str:
    """Return caption and label."""
    title, text = shortened(table.title, _LONGEST), breakable(_said(table, ordinal))
    label = re.sub(r"[^\w:.-]", "-", table.name, flags=re.ASCII)
    return rf"\caption[{{{escaped(title)}}}]{{{text}}}\label{{tab:{label}}}"


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell)


def _common_total(cells: Iterable[Cell]) -> int:
    """Return the total that all shares of a column have in common, 0 if there is none."""
    totals = {cell.total for cell in cells if isinstance(cell, Share)}
    return totals.pop() if len(totals) == 1 else 0
