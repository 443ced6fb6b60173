"""The report: tables in three formats, figures, and one page that needs nothing but itself."""

import base64
import contextlib
import html
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

from ..experiments import SUITES
from ..harness.record import FINISHED, Record, RecordFile, check_folder, check_regular
from . import tables
from .entry import Entry, Figure
from .figures import COLOURS, Drawing
from .results import Results, plain, sift
from .sections import SECTIONS, Section
from .tables import Cell, Column, Table

_HERE = Path(__file__).parent
FORMATS = {
    "md": (tables.markdown, "Markdown", "text/markdown"),
    "tex": (tables.latex, "LaTeX", "application/x-tex"),
    "csv": (tables.comma_separated, "CSV", "text/csv"),
}


class Written(NamedTuple):
    """What a report came to: its page, its tables, and sentences on what is missing."""

    page: Path
    tables: list[Table]
    missing: list[str]


def write(folder: Path) -> Written:
    """Write the report of a folder's records into it.

    Raises:
        ValueError: if there are no records, or they cannot be read.
        OSError: if the folder cannot be written to.
    """
    check_folder(folder)
    stored, warning = RecordFile(folder).read()
    if not stored:
        raise ValueError(f"no records in {folder}: run `plumbob bench` first")
    shown, left_out = sound([plain(record) for record in stored])
    missing = [*([warning] if warning else []), *left_out, *_missing(shown.records)]
    _write_files(folder, shown.tables.values(), shown.drawings.values())
    page = folder / "index.html"
    _write(page, _page(shown, missing))
    return Written(page, list(shown.tables.values()), missing)


class Shown(NamedTuple):
    """All that a report shows: its records, and what is made of them."""

    records: Sequence[Record]
    tables: dict[Entry, Table]
    drawings: dict[Figure, Drawing]


def sound(records: Sequence[Record]) -> tuple[Shown, list[str]]:
    """Return what can be shown, and a sentence on each record of which nothing can be made."""
    with contextlib.suppress(Exception):
        return _shown(records), []
    said: list[str] = []
    for make in _makers():
        records, sentences = sift(make, records)
        said += sentences
    return _shown(records), list(dict.fromkeys(said))


def _shown(records: Sequence[Record]) -> Shown:
    results = Results(records)
    made = {entry: _checked(entry, results) for section in SECTIONS for entry in section.entries}
    drawn = {draw: draw(results) for draw in all_figures()}
    return Shown(records, made, {draw: drawing for draw, drawing in drawn.items() if drawing})


def all_figures() -> list[Figure]:
    """Return the figures of all sections, in order."""
    return [draw for section in SECTIONS for entry in section.entries for draw in entry.figures]


def _makers() -> Iterator[Callable[[Results], Any]]:
    """Yield all that makes something of records, one by one."""
    for section in SECTIONS:
        yield from (partial(_checked, entry) for entry in section.entries)
    yield from all_figures()


def _checked(entry: Entry, results: Results) -> Table:
    """Return a table that can be written in every form."""
    table = entry.table(results)
    _table(table)
    return table


