"""The report: tables in three formats, figures, and one page that needs nothing but itself."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ..experiments import SUITES
from ..figures.sketch import Drawing, drawn
from ..harness.record import FINISHED, Record, check_regular
from ..tables.latex import latex
from ..tables.layout import Figure
from ..tables.results import Results, listed, results_of
from ..tables.table import Table, comma_separated, markdown
from ..text import shortened, visible
from .headlines import Answers, absent, answers, not_asked
from .page.page import Shown, render
from .sections import MOTIONS, SECTIONS

# The forms that a table is written in, by the suffix of the file.
FORMATS = {"md": markdown, "tex": latex, "csv": comma_separated}


class Written(NamedTuple):
    """What a report came to: its page, its tables, what is missing, and who leads."""

    page: Path
    tables: list[Table]
    missing: list[str]
    answers: Answers


def write(folder: Path) -> Written:
    """Write the report of a folder's records into it.

    Raises:
        ValueError: if there are no records, or none that can be read and shown.
        OSError: if the folder cannot be written to.
    """
    results, warning = results_of(folder)
    tables = {layout: layout(results) for section in SECTIONS for layout in section.layouts}
    drawings, not_drawn = _drawings(results, folder / "figures")
    scenes = {section: scene for section, make in MOTIONS.items() if (scene := make(results))}
    shown = Shown(tables, drawings, answers(results), scenes)
    newest = max(results.every, key=lambda record: record.when)
    missing = [one for one in (warning, *not_drawn, *_missing(results, newest)) if one]
    page = folder / "index.html"
    for path, content in _files(shown):
        _write(folder / path, content)
    _write(page, render(shown, newest, missing))
    return Written(page, list(tables.values()), missing, shown.answers)


def _drawings(results: Results, folder: Path) -> tuple[dict[Figure, Drawing], list[str]]:
    """Draw figures, but for those in the folder; return sentences on those that cannot be drawn."""
    drawings: dict[Figure, Drawing] = {}
    sentences: list[str] = []
    for figure in all_figures():
        if sketch := figure(results):
            try:
                drawings[figure] = drawn(sketch, folder)
            except (ValueError, ArithmeticError) as error:  # numbers that no axis can hold
                why = shortened(visible(f"{type(error).__name__}: {error}"), 100)
                sentences.append(f"The figure {sketch.name} cannot be drawn ({why}).")
    return drawings, sentences


def all_figures() -> list[Figure]:
    """Return the figures of all sections, in order."""
    return [draw for section in SECTIONS for layout in section.layouts for draw in layout.figures]


def _files(shown: Shown) -> Iterator[tuple[str, str | bytes]]:
    """Yield the files of tables and figures, and what they hold."""
    for table in shown.tables.values():
        for suffix, form in FORMATS.items():
            yield f"tables/{table.name}.{suffix}", form(table)
    for drawing in shown.drawings.values():
        yield f"figures/{drawing.name}.svg", drawing.svg
        yield f"figures/{drawing.name}.pdf", drawing.pdf


def _write(path: Path, content: str | bytes) -> None:
    check_regular(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def _missing(results: Results, newest: Record) -> Iterator[str]:
    """Yield a sentence for everything that the reader might look for in vain."""
    yield from _suites_missing(results, newest)
    for record in results.failed:
        yield f"{record.problem}, {record.solver} could not be measured: {record.failed}"
    for package, version in newest.stamp.get("versions", {}).items():
        if not version:
            yield f"{package} is not installed."
    if names := absent(results):
        yield (
            f"Absent peers: {listed(names)}. `make peers` (or `pip install -e .[peers]`) adds those"
            " that have a wheel for this Python; `plumbob bench ik cloth` then measures them."
        )
    if names := not_asked(results):
        yield f"Not asked: {listed(names)}. `plumbob bench ik cloth` asks all."
    if others := sum(record.stamp != newest.stamp for record in results.every):
        yield (
            f"{others} of {len(results.every)} records are from other sources, versions or another "
            "machine than the head of this page says; `plumbob bench` measures again what it runs."
        )


def _suites_missing(results: Results, newest: Record) -> Iterator[str]:
    """Yield a sentence on each suite that was begun only, and one on those that were not."""
    ended = {r.problem for r in results.all(FINISHED) if r.stamp == newest.stamp}
    begun = {record.suite for record in results.every}
    for suite in SUITES:
        if suite in begun - ended:
            yield (
                f"The suite “{suite}” was not run to its end: `plumbob bench {suite}` takes it up "
                "again."
            )
    if never := [suite for suite in SUITES if suite not in begun | ended]:
        yield f"Not run: {', '.join(never)}. `plumbob bench {' '.join(never)}` measures them."
