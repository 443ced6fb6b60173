"""A table as LaTeX for a paper: booktabs, siunitx and longtable, nothing below eight points.

A table is set in the largest of 10, 9 and 8 points in which it fits the width. One that does not
fit in 8 points loses its folded columns, then stands in several parts of the same rows: rotated, it
would fit a page but no column, and could not be read beside the text. Nothing is scaled.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from ..harness.metrics import Share
from .fitting import Need, assigned, fits, fitting, parts
from .tables import Cell, Table, best_cells, naming, words
from .tex_text import NARROW, breakable, chunks, escaped, wide
from .text import shortened

# A column and a page of most journals [pt], 84 and 177 mm.
WIDTHS = {"column": 240.0, "page": 504.0}
_UNITS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}
NARROWEST = 160.0
SIZES = (10, 9, 8)
# More rows than these stand in a table that may break over pages, and so does what is higher [pt].
MOST_ROWS = 40
_HIGHEST = 430.0
# Letters of a name, of which a paper needs no more.
_LONGEST = 200
# Half of what is between two columns [pt].
_BETWEEN = 4.0
_LEAD = 1.2
_PACKAGES = r"% needs \usepackage{booktabs,longtable} and siunitx of 2021 or newer (version 3)"
_NUMBERS = (
    r"\sisetup{mode=text, reset-text-series=false, reset-text-family=false, "
    r"reset-text-shape=false, group-digits=integer, group-minimum-digits=4, group-separator={,}, "
    r"output-exponent-marker=e}"
)

_NUMBER = re.compile(r"-?\d[\d,]*(\.\d+)?(e-?\d+)?")


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
    if not NARROWEST <= points <= 2000.0:
        least = f"{NARROWEST / _UNITS['mm']:.0f}mm"
        raise ValueError(
            f"--width: expected column, page or a length of {least} or more such as 120mm, "
            f"got {width!r}"
        )
    return Paper(points, points > WIDTHS["column"])


def latex(table: Table, width: str = "page") -> str:
    """Return the table as LaTeX for a column, a page, or another width."""
    page = paper(width)
    size, numbers = _size(table, page)
    columns = [_Typeset(table, j, size) for j in range(len(table.columns))]
    made = _parts(table, [columns[j] for j in numbers], page.width, size)
    is_long = len(table.rows) > MOST_ROWS or sum(part.height for part in made) > _HIGHEST
    about = [_PACKAGES, *_comments(table, len(numbers))]
    body = _long(table, made, page, size) if is_long else _float(table, made, page, size)
    return "\n".join([*about, *body, ""])


def _size(table: Table, page: Paper) -> tuple[int, list[int]]:
    """Return the size of the text [pt] and the columns that are set in it."""
    every = list(range(len(table.columns)))
    for size in SIZES:
        needs = [_Typeset(table, j, size).need for j in every]
        comfortable = [Need(min(n.natural, max(n.least, 9.0 * size)), n.natural) for n in needs]
        if fits(comfortable, page.width, 2 * _BETWEEN):
            return size, every
    if fits(needs, page.width, 2 * _BETWEEN):
        return SIZES[-1], every
    return SIZES[-1], fitting(table, needs, float("inf"), 2 * _BETWEEN)


def _comments(table: Table, shown: int) -> Iterator[str]:
    if table.shows:
        yield f"% {' '.join(table.shows.split())}"
    if left_out := len(table.columns) - shown:
        yield f"% {left_out} of {len(table.columns)} columns left out, for which there is no room"


class _Typeset:
    """A column as it is typeset: its cells with their widths, and how wide it has to be."""

    def __init__(self, table: Table, j: int, size: int) -> None:
        self.j, self.size, self.column = j, size, table.columns[j]
        self.bold = {row for row, column in best_cells(table) if column == j}
        self.cells = [row[j] for row in table.rows]
        self.of_all = _common_total(self.cells)
        self.is_number = any(_is_number(cell) for cell in self.cells)
        self.texts = [self._text(cell) for cell in self.cells]

    def _text(self, cell: Cell) -> str:
        if isinstance(cell, Share):
            percent = words(cell).partition(" = ")[2].replace(" %", "")
            return percent if self.of_all or not percent else f"{percent} of {cell.total:,}"
        return shortened(words(cell), _LONGEST)

    @property
    def heading(self) -> str:
        return self._headed(self.column.title)

    @property
    def below(self) -> str:
        return self._headed(self.column.below)

    def _headed(self, title: str) -> str:
        unit = "%" if self.of_all else self.column.unit
        note = f"of {self.of_all:,}" if self.of_all else self.column.note
        parts = (title, f"({note})" if note else "", f"[{unit}]" if unit else "")
        return " ".join(filter(None, parts))

    @property
    def format(self) -> str:
        """What siunitx's column is told of its numbers: -3.4e-2."""
        found = [split for text in self._numbers if (split := _split(text))]
        sign = "-" if any(sign for sign, *_ in found) else ""
        whole, decimals, exponent = (max(len(part[i]) for part in found) for i in (1, 2, 3))
        exponents = [part[3] for part in found if part[3]]
        sign_of_exponent = "-" if any(e.startswith("-") for e in exponents) else ""
        exponent = max((len(e.lstrip("-")) for e in exponents), default=0)
        return (
            f"{sign}{whole}" + (f".{decimals}" if decimals else "")
            + (f"e{sign_of_exponent}{exponent}" if exponent else "")
        )  # fmt: skip

    @property
    def _numbers(self) -> list[str]:
        return [text for text, cell in zip(self.texts, self.cells, strict=True) if _is_number(cell)]

    @property
    def body(self) -> float:
        """How wide the cells are [pt], each in one line."""
        widths = [wide(text, i in self.bold) for i, text in enumerate(self.texts)]
        if self.is_number:
            widths.append(self._format_width(bool(self.bold)))
        return self.size * max(widths, default=0.0)

    def _format_width(self, bold: bool) -> float:
        found = re.fullmatch(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?", self.format)
        assert found
        whole, decimals, exponent = (int(found[i] or 0) for i in (2, 3, 5))
        text = ("−" if found[1] else "") + "0" * whole + "," * ((whole - 1) // 3)
        text += ("." + "0" * decimals if decimals else "") + ("e" if exponent else "")
        return wide(text + ("−" if found[4] else "") + "0" * exponent, bold)

    @property
    def need(self) -> Need:
        """The widths at which it can be set, with head and texts broken into lines."""
        head = self._head
        two = self.size * _in_two(self.heading)
        if not self.column.words or self.is_number:
            return Need(max(head, self.body), max(two, self.body))
        longest = max((wide(c) for text in self.texts for c in chunks(text)), default=0.0)
        least = max(head, min(self.body, self.size * min(longest, 2 * NARROW)))
        return Need(least, max(least, two, self.body))

    @property
    def narrow(self) -> Need:
        """The widths at which it can be set where words are broken between any two letters."""
        least, natural = self.need
        if self.is_number or not self.column.words:
            return Need(least, natural)
        return Need(max(self._head, min(least, NARROW * self.size)), natural)

    @property
    def _head(self) -> float:
        """How wide the widest word of the head is [pt]."""
        return self.size * max(map(wide, self.heading.split()), default=0.0)


class _Part:
    """Some columns of a table side by side, as wide as they are set."""

    def __init__(
        self, table: Table, columns: Sequence[_Typeset], widths: Sequence[float], size: int
    ) -> None:
        self.table, self.columns, self.widths, self.size = table, columns, widths, size

    @property
    def preamble(self) -> str:
        made = []
        for column, width in zip(self.columns, self.widths, strict=True):
            if column.is_number:
                made.append(f"S[table-format={column.format}]")
            elif not column.column.words:
                made.append("r")
            elif column.body <= width:
                made.append("l")
            else:
                made.append(rf">{{\raggedright\arraybackslash}}p{{{width:.1f}pt}}")
        return f"@{{}}{' '.join(made)}@{{}}"

    @property
    def height(self) -> float:
        """Roughly how high it is [pt]."""
        lines = 4.0
        for i in range(len(self.table.rows)):
            high = [
                1 + int(1.25 * self.size * wide(column.texts[i]) / width)
                for column, width in zip(self.columns, self.widths, strict=True)
                if column.column.words and column.body > width
            ]
            lines += max(high, default=1)
        return _LEAD * self.size * lines

    def head(self) -> list[str]:
        """Return the head: a row of groups where there are some, and one of titles."""
        groups = self._groups()
        titles = [
            self._title(column, width, grouped)
            for column, width, grouped in zip(
                self.columns, self.widths, self._in_group(), strict=True
            )
        ]
        last = " & ".join(titles) + r" \\"
        return [*groups, last]

    def _in_group(self) -> list[bool]:
        return [count > 1 for _, count in self._runs() for _ in range(count)]

    def _runs(self) -> list[tuple[str, int]]:
        """Return neighbours of one group: its name and how many they are."""
        runs: list[tuple[str, int]] = []
        for column in self.columns:
            group = column.column.group
            if group and runs and runs[-1][0] == group:
                runs[-1] = (group, runs[-1][1] + 1)
            else:
                runs.append((group, 1))
        return runs

    def _groups(self) -> list[str]:
        if not any(self._in_group()):
            return []
        cells, rules, begin = [], [], 0
        for group, count in self._runs():
            room = sum(self.widths[begin : begin + count]) + 2 * _BETWEEN * (count - 1)
            if count > 1:
                stacked = _stacked(_lines(group, room / self.size), "c")
                cells.append(rf"\multicolumn{{{count}}}{{c}}{{{stacked}}}")
                rules.append(rf"\cmidrule(lr){{{begin + 1}-{begin + count}}}")
            else:
                cells.append("")
            begin += count
        return [" & ".join(cells) + r" \\", " ".join(rules)]

    def _title(self, column: _Typeset, width: float, grouped: bool) -> str:
        heading = column.below if grouped else column.heading
        align = "l" if column.column.words else "r"
        stacked = _stacked(_lines(heading, width / self.size), align)
        return f"{{{stacked}}}" if align == "l" or column.is_number else stacked

    def rows(self) -> list[str]:
        """Return the rows; a first cell that repeats the one above it is left empty."""
        lines: list[str] = []
        previous: Cell = None
        firsts = [row[0] for row in self.table.rows]
        grouped = len(set(firsts)) < len(firsts)
        for i, first in enumerate(firsts):
            repeats = bool(lines) and first == previous
            if grouped and lines and not repeats:
                lines.append(r"\addlinespace")
            cells = [
                "" if k == 0 and repeats else self._cell(column, i, width)
                for k, (column, width) in enumerate(zip(self.columns, self.widths, strict=True))
            ]
            lines.append(" & ".join(cells) + r" \\")
            previous = first
        return lines or [rf"\multicolumn{{{len(self.columns)}}}{{c}}{{not measured}} \\"]

    def _cell(self, column: _Typeset, i: int, width: float) -> str:
        bold = r"\bfseries " if i in column.bold else ""
        if column.is_number and _is_number(column.cells[i]):
            return bold + column.texts[i].replace(",", "")
        text = breakable(column.texts[i], width / column.size)
        return f"{bold}{{{text}}}" if column.is_number else bold + text


def _parts(table: Table, columns: Sequence[_Typeset], width: float, size: int) -> list[_Part]:
    """Return the columns in as few parts as fit, names broken anywhere if they must be.

    Raises:
        ValueError: if the width does not suffice for one column beside those that name a row.
    """
    names = min(naming(table), len(columns))
    for needs in ([c.need for c in columns], [c.narrow for c in columns]):
        groups = parts(names, range(len(columns)), needs, width, 2 * _BETWEEN)
        if all(fits([needs[j] for j in group], width, 2 * _BETWEEN) for group in groups):
            chosen = ([columns[j] for j in group] for group in groups)
            fitted = (assigned([needs[j] for j in g], width, 2 * _BETWEEN) for g in groups)
            return [_Part(table, c, w, size) for c, w in zip(chosen, fitted, strict=True)]
    raise ValueError(f"--width: expected more for a column of {table.name}, got {width:g}pt")


def _float(table: Table, made: Sequence[_Part], page: Paper, size: int) -> list[str]:
    """Return a table that stands on one page, its parts below one another."""
    name = "table*" if page.is_page else "table"
    body = [rf"\begin{{{name}}}", r"\centering", _NUMBERS, _caption(table, page), *_setting(size)]
    for i, part in enumerate(made):
        body += [r"\par\medskip"] if i else []
        body += [
            rf"\begin{{tabular}}{{{part.preamble}}}",
            *(r"\toprule", *part.head(), r"\midrule", *part.rows(), r"\bottomrule"),
            r"\end{tabular}",
        ]
    return [*body, rf"\end{{{name}}}"]


def _long(table: Table, made: Sequence[_Part], page: Paper, size: int) -> list[str]:
    """Return a table that breaks over pages, which needs a document of one column."""
    body = ["% a longtable: stands where there is one column of text", "{", _NUMBERS]
    body += [*_setting(size), rf"\setlength{{\LTcapwidth}}{{{page.width:.1f}pt}}"]
    for i, part in enumerate(made):
        head = [r"\toprule", *part.head(), r"\midrule"]
        ordinal = f" (part {i + 1} of {len(made)})" if made[1:] else ""
        body += [r"\addtocounter{table}{-1}"] if i else []
        again = rf"\caption[]{{{escaped(table.title)}{ordinal}}}"
        caption = again if i else _caption(table, page, ordinal)
        body += [
            *(rf"\begin{{longtable}}{{{part.preamble}}}", rf"{caption}\\", *head, r"\endfirsthead"),
            *(*head, r"\endhead", r"\bottomrule", r"\endfoot"),
            *(*part.rows(), r"\end{longtable}"),
        ]
    return [*body, "}"]


def _setting(size: int) -> list[str]:
    lead = f"{_LEAD * size:g}"
    return [
        rf"\fontsize{{{size}}}{{{lead}}}\selectfont",
        rf"\setlength{{\tabcolsep}}{{{_BETWEEN:g}pt}}",
    ]


def _caption(table: Table, page: Paper, ordinal: str = "") -> str:
    """Return caption and label: set-up, samples, machine and versions."""
    sentences = [f"{table.title}{ordinal}.", table.measured]
    if best_cells(table):
        sentences.append("Best in bold, ties too.")
    if table.provenance:
        sentences.append(f"{table.provenance}.")
    text = breakable(" ".join(filter(None, sentences)), 0.8 * page.width / SIZES[0])
    return rf"\caption[{{{escaped(table.title)}}}]{{{text}}}\label{{tab:{_label(table.name)}}}"


def _label(name: str) -> str:
    return re.sub(r"[^\w:.-]", "-", name, flags=re.ASCII)


def _is_number(cell: Cell) -> bool:
    is_number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return is_number and _NUMBER.fullmatch(words(cell)) is not None


def _split(text: str) -> tuple[str, str, str, str] | None:
    """Return sign, whole digits, decimals and exponent of a number."""
    found = re.fullmatch(r"(-?)([\d,]+)(?:\.(\d+))?(?:e(-?\d+))?", text)
    return found and (found[1], found[2].replace(",", ""), found[3] or "", found[4] or "")


def _common_total(cells: Iterable[Cell]) -> int:
    """Return the total that all shares of a column have in common, 0 if there is none."""
    totals = {cell.total for cell in cells if isinstance(cell, Share)}
    return totals.pop() if len(totals) == 1 else 0


def _in_two(heading: str) -> float:
    """Return how wide a heading is in at most two lines, as even as can be."""
    tokens = heading.split()
    lines = ((" ".join(tokens[:i]), " ".join(tokens[i:])) for i in range(1, len(tokens)))
    return min((max(map(wide, both)) for both in lines), default=wide(heading))


def _lines(text: str, most: float) -> list[str]:
    """Return a heading in lines that are no wider, but for words that are."""
    lines: list[str] = []
    for token in text.split():
        if lines and wide(f"{lines[-1]} {token}") <= most:
            lines[-1] += f" {token}"
        else:
            lines.append(token)
    return lines


def _stacked(lines: Sequence[str], align: str) -> str:
    if len(lines) < 2:
        return "".join(map(escaped, lines))
    inner = r"\\".join(map(escaped, lines))
    return rf"\begin{{tabular}}[b]{{@{{}}{align}@{{}}}}{inner}\end{{tabular}}"
