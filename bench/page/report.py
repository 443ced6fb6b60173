"""Write the report: tables in three formats, figures, and a page that needs no other file."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from plumbob.process.paths import check_regular
from plumbob.text.printable import shortened, visible

from ..experiments import SUITES
from ..figures.robot_map import robot_maps
from ..figures.sketch import Drawing, drawn
from ..measure.record import FINISHED, Record
from ..peers.packages import peers_command
from ..tables.latex import latex
from ..tables.layout import Figure
from ..tables.results import Results, listed, results_of
from ..tables.table import Table
from ..tables.writers import comma_separated, markdown
from .headlines import Overview, absent, not_asked, overview
from .page import Contents, render
from .sections import MOTIONS, SECTIONS

# The formats of a table, by the suffix of the file.
FORMATS = {"md": markdown, "tex": latex, "csv": comma_separated}


class BenchReport(NamedTuple):
    """A written report: its page and tables, sentences on missing parts, the first screen."""

    page: Path
    tables: list[Table]
    missing: list[str]
    answers: Overview


def write(folder: Path) -> BenchReport:
    """Write the report of a folder's records into the folder.

    Raises:
        ValueError: if there are no records, or none that can be read and shown.
        OSError: if the folder cannot be written to.
    """
    results, warning = results_of(folder)
    tables = {layout: layout(results) for section in SECTIONS for layout in section.layouts}
    drawings, not_drawn = _drawings(results, folder / "figures")
    scenes = {section: scene for section, make in MOTIONS.items() if (scene := make(results))}
    contents = Contents(tables, drawings, overview(results), scenes, robot_maps(results))
    newest = max(results.every, key=lambda record: record.when)
    missing = list(filter(None, (warning, *not_drawn, *_missing(results, newest))))
    for table in tables.values():
        for suffix, form in FORMATS.items():
            _write(folder / "tables" / f"{table.name}.{suffix}", form(table))
    for drawing in drawings.values():
        _write(folder / "figures" / f"{drawing.name}.svg", drawing.svg)
        _write(folder / "figures" / f"{drawing.name}.pdf", drawing.pdf)
    page = folder / "index.html"
    _write(page, render(contents, newest, missing))
    return BenchReport(page, list(tables.values()), missing, contents.answers)


def _drawings(results: Results, folder: Path) -> tuple[dict[Figure, Drawing], list[str]]:
    """Return the figures, unchanged figures from the folder, and sentences on failures."""
    drawings: dict[Figure, Drawing] = {}
    sentences: list[str] = []
    for figure in all_figures():
        if sketch := figure(results):
            try:
                drawings[figure] = drawn(sketch, folder)
            except (ValueError, ArithmeticError) as error:  # numbers beyond any axis
                reason = shortened(visible(f"{type(error).__name__}: {error}"), 100)
                sentences.append(f"The figure {sketch.name} cannot be drawn ({reason}).")
    return drawings, sentences


def all_figures() -> list[Figure]:
    """Return the figures of all chapters, in order."""
    return [draw for section in SECTIONS for layout in section.layouts for draw in layout.figures]


def _write(path: Path, content: str | bytes) -> None:
    check_regular(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def _missing(results: Results, newest: Record) -> Iterator[str]:
    """Yield a sentence on each part that a reader may miss."""
    ended = {r.problem for r in results.all(FINISHED) if r.stamp == newest.stamp}
    started = {record.suite for record in results.every}
    for suite in SUITES:
        if suite in started - ended:
            yield f"The suite “{suite}” is not complete: `plumbob bench {suite}` continues it."
    if never := [suite for suite in SUITES if suite not in started | ended]:
        yield f"Not run: {', '.join(never)}. `plumbob bench {' '.join(never)}` measures them."
    for record in results.failed:
        yield f"{record.problem}, {record.solver} could not be measured: {record.failed}"
    for package, version in newest.stamp.get("versions", {}).items():
        if not version:
            yield f"{package} is not installed."
    if names := absent(results):
        yield (
            f"Absent peers: {listed(names)}. `{peers_command()}` adds those that have a wheel for "
            "this Python; `plumbob bench ik cloth` then measures them."
        )
    if names := not_asked(results):
        yield f"Not selected: {listed(names)}. `plumbob bench ik cloth` measures all."
    if count := sum(record.stamp != newest.stamp for record in results.every):
        yield (
            f"{count:,} of {len(results.every):,} records are from other sources, versions or "
            "another machine than the head of this page says; `plumbob bench` measures them again."
        )
