"""Write a table as Markdown, CSV, or a fragment of HTML."""

import csv
import io
import re
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from plumbob.text import html

from ..harness.metrics import Share
from .table import Cell, Table, best_cells, words

# A number with a power of ten, within a text.
POWER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e(-?\d+)(?!\w)")
# An apostrophe, or the start of a formula in a spreadsheet; not a number, nor a sign alone.
_FORMULA = re.compile(r"'|[=@＝＠]|[-+－＋](?![\d.]*$|[\d.]+e[-+]?\d+$)", re.IGNORECASE)
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
        _markdown(table.shows),
        _markdown(table.measured),
        "\n".join(f"| {' | '.join(line)} |" for line in lines),
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _markdown(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", " ".join(text.split()))


def comma_separated(table: Table) -> str:
    """Return a table as CSV with all digits; a share becomes hits, total and interval.

    A text that a spreadsheet would compute begins with an apostrophe.
    """
    columns = range(len(table.columns))
    shares = [any(isinstance(row[j], Share) for row in table.rows) for j in columns]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    head: list[str] = []
    for column, is_share in zip(table.columns, shares, strict=True):
        parts = [f"{column.title}, {part}" for part in ("hits", "total", "95 % low", "95 % high")]
        head += parts if is_share else [column.heading]
    writer.writerow(_csv_text(words(heading)) for heading in head)
    for row in table.rows:
        cells = zip(row, shares, strict=True)
        writer.writerow(part for cell, is_share in cells for part in _csv_parts(cell, is_share))
    return text.getvalue()


def _csv_parts(cell: Cell, is_share: bool) -> list[Any]:
    if is_share:
        return list(cell) if isinstance(cell, Share) else [""] * len(Share._fields)
    if cell is None:
        return [""]
    return [_csv_text(words(cell)) if isinstance(cell, bool | str) else repr(cell)]


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
