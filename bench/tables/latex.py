"""A table as LaTeX for a paper: booktabs, siunitx and longtable, nothing below eight points.

A table is set in the largest of 10, 9 and 8 points in which it fits the width. One that does not
fit in 8 points loses its folded columns, then stands in several parts of the same rows: rotated, it
would fit a page but no column, and could not be read beside the text. Nothing is scaled.
"""

import functools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from ..harness.metrics import Share
from ..text import chunks, shortened
from .fitting import Need, assigned, fits, fitting, parts
from .table import Cell, Table, best_cells, naming, without_empty, words
from .tex_text import NARROW, breakable, escaped, fragments, wide

# A column and a page of most journals [pt], 84 and 177 mm.
WIDTHS = {"column": 240.0, "page": 504.0}
_UNITS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}
NARROWEST = 160.0
SIZES = (10, 9, 8)
# More rows than these stand in a table that may break over pages, and so does what is higher [pt].
MOST_ROWS = 40
_HIGHEST = 545.0
# Letters of a name, of which a paper needs no more.
_LONGEST = 200
# Half of what is between two columns [pt].
_BETWEEN = 4.0
_LEAD = 1.2
# Words are set in smaller letters before their column is narrower than this, in units of the size.
_COMFORT = 9.0
_PACKAGES = r"% needs \usepackage{booktabs,longtable} and siunitx of 2021 or newer (version 3)"
# Room between a caption and what stands below it, of which the classes of LaTeX leave none.
_SKIP = r"\setlength{\belowcaptionskip}{5pt}"
_NUMBERS = (
    r"\sisetup{mode=text, reset-text-series=false, reset-text-family=false, "
    r"reset-text-shape=false, group-digits=integer, group-minimum-digits=4, group-separator={,}, "
    r"output-exponent-marker=e, table-align-exponent=false}"
)

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
    if not NARROWEST <= points <= 2000.0:
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
    size, numbers = _size(table, columns, page.width)
    made = _parts(table, [columns[j] for j in numbers], page.width, size)
    caption = _caption_height(table, page)
    is_long = len(table.rows) > MOST_ROWS or caption + sum(p.height for p in made) > _HIGHEST
    about = [_PACKAGES, *_comments(table, len(numbers))]
    body = _long(table, made, page, size) if is_long else _float(table, made, page, size)
    return "\n".join([*about, *body, ""])


def _size(table: Table, columns: Sequence["_Typeset"], width: float) -> tuple[int, list[int]]:
    """Return the size of the text [pt] and the columns that are set in it."""
    needs, every = [column.need for column in columns], list(range(len(columns)))
    comfortable = [
        Need(min(n.natural, max(n.least, _COMFORT)), n.natural, n.is_words) for n in needs
    ]
    for size in SIZES:
        if fits(comfortable, width / size, 2 * _BETWEEN / size):
            return size, every
    if fits(needs, width / size, 2 * _BETWEEN / size):
        return size, every
    return size, fitting(table, needs, math.inf, 0.0)


def _comments(table: Table, shown: int) -> Iterator[str]:
    if table.shows:
        yield f"% {' '.join(table.shows.split())}"
    if left_out := len(table.columns) - shown:
        yield f"% {left_out} of {len(table.columns)} columns left out, for which there is no room"