def _write_files(folder: Path, made: Iterable[Table], drawings: Iterable[Drawing]) -> None:
    for name in ("tables", "figures"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for table in made:
        for suffix, (write_as, _, _) in FORMATS.items():
            path = folder / "tables" / f"{table.name}.{suffix}"
            _write(path, write_as(table))
    for drawing in drawings:
        _write(folder / "figures" / f"{drawing.name}.svg", drawing.svg)


def _write(path: Path, text: str) -> None:
    check_regular(path)
    path.write_text(text, encoding="utf-8")


def _missing(records: Sequence[Record]) -> list[str]:
    """Return a sentence for everything that the reader might look for in vain."""
    newest = _newest(records)
    finished = {
        record.problem: record.stamp == newest.stamp
        for record in records
        if record.suite == FINISHED
    }
    sentences = [
        f"The suite “{suite}” was not run to its end: `plumbob bench {suite}` takes it up again."
        for suite in SUITES
        if not finished.get(suite)
    ]
    sentences += [
        f"{record.problem}, {record.solver} could not be measured: {record.failed}"
        for record in records
        if record.failed
    ]
    sentences += [
        f"{package} is not installed." for package, v in _versions_of(newest).items() if not v
    ]
    others = sum(record.stamp != newest.stamp for record in records)
    if others:
        sentences.append(
            f"{others} of {len(records)} records are from other sources, versions or another "
            "machine than the head of this page says; `plumbob bench` measures them again."
        )
    return sentences


def _newest(records: Sequence[Record]) -> Record:
    return max(records, key=lambda record: record.when)


def _versions_of(record: Record) -> Mapping[str, str]:
    return record.stamp.get("versions", {})


def _page(shown: Shown, missing: Sequence[str]) -> str:
    records, made, drawings = shown
    newest = _newest(records)
    return Template((_HERE / "page.html").read_text(encoding="utf-8")).substitute(
        style=(_HERE / "page.css").read_text(encoding="utf-8"),
        date=_text(newest.when.replace("T", " ").replace("+00:00", " UTC")),
        day=_text(newest.when[:10]),
        facts=_facts(newest),
        versions=_versions(newest),
        contents=_contents(),
        brief=_brief(made),
        sections="\n".join(_section(section, made, drawings) for section in SECTIONS),
        missing=_items(missing or ["Nothing: every suite was run to its end on this machine."]),
    )


def _facts(record: Record) -> str:
    machine, versions = record.stamp.get("machine", {}), _versions_of(record)
    memory = machine.get("memory_gib")
    facts = {
        "Machine": machine.get("processor", "–"),
        "Cores": f"{machine.get('cores', '–')}" + (f", {memory} GiB memory" if memory else ""),
        "System": f"{machine.get('system', '–')}, Python {versions.get('python', '–')}",
        "Plumbob": f"{versions.get('plumbob', '–')}, sources {record.stamp.get('source', '–')}",
    }
    return "\n".join(
        f"<div><dt>{_text(name)}</dt><dd>{_text(value)}</dd></div>" for name, value in facts.items()
    )


def _versions(record: Record) -> str:
    return ", ".join(
        f"{_text(package)} {_text(version or 'not installed')}"
        for package, version in _versions_of(record).items()
    )


def _contents() -> str:
    lines = []
    for section in SECTIONS:
        inner = "".join(
            f'<li><a href="#{section.name}-{i}">{_text(entry.question)}</a></li>'
            for i, entry in enumerate(section.entries, 1)
        )
        lines.append(
            f'<li><a href="#{section.name}">{_text(section.title)}</a><ol>{inner}</ol></li>'
        )
    return "\n".join(lines)


def _brief(made: dict[Entry, Table]) -> str:
    items = []
    for section in SECTIONS:
        for i, entry in enumerate(section.entries, 1):
            items.append(
                f'<div><dt><a href="#{section.name}-{i}">{_text(entry.question)}</a></dt>'
                f"<dd>{_answer(made[entry])}</dd></div>"
            )
    return "\n".join(items)


def _section(section: Section, made: dict[Entry, Table], drawings: dict[Figure, Drawing]) -> str:
    entries = "\n".join(
        _entry(f"{section.name}-{i}", entry, made[entry], drawings)
        for i, entry in enumerate(section.entries, 1)
    )
    return (
        f'<section id="{section.name}">\n<h2>{_text(section.title)}</h2>\n'
        f'<p class="about">{_text(section.about)}</p>\n{entries}\n</section>'
    )


def _entry(anchor: str, entry: Entry, table: Table, drawings: dict[Figure, Drawing]) -> str:
    answer = f'<div class="answer">{_answer(table)}</div>' if table.rows else ""
    shown = "\n".join(_drawing(drawings[draw]) for draw in entry.figures if draw in drawings)
    body = _table(table) if table.rows else '<p class="none">Not measured yet.</p>'
    return (
        f'<article id="{anchor}">\n<h3>{_text(entry.question)}</h3>\n{answer}\n{shown}\n{body}\n'
        f"</article>"
    )


def _answer(table: Table) -> str:
    if not table.rows:
        return '<p class="none">Not measured yet.</p>'
    points = "".join(f"<li>{_rich(point)}</li>" for point in table.answer.points)
    return f"<p>{_rich(table.answer.sentence)}</p>" + (f"<ul>{points}</ul>" if points else "")


def _drawing(drawing: Drawing) -> str:
    return (
        f'<figure><div class="scroll" tabindex="0" role="region" '
        f'aria-label="{_text(drawing.title)}">{inline_svg(drawing)}</div>'
        f"<figcaption><b>{_text(drawing.title)}.</b> {_text(drawing.shows)}</figcaption></figure>"
    )


def inline_svg(drawing: Drawing) -> str:
    """Return an SVG fit to stand in a page: own ids, colours by name, no links, the page's fonts.

    Ids are made unique, since all drawings of a page share one name space. What is written between
    tags stays as it is.
    """
    svg = drawing.svg[drawing.svg.index("<svg") :]
    svg = re.sub(
        r"<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->|<title>.*?</title>", "", svg,
        flags=re.DOTALL,
    )  # fmt: skip
    svg = re.sub(r' width="[^"]*pt" height="[^"]*pt"', "", svg, count=1)
    svg = re.sub(r"<[^<>]+>", partial(_inline_tag, drawing.name), svg)
    label = f'<svg role="img" aria-label="{_text(drawing.title)}"'
    return svg.replace("<svg", label, 1).strip()


def _inline_tag(name: str, match: re.Match[str]) -> str:
    tag = re.sub(r' xmlns(:\w+)?="[^"]*"| version="[^"]*"', "", match[0])
    tag = tag.replace("xlink:href", "href")
    tag = re.sub(r'\bid="', f'id="{name}-', tag)
    tag = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", tag)
    tag = re.sub(r"font-family: [^;\"]*;?|font: ([\d.]+px) [^;\"]*", _font, tag)
    for colour_name, colour in COLOURS.items():
        tag = tag.replace(colour, f"var(--{colour_name})")
    return tag


def _font(match: re.Match[str]) -> str:
    return f"font-size: {match[1]}" if match[1] else ""


def _table(table: Table) -> str:
    head = "".join(_heading(column) for column in table.columns)
    downloads = " ".join(
        f'<a download="{table.name}.{suffix}" href="data:{mime};base64,'
        f'{base64.b64encode(write_as(table).encode()).decode()}">{name}</a>'
        for suffix, (write_as, name, mime) in FORMATS.items()
    )
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{_text(table.title)}">\n'
        f"<table>\n<caption>{_text(table.title)}</caption>\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{_rows(table)}\n</tbody>\n</table></div>\n"
        f'<p class="how"><b>What it shows.</b> {_rich(table.shows)}</p>\n'
        f'<p class="how"><b>How it was measured.</b> {_rich(table.measured)}</p>\n'
        f'<p class="files">This table as {downloads}</p>'
    )


