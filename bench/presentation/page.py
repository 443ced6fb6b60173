"""The page of the report, from a template that escapes whatever is put into it."""

import base64
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ..harness.record import Record
from . import latex as tex
from . import svg, tables
from .figures import Drawing
from .layout import Figure, Layout
from .sections import SECTIONS
from .tables import Cell, Column, Table

_HERE = Path(__file__).parent


class Format(NamedTuple):
    """A form that a table is written in: how, what it is called, and its type for browsers."""

    write: Callable[[Table], str]
    name: str
    mime: str


FORMATS = {
    "md": Format(tables.markdown, "Markdown", "text/markdown"),
    "tex": Format(tex.latex, "LaTeX", "application/x-tex"),
    "csv": Format(tables.comma_separated, "CSV", "text/csv"),
}


class Shown(NamedTuple):
    """All that a report shows: its records, and what is made of them."""

    records: Sequence[Record]
    tables: Mapping[Layout, Table]
    drawings: Mapping[Figure, Drawing]


class Row(NamedTuple):
    """A row of a table: neighbours with the same first cell share it, over `span` rows.

    The other cells each have their class in the page.
    """

    head: Cell
    span: int
    cells: list[tuple[Cell, str]]


class Download(NamedTuple):
    """A table as a file that the page carries."""

    name: str
    address: str
    format: str


def render(shown: Shown, newest: Record, missing: Sequence[str]) -> str:
    """Return the page, whose head is that of the newest record."""
    template = _environment().get_template("page.html")
    return template.render(
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
        date=newest.when.replace("T", " ").replace("+00:00", " UTC"),
        day=newest.when[:10],
        machine=_machine(newest),
        versions=newest.stamp.get("versions", {}),
        sections=SECTIONS,
        tables=shown.tables,
        drawings=shown.drawings,
        missing=missing,
    )


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = {"rich": rich, "words": tables.words, "rows": rows, "inline": svg.inline}
    environment.filters.update(filters, downloads=downloads)
    return environment


def _machine(record: Record) -> dict[str, str]:
    machine, versions = record.stamp.get("machine", {}), record.stamp.get("versions", {})
    memory = machine.get("memory_gib")
    return {
        "Machine": machine.get("processor", "–"),
        "Cores": f"{machine.get('cores', '–')}" + (f", {memory} GiB memory" if memory else ""),
        "System": f"{machine.get('system', '–')}, Python {versions.get('python', '–')}",
        "Plumbob": f"{versions.get('plumbob', '–')}, sources {record.stamp.get('source', '–')}",
    }


def rows(table: Table) -> list[Row]:
    """Return the rows of a table; the span of a first cell that stands in a row above is 0."""
    heads = [row[0] for row in table.rows]
    spans, others = [0] * len(heads), table.columns[1:]
    first = 0
    for i, head in enumerate(heads):
        first = i if head != heads[first] else first
        spans[first] += 1
    return [
        Row(row[0], span, [(cell, _kind(cell, c)) for cell, c in zip(row[1:], others, strict=True)])
        for row, span in zip(table.rows, spans, strict=True)
    ]


def _kind(cell: Cell, column: Column) -> str:
    if column.title == "verdict":
        return f"words {'held' if cell == 'held' else 'missed'}"
    return "words" if column.words else ""


def downloads(table: Table) -> list[Download]:
    """Return a table in each format, as addresses that hold the file."""
    return [
        Download(
            f"{table.name}.{suffix}",
            f"data:{form.mime};base64,{base64.b64encode(form.write(table).encode()).decode()}",
            form.name,
        )
        for suffix, form in FORMATS.items()
    ]


def rich(text: str) -> Markup:
    """Return escaped text in which powers of ten are set as such."""
    return Markup(tables.POWER.sub(_power, str(Markup.escape(text))))


def _power(match: re.Match[str]) -> str:
    mantissa, exponent = match[1].replace("-", "−"), match[2].replace("-", "−")
    return f'<span class="number">{mantissa} · 10<sup>{exponent}</sup></span>'