class _Typeset:
    """A column as it is typeset; all widths are in units of the size of its text."""

    def __init__(self, table: Table, j: int, best: set[tuple[int, int]]) -> None:
        self.column = table.columns[j]
        self.bold = {row for row, column in best if column == j}
        self.cells = [row[j] for row in table.rows]
        self.of_all = _common_total(self.cells)
        self.numbers = [_is_number(cell) for cell in self.cells]
        self.is_number = any(self.numbers)
        of_words = all(cell is None or isinstance(cell, str) for cell in self.cells)
        self.is_words = not self.is_number and (self.column.words or of_words)
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
        title = shortened(title, _LONGEST // 3)
        unit = "%" if self.of_all else self.column.unit
        note = f"of {self.of_all:,}" if self.of_all else self.column.note
        parts = (title, f"({note})" if note else "", f"[{unit}]" if unit else "")
        return " ".join(filter(None, parts))

    @functools.cached_property
    def format(self) -> "_Format":
        """What siunitx's column is told of its numbers."""
        of = zip(self.texts, self.numbers, strict=True)
        return _Format.of([text for text, is_number in of if is_number])

    @functools.cached_property
    def body(self) -> float:
        """How wide the cells are, each in one line."""
        widths = [wide(text, i in self.bold) for i, text in enumerate(self.texts)]
        numbers = wide(self.format.widest, bool(self.bold)) if self.is_number else 0.0
        return max([*widths, numbers])

    @functools.cached_property
    def need(self) -> Need:
        """The widths at which it can be set, with head and texts broken into lines."""
        two = _in_two(self.heading)
        if not self.is_words:
            return Need(max(self._head, self.body), max(two, self.body))
        longest = max((wide(c) for text in self.texts for c in chunks(text)), default=0.0)
        least = max(self._head, min(self.body, longest, 2 * NARROW))
        return Need(least, max(least, two, self.body), True)

    @property
    def narrow(self) -> Need:
        """The widths at which it can be set where words are broken between any two letters."""
        least, natural, _ = self.need
        if not self.is_words:
            return Need(least, natural)
        return Need(max(self._head, min(least, NARROW)), natural, True)

    @property
    def _head(self) -> float:
        """How wide the widest word of the head is."""
        return max(map(wide, fragments(self.heading)), default=0.0)


class _Format(NamedTuple):
    """How many digits the numbers of a column have, before and after the point and as powers."""

    sign: str
    whole: int
    decimals: int
    sign_of_power: str
    power: int

    @staticmethod
    def of(texts: Iterable[str]) -> "_Format":
        """Return what suffices for all of these."""
        found = [_NUMBER.fullmatch(text.replace(",", "")) for text in texts]
        parts = [match.groups("") for match in found if match]
        signs = ["-" if any(part[i] for part in parts) else "" for i in (0, 3)]
        digits = [max((len(part[i]) for part in parts), default=0) for i in (1, 2, 4)]
        return _Format(signs[0], digits[0], digits[1], signs[1], digits[2])

    def __str__(self) -> str:
        """As siunitx wants it: -3.4e-2."""
        decimals = f".{self.decimals}" if self.decimals else ""
        power = f"e{self.sign_of_power}{self.power}" if self.power else ""
        return f"{self.sign}{self.whole}{decimals}{power}"

    @property
    def widest(self) -> str:
        """A number with all these digits."""
        whole = f"{10 ** (self.whole - 1):,}" if self.whole else ""
        decimals = f".{'0' * self.decimals}" if self.decimals else ""
        power = f"e{self.sign_of_power}{'0' * self.power}" if self.power else ""
        return f"{self.sign}{whole}{decimals}{power}".replace("-", "−")


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
            elif not column.is_words:
                made.append("r")
            elif column.body <= width:
                made.append("l")
            else:
                made.append(rf">{{\raggedright\arraybackslash}}p{{{self.size * width:.1f}pt}}")
        return f"@{{}}{' '.join(made)}@{{}}"

    @property
    def height(self) -> float:
        """Roughly how high it is [pt]."""
        lines = 4.0
        for i in range(len(self.table.rows)):
            high = [
                1 + int(1.25 * wide(column.texts[i]) / width)
                for column, width in zip(self.columns, self.widths, strict=True)
                if column.is_words and column.body > width
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
        cells, rules, begin, gap = [], [], 0, 2 * _BETWEEN / self.size
        for group, count in self._runs():
            room = sum(self.widths[begin : begin + count]) + gap * (count - 1)
            if count > 1:
                stacked = _stacked(_lines(group, room), "c")
                cells.append(rf"\multicolumn{{{count}}}{{c}}{{{stacked}}}")
                rules.append(rf"\cmidrule(lr){{{begin + 1}-{begin + count}}}")
            else:
                cells.append("")
            begin += count
        return [" & ".join(cells) + r" \\", " ".join(rules)]

    def _title(self, column: _Typeset, width: float, grouped: bool) -> str:
        heading = column.below if grouped else column.heading
        align = "l" if column.is_words else "r"
        stacked = _stacked(_lines(heading, width), align)
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
        if column.numbers[i]:
            return bold + column.texts[i].replace(",", "")
        text = breakable(column.texts[i], width)
        return f"{bold}{{{text}}}" if column.is_number else bold + text


def _parts(table: Table, columns: Sequence[_Typeset], width: float, size: int) -> list[_Part]:
    """Return the columns in as few parts as fit, names broken anywhere if they must be.

    Raises:
        ValueError: if the width does not suffice for one column beside those that name a row.
    """
    names, width, gap = min(naming(table), len(columns)), width / size, 2 * _BETWEEN / size
    for needs in ([c.need for c in columns], [c.narrow for c in columns]):
        groups = parts(names, needs, width, gap)
        if all(fits([needs[j] for j in group], width, gap) for group in groups):
            chosen = [[columns[j] for j in group] for group in groups]
            fitted = [assigned([needs[j] for j in group], width, gap) for group in groups]
            return [_Part(table, c, w, size) for c, w in zip(chosen, fitted, strict=True)]
    raise ValueError(f"--width: expected more for a column of {table.name}, got {width * size:g}pt")


def _float(table: Table, made: Sequence[_Part], page: Paper, size: int) -> list[str]:
    """Return a table that stands on one page, its parts below one another."""
    name = "table*" if page.is_page else "table"
    body = [rf"\begin{{{name}}}", r"\centering", _SKIP, _NUMBERS, _caption(table, page)]
    body += _setting(size)
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
        title = breakable(shortened(table.title, _LONGEST), _narrowest_line(page))
        again = rf"\caption[]{{{title}{ordinal}}}"
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
    title = escaped(shortened(table.title, _LONGEST))
    text = breakable(_said(table, ordinal), _narrowest_line(page))
    return rf"\caption[{{{title}}}]{{{text}}}\label{{tab:{_label(table.name)}}}"


def _said(table: Table, ordinal: str = "") -> str:
    """Return what the caption says."""
    sentences = [
        f"{shortened(table.title, _LONGEST)}{ordinal}.",
        shortened(table.measured, 6 * _LONGEST),
        "Best in bold, ties too." if best_cells(table) else "",
        f"{shortened(table.provenance, 3 * _LONGEST)}." if table.provenance else "",
    ]
    return " ".join(filter(None, sentences))


def _caption_height(table: Table, page: Paper) -> float:
    """Return roughly how high the caption is [pt], in letters of the largest size."""
    lines = 1 + 1.1 * SIZES[0] * wide(_said(table)) / page.width
    return _LEAD * SIZES[0] * lines


def _narrowest_line(page: Paper) -> float:
    """Return how much of a line a word of a caption may take, in units of its size."""
    return 0.8 * page.width / SIZES[0]


def _label(name: str) -> str:
    return re.sub(r"[^\w:.-]", "-", name, flags=re.ASCII)


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell)


def _common_total(cells: Iterable[Cell]) -> int:
    """Return the total that all shares of a column have in common, 0 if there is none."""
    totals = {cell.total for cell in cells if isinstance(cell, Share)}
    return totals.pop() if len(totals) == 1 else 0


def _in_two(heading: str) -> float:
    """Return how wide a heading is in at most two lines, as even as can be."""
    of = fragments(heading)
    lines = (("".join(of[:i]), "".join(of[i:])) for i in range(1, len(of)))
    return min((max(map(wide, both)) for both in lines), default=wide(heading))


def _lines(text: str, most: float) -> list[str]:
    """Return a heading in lines that are no wider, but for words that are."""
    lines: list[str] = []
    for fragment in fragments(text):
        if lines and wide(lines[-1] + fragment) <= most:
            lines[-1] += fragment
        else:
            lines.append(fragment)
    return lines


def _stacked(lines: Sequence[str], align: str) -> str:
    if len(lines) < 2:
        return "".join(map(escaped, lines))
    inner = r"\\".join(map(escaped, lines))
    return rf"\begin{{tabular}}[b]{{@{{}}{align}@{{}}}}{inner}\end{{tabular}}"