def _heading(column: Column) -> str:
    unit = f' <span class="unit">[{_text(column.unit)}]</span>' if column.unit else ""
    kind = ' class="words"' if column.words else ""
    return f'<th scope="col"{kind}>{_text(column.title)}{unit}</th>'


def _rows(table: Table) -> str:
    """Return the rows; neighbours with the same first cell share it."""
    lines = []
    for i, row in enumerate(table.rows):
        cells = "".join(
            _cell(cell, column) for cell, column in zip(row[1:], table.columns[1:], strict=True)
        )
        first = i == 0 or table.rows[i - 1][0] != row[0]
        lines.append(f"<tr>{_row_head(table, i) if first else ''}{cells}</tr>")
    return "\n".join(lines)


def _row_head(table: Table, i: int) -> str:
    same = 1
    while i + same < len(table.rows) and table.rows[i + same][0] == table.rows[i][0]:
        same += 1
    span, group = (f' rowspan="{same}"', "rowgroup") if same > 1 else ("", "row")
    return f'<th scope="{group}"{span}>{_rich(tables.words(table.rows[i][0]))}</th>'


def _cell(cell: Cell, column: Column) -> str:
    text = _rich(tables.words(cell))
    if column.title == "verdict":
        return f'<td class="words {"held" if cell == "held" else "missed"}">{text}</td>'
    return f'<td class="words">{text}</td>' if column.words else f"<td>{text}</td>"


def _items(sentences: Iterable[str]) -> str:
    return "\n".join(f"<li>{_text(sentence)}</li>" for sentence in sentences)


def _text(text: str) -> str:
    return html.escape(text, quote=True)


def _rich(text: str) -> str:
    """Return escaped text in which powers of ten are set as such."""
    return tables.POWER.sub(_power, _text(text))


def _power(match: re.Match[str]) -> str:
    mantissa, exponent = match[1].replace("-", "−"), match[2].replace("-", "−")
    return f'<span class="number">{mantissa} · 10<sup>{exponent}</sup></span>'
