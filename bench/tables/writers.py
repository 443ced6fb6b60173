"""Write a table as Markdown, CSV, or a fragment of HTML."""

import csv
import io
import re
import unicodedata
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from plumbob.text import html

from ..measure.metrics import Share
from .table import Cell, Column, Table, best_cells, words

# A number with a power of ten, within a text.
POWER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e(-?\d+)(?!\w)")
# An apostrophe, or the start of a formula in a spreadsheet; not a number, nor a sign alone.
_FORMULA = re.compile(r"'|[=@＝＠]|[-+－＋](?![\d.]*$|[\d.]+e[-+]?\d+$)", re.IGNORECASE)
# Letters of units and of titles, in ASCII.
_SIGNS = {
    "µ": "u",
    "μ": "u",
    "%": "percent",
    "°": "deg",
    "/": "per ",
    "ω": "omega",
    "±": "plus_minus",
}
# Marks anywhere, and the start of a list, a rule or a heading; no number is among these.
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>|#&~$]|^[-+=](?=[-+=\s]|$)|(?<=^\d)[.)](?=\s|$))")


def markdown(table: Table) -> str:
    """Return a table in GitHub's Markdown with title and explanation, the best cells bold."""
    best = best_cells(table)
    lines = [[_markdown(column.heading) for column in table.columns]]
    lines.append(["---" if column.words else "---:" for column in table.columns])
    for i, row in enumerate(table.rows):
        texts = [_markdown(words(cell)) for cell in row]
        lines.append([f"**{text}**" if (i, j) in best else text for j, text in enumerate(texts)])
    parts = [
        f"# {_markdown(table.title)}",
        _markdown(table.summary.sentence),
        "\n".join(f"- {_markdown(point)}" for point in table.summary.points),
        "\n".join(f"| {' | '.join(line)} |" for line in lines),
        _markdown(table.shows),
        _markdown(table.measured),
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _markdown(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", " ".join(text.split()))


def comma_separated(table: Table) -> str:
    """Return a table as CSV for programs: names in snake_case with units, and all digits.

    A share becomes hits, total and interval. A column of numbers holds numbers only: texts such as
    "12 claimed" stand in a column of remarks. A text that a spreadsheet would compute begins with
    an apostrophe.
    """
    rows: list[list[Any]] = [[] for _ in range(len(table.rows) + 1)]
    for j, column in enumerate(table.columns):
        cells = [row[j] for row in table.rows]
        for name, parts in _csv_columns(column, cells):
            for row, part in zip(rows, [name, *parts], strict=True):
                row.append(part)
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _csv_columns(column: Column, cells: Sequence[Cell]) -> Iterator[tuple[str, list[Any]]]:
    """Yield the names and the cells of the columns in CSV that stand for a column."""
    texts = [_csv_text(words(c)) if isinstance(c, str | bool) else "" for c in cells]
    is_share = any(isinstance(cell, Share) for cell in cells)
    names = csv_names(column, is_share)
    if is_share:
        parts = (cell if isinstance(cell, Share) else [""] * len(names) for cell in cells)
        yield from zip(names, map(list, zip(*parts, strict=True)), strict=True)
    elif column.words:
        yield names[0], texts
    else:
        numbers = ["" if cell is None or text else repr(cell)
                   for cell, text in zip(cells, texts, strict=True)]  # fmt: skip
        yield names[0], numbers
        if any(texts):
            yield machine_name(f"{column.title} remark"), texts


def csv_names(column: Column, is_share: bool) -> list[str]:
    """Return the names of a column in CSV: a share has four."""
    if is_share:
        return [machine_name(f"{column.title} {part}") for part in Share._fields]
    return [machine_name(column.title, column.unit)]


def machine_name(title: str, unit: str = "") -> str:
    """Return a title and a unit in snake_case: "time, median" in "µs" is "time_median_us"."""
    text = f"{title.replace('%', '')} {unit}".lower()
    for sign, name in _SIGNS.items():
        text = text.replace(sign, f" {name}")
    plain = unicodedata.normalize("NFKD", text)
    return re.sub(r"\W+", "_", plain.replace("’", ""), flags=re.ASCII).strip("_") or "column"


def _csv_text(text: str) -> str:
    return f"'{text}" if _FORMULA.match(text) else text


def html_fragment(table: Table) -> str:
    """Return a table as HTML with title and explanation, without style sheet or script."""
    best = best_cells(table)
    rows = [
        [(words(cell), (i, j) in best) for j, cell in enumerate(row)]
        for i, row in enumerate(table.rows)
    ]
    about = " ".join(filter(None, (table.shows, table.measured, table.provenance)))
    templates = html.environment(Path(__file__).parent)
    templates.filters["powers"] = _powers
    template = templates.get_template("fragment.html")
    return template.render(table=table, rows=rows, about=about) + "\n"


def _powers(text: str) -> Markup:
    """Return escaped text on one line with powers of ten as superscripts."""
    escaped = str(escape(" ".join(text.split())))
    power = POWER.sub(lambda m: f"{m[1]}·10<sup>{m[2]}</sup>".replace("-", "−"), escaped)
    return Markup(power)
