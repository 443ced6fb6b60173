"""A table as LaTeX for a paper: booktabs, siunitx and tabularx, nothing below eight points.

The size is the largest of 10, 9 and 8 points in which the table fits the width, by the number of
letters; columns of long words share the remaining space. A table that is too wide in 8 points loses
its folded columns, and is then split into several parts of the same rows; one that is too long for
a page becomes several tables. Rows without a number, as of absent solvers, are left out.
"""

import itertools
import math
import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace

from plumbob.text.printable import shortened

from ..harness.metrics import Share
from .table import Cell, Table, best_cells, column_widths, naming, without_empty, words
from .tex_text import breakable, escaped, word_parts

# A column and a page of most journals [pt], 84 and 177 mm.
WIDTHS = {"column": 240.0, "page": 504.0}
_UNITS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}
NARROWEST, WIDEST = 160.0, 2000.0
SIZES = (10, 9, 8)
# Lines of a page without caption, head and rules; more rows stand in another table.
MAX_LINES = 44
# The most letters of a name.
_LONGEST = 200
# Words are broken into parts of at most so many letters where columns do not fit otherwise.
_WORD_PARTS = (12, 6)
# Width of a letter in units of the size: digits of Latin Modern take 0.53, bold ones 0.61.
_LETTER, _BOLD = 0.56, 0.62
# Between two columns [pt].
_GAP = 8.0
_PACKAGES = r"% needs \usepackage{booktabs,tabularx} and siunitx of 2021 or newer (version 3)"
# Space below a caption, which the classes of LaTeX do not leave.
_SKIP = r"\setlength{\belowcaptionskip}{5pt}"
_NUMBERS = (
    r"\sisetup{mode=text, reset-text-series=false, reset-text-family=false, "
    r"reset-text-shape=false, group-digits=integer, group-minimum-digits=4, group-separator={,}, "
    r"output-exponent-marker=e, table-align-exponent=false}"
)
_FLEXIBLE = r">{\raggedright\arraybackslash}X"
_NUMBER = re.compile(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?")


def paper(width: str) -> tuple[float, bool]:
    """Return a width [pt], from "column", "page" or "120mm", and whether it spans a page.

    Raises:
        ValueError: if it is none of these, or too narrow for any table.
    """
    if width in WIDTHS:
        return WIDTHS[width], width == "page"
    match = re.fullmatch(r"(\d+(?:\.\d+)?) *(pt|mm|cm|in)", width)
    points = float(match[1]) * _UNITS[match[2]] if match else 0.0
    if not NARROWEST <= points <= WIDEST:
        raise ValueError(
            f"--width: expected column, page or a length of {NARROWEST / _UNITS['mm']:.0f}mm or "
            f"more such as 120mm, got {width!r}"
        )
    return points, points > WIDTHS["column"]


def latex(table: Table, width: str = "page") -> str:
    """Return the table as LaTeX for a column, a page, or another width."""
    (points, is_page), count = paper(width), len(table.rows)
    table = without_empty(_measured(table))
    best = best_cells(table)
    columns = [_TexColumn(table, j, best) for j in range(len(table.columns))]
    size = next((size for size in SIZES if _fits(columns, points, size)), SIZES[-1])
    if not _fits(columns, points, size):
        columns = [column for column in columns if not column.column.folded]
    parts = [_TexPart(table, part, points, size) for part in _split(table, columns, points, size)]
    comments = [f"% {' '.join(table.shows.split())}"] if table.shows else []
    if left_out := count - len(table.rows):
        comments.append(f"% {left_out} of {count} rows left out: they hold no number")
    if left_out := len(table.columns) - len(columns):
        comments.append(f"% {left_out} of {len(table.columns)} columns left out: no space for them")
    body = _floats(table, parts, "table*" if is_page else "table", points)
    return "\n".join([_PACKAGES, *comments, *body, ""])


def _measured(table: Table) -> Table:
    """Return a table without the rows that hold no number, unless it holds none at all."""
    numbers = [j for j, column in enumerate(table.columns) if not column.words]
    rows = [i for i, row in enumerate(table.rows) if any(row[j] is not None for j in numbers)]
    if not rows:
        return table
    best = frozenset((rows.index(i), j) for i, j in best_cells(table) if i in rows)
    return replace(table, rows=tuple(table.rows[i] for i in rows), best=best, sources=())


class _TexColumn:
    """A typeset column; widths are in units of the size of its text."""

    def __init__(self, table: Table, j: int, best: set[tuple[int, int]]) -> None:
        self.column = table.columns[j]
        cells = [row[j] for row in table.rows]
        totals = {cell.total for cell in cells if isinstance(cell, Share)}
        self.total = totals.pop() if len(totals) == 1 else 0  # that all shares have in common
        self.bold = {row for row, column in best if column == j}
        self.numbers = [_is_number(cell) for cell in cells]
        self.is_number = any(self.numbers)
        has_words = all(cell is None or isinstance(cell, str) for cell in cells)
        self.is_words = not self.is_number and (self.column.words or has_words)
        self.texts = [self._text(cell) for cell in cells]
        self.letter = _BOLD if self.bold else _LETTER
        self.part = _WORD_PARTS[0]
        longest = max(map(len, self.texts), default=0)
        self.format = ""
        if self.is_number:
            self.format, digits = self._number_format()
            longest = max(longest, digits)
        self.natural = self.letter * longest  # each cell in one line

    def _text(self, cell: Cell) -> str:
        if isinstance(cell, Share):
            percent = words(cell).partition(" = ")[2].replace(" %", "")
            return percent if self.total or not percent else f"{percent} of {cell.total:,}"
        return shortened(words(cell), _LONGEST)

    def _number_format(self) -> tuple[str, int]:
        """Return siunitx's format of its numbers, such as -3.4e-2, and its width in digits."""
        numbers = zip(self.texts, self.numbers, strict=True)
        matches = (
            _NUMBER.fullmatch(text.replace(",", "")) for text, is_number in numbers if is_number
        )
        groups = zip(*(match.groups("") for match in matches if match), strict=True)
        sign, whole, decimals, power_sign, power = (max(map(len, group)) for group in groups)
        point = f".{decimals}" if decimals else ""
        exponent = f"e{'-' * power_sign}{power}" if power else ""
        digits = sign + whole + (whole - 1) // 3 + decimals + bool(point) + power_sign + power
        return f"{'-' * sign}{whole}{point}{exponent}", digits + bool(power)

    def heading(self, title: str) -> str:
        """Return a title with note and unit; a common total is the note of shares in percent."""
        unit = "%" if self.total else self.column.unit
        note = f"of {self.total:,}" if self.total else self.column.note
        title = shortened(title, _LONGEST // 3)
        return " ".join(filter(None, (title, note and f"({note})", unit and f"[{unit}]")))

    @property
    def lowest(self) -> float:
        """The width with heading and words broken into lines."""
        tokens = self.heading(self.column.title).split()
        parts = [part for token in tokens for part in word_parts(token, self.part)]
        head = _LETTER * max(map(len, parts), default=0)
        return max(
            head, min(self.natural, self.letter * self.part) if self.is_words else self.natural
        )

    def stacked(self, title: str, width: float) -> str:
        """Return a heading in lines of at most this width."""
        letters = max(int(width / _LETTER), 1)
        tokens = self.heading(title).split()
        parts = " ".join(part for token in tokens for part in word_parts(token, letters))
        return _stack(textwrap.wrap(parts, letters), "l" if self.is_words else "r")

    def cell(self, i: int) -> str:
        """Return the cell of a row."""
        bold = r"\bfseries " if i in self.bold else ""
        if self.numbers[i]:
            return bold + self.texts[i].replace(",", "")
        text = breakable(self.texts[i])
        return f"{bold}{{{text}}}" if self.is_number else bold + text


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell)


def _stack(lines: Sequence[str], align: str) -> str:
    """Return lines below each other."""
    inner = r"\\".join(map(escaped, lines))
    if len(lines) < 2:
        return inner
    return rf"\begin{{tabular}}[b]{{@{{}}{align}@{{}}}}{inner}\end{{tabular}}"


def _fits(columns: Sequence[_TexColumn], width: float, size: int) -> bool:
    """Return whether columns fit side by side in letters of a size [pt]."""
    return size * sum(c.lowest for c in columns) + _GAP * (len(columns) - 1) <= width


def _split(
    table: Table, columns: Sequence[_TexColumn], width: float, size: int
) -> list[list[_TexColumn]]:
    """Return the columns in parts that fit, each begun by the columns that name a row."""
    count = min(naming(table), len(columns) - 1)
    for letters in _WORD_PARTS:
        for column in columns:
            column.part = letters
        parts = [list(columns[:count])]
        for column in columns[count:]:
            if len(parts[-1]) > count and not _fits([*parts[-1], column], width, size):
                parts.append(list(columns[:count]))
            parts[-1].append(column)
        if all(_fits(part, width, size) for part in parts):
            return parts
    raise ValueError(f"--width: expected more for a column of {table.name}, got {width:g}pt")


class _TexPart:
    """Some columns of a table side by side."""

    def __init__(
        self, table: Table, columns: Sequence[_TexColumn], width: float, size: int
    ) -> None:
        self.table, self.columns, self.size = table, columns, size
        lowest, natural = zip(*((c.lowest, c.natural) for c in columns), strict=True)
        self.widths = column_widths(lowest, natural, (width - _GAP * (len(columns) - 1)) / size)
        self.flexible = {j for j, wide in enumerate(self.widths) if wide < natural[j] - 1e-9}
        kinds = [
            _FLEXIBLE if j in self.flexible
            else f"S[table-format={column.format}]" if column.is_number
            else "l" if column.is_words else "r"
            for j, column in enumerate(columns)
        ]  # fmt: skip
        width_argument = f"{{{width:.1f}pt}}" if self.flexible else ""
        self.preamble = f"{width_argument}{{@{{}}{' '.join(kinds)}@{{}}}}"

    def height(self, i: int) -> int:
        """Return the approximate number of lines of a row."""
        broken = [(self.columns[j], self.widths[j]) for j in self.flexible]
        lines = (math.ceil(1.2 * c.letter * len(c.texts[i]) / width) for c, width in broken)
        return max(lines, default=1)

    def head(self) -> list[str]:
        """Return the head: the groups if there are any, and the titles."""
        groups = itertools.groupby(
            enumerate(self.columns), key=lambda pair: pair[1].column.group or pair[0]
        )
        runs = [[j for j, _ in members] for _, members in groups]
        titles, cells, rules = [], [], []
        for run in runs:
            for j in run:
                column = self.columns[j]
                title = column.column.below if run[1:] else column.column.title
                titles.append(f"{{{column.stacked(title, self.widths[j])}}}")
            if not run[1:]:
                cells.append("")
                continue
            letters = max(int(sum(self.widths[j] for j in run) / _LETTER), 1)
            group = _stack(textwrap.wrap(self.columns[run[0]].column.group, letters), "c")
            cells.append(rf"\multicolumn{{{len(run)}}}{{c}}{{{group}}}")
            rules.append(rf"\cmidrule(lr){{{run[0] + 1}-{run[-1] + 1}}}")
        lines = [" & ".join(cells) + r" \\", " ".join(rules)] if rules else []
        return [*lines, " & ".join(titles) + r" \\"]

    def rows(self, places: range) -> list[str]:
        """Return some rows; a first cell that repeats the cell above it is left empty."""
        lines: list[str] = []
        firsts = [row[0] for row in self.table.rows]
        is_grouped = len(set(firsts)) < len(firsts)
        for i in places:
            repeats = i > places.start and firsts[i] == firsts[i - 1]
            if is_grouped and i > places.start and not repeats:
                lines.append(r"\addlinespace")
            cells = [column.cell(i) for column in self.columns]
            lines.append(" & ".join(["" if repeats else cells[0], *cells[1:]]) + r" \\")
        return lines or [rf"\multicolumn{{{len(self.columns)}}}{{c}}{{not measured}} \\"]


def _floats(table: Table, parts: Sequence[_TexPart], name: str, width: float) -> list[str]:
    """Return tables that fit a page each, the note below the last."""
    note, body = breakable(_note(table)), []
    pieces = _pieces(table, parts, math.ceil(_LETTER * SIZES[-1] * len(note) / width))
    for k, piece in enumerate(pieces):
        ordinal = f" (part {k + 1} of {len(pieces)})" if pieces[1:] else ""
        body += [rf"\begin{{{name}}}", r"\centering", _SKIP, _NUMBERS, _caption(table, ordinal, k)]
        body += _setting(parts[0].size)
        for part, rows in piece:
            body += [*([r"\par\medskip"] if part is not piece[0][0] else []), *_tabular(part, rows)]
        if note and piece is pieces[-1]:
            body += [r"\par\smallskip", rf"\begin{{minipage}}{{{width:.1f}pt}}\raggedright"]
            body += [*_setting(SIZES[-1])[:1], note, r"\end{minipage}"]
        body.append(rf"\end{{{name}}}")
    return body


def _pieces(
    table: Table, parts: Sequence[_TexPart], note: int
) -> list[list[tuple[_TexPart, range]]]:
    """Return parts and rows of each table; the last has a note of so many lines."""
    rows = range(len(table.rows))
    heights = sum(4 + sum(map(part.height, rows)) for part in parts)
    if heights + note <= MAX_LINES:
        return [[(part, rows) for part in parts]]
    pieces = []
    for part in parts:
        ends, space = [len(rows)], MAX_LINES - note * (part is parts[-1])
        for i in reversed(rows):
            space -= part.height(i)
            if space < 0 and i + 1 < ends[-1]:
                ends.append(i + 1)
                space = MAX_LINES - part.height(i)
        limits = itertools.pairwise([0, *reversed(ends)])
        pieces += [[(part, range(*limit))] for limit in limits]
    return pieces


def _tabular(part: _TexPart, rows: range) -> list[str]:
    environment = "tabularx" if part.flexible else "tabular"
    begin, end = rf"\begin{{{environment}}}{part.preamble}", rf"\end{{{environment}}}"
    return [begin, r"\toprule", *part.head(), r"\midrule", *part.rows(rows), r"\bottomrule", end]


def _setting(size: int) -> list[str]:
    return [
        rf"\fontsize{{{size}}}{{{1.2 * size:g}}}\selectfont",
        rf"\setlength{{\tabcolsep}}{{{_GAP / 2:g}pt}}",
    ]


def _note(table: Table) -> str:
    """Return the note below a table: set-up, samples, machine and versions."""
    sentences = [
        shortened(table.measured, 6 * _LONGEST),
        "Best in bold, ties too." if best_cells(table) else "",
        f"{shortened(table.provenance, 3 * _LONGEST)}." if table.provenance else "",
    ]
    return " ".join(filter(None, sentences))


def _caption(table: Table, ordinal: str, number: int) -> str:
    """Return caption and, of the first part, label."""
    title = shortened(table.title, _LONGEST)
    label = re.sub(r"[^\w:.-]", "-", table.name, flags=re.ASCII)
    caption = rf"\caption[{{{escaped(title)}}}]{{{breakable(f'{title}{ordinal}.')}}}"
    return caption + ("" if number else rf"\label{{tab:{label}}}")
