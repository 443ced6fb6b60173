"""The report: tables in three formats, figures, and one page that needs nothing but itself."""

import contextlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ..experiments import SUITES
from ..figures.sketch import Drawing, Sketch, drawn
from ..harness.record import FINISHED, Record, RecordFile, check_folder, check_regular
from ..harness.results import Results, check_any, listed, plain, reason, sift
from ..motion.motion import Scene
from ..tables.latex import latex
from ..tables.layout import Figure, Layout
from ..tables.table import Table, best_cells, comma_separated, markdown
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
    check_folder(folder)
    stored, warning = RecordFile(folder).read()
    if not stored:
        raise ValueError(f"no records in {folder}: run `plumbob bench` first")
    sketched, left_out = sound([plain(record) for record in stored if not record.superseded])
    check_any(folder, sketched.records, left_out)
    shown, not_drawn = _drawn(sketched, folder / "figures")
    sentences = [warning, *left_out, *not_drawn, *_missing(shown.records)]
    missing = [sentence for sentence in sentences if sentence]
    _write_files(folder, sketched.texts, shown.drawings.values())
    page = folder / "index.html"
    _write(page, render(shown, _newest(shown.records), missing))
    return Written(page, list(shown.tables.values()), missing, sketched.answers)


def sound(records: Sequence[Record]) -> tuple["Sketched", list[str]]:
    """Return what can be shown, and a sentence on each record of which nothing can be made."""
    with contextlib.suppress(Exception):
        return _sketched(records), []
    said: list[str] = []
    for make in _makers():
        records, sentences = sift(make, records)
        said += sentences
    return _sketched(records), list(dict.fromkeys(said))


class Sketched(NamedTuple):
    """What a report shows, before its figures are drawn; the texts are tables by name of file."""

    records: Sequence[Record]
    tables: Mapping[Layout, Table]
    texts: Mapping[str, str]
    sketches: Mapping[Figure, Sketch]
    answers: Answers
    scenes: Mapping[str, Scene]


def _sketched(records: Sequence[Record]) -> Sketched:
    results = Results(records)
    made = {layout: _made(layout, results) for section in SECTIONS for layout in section.layouts}
    tables = {layout: table for layout, (table, _) in made.items()}
    texts = {name: text for _, texts in made.values() for name, text in texts.items()}
    sketches = {figure: figure(results) for figure in all_figures()}
    scenes = {section: scene for section, make in MOTIONS.items() if (scene := make(results))}
    drawable = {figure: one for figure, one in sketches.items() if one}
    return Sketched(records, tables, texts, drawable, answers(results), scenes)


def _drawn(sketched: Sketched, folder: Path) -> tuple[Shown, list[str]]:
    """Draw figures, but for those in the folder; return sentences on those that cannot be drawn."""
    drawings: dict[Figure, Drawing] = {}
    sentences: list[str] = []
    for figure, sketch in sketched.sketches.items():
        try:
            drawings[figure] = drawn(sketch, folder)
        except Exception as error:  # a record may hold numbers that no axis can
            sentences.append(f"The figure {sketch.name} cannot be drawn ({reason(error)}).")
    shown = Shown(sketched.records, sketched.tables, drawings, sketched.answers, sketched.scenes)
    return shown, sentences


def all_figures() -> list[Figure]:
    """Return the figures of all sections, in order."""
    return [draw for section in SECTIONS for layout in section.layouts for draw in layout.figures]


def _makers() -> Iterator[Callable[[Results], Any]]:
    """Yield all that makes something of records, one by one."""
    for section in SECTIONS:
        yield from (partial(_made, layout) for layout in section.layouts)
    yield from all_figures()
    yield answers
    yield from MOTIONS.values()


def _made(layout: Layout, results: Results) -> tuple[Table, dict[str, str]]:
    """Return a table, and it in every form by the name of its file."""
    table = layout(results)
    best_cells(table)
    return table, {f"{table.name}.{suffix}": form(table) for suffix, form in FORMATS.items()}


def _write_files(folder: Path, texts: Mapping[str, str], drawings: Iterable[Drawing]) -> None:
    for name in ("tables", "figures"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        _write(folder / "tables" / name, text)
    for drawing in drawings:
        _write(folder / "figures" / f"{drawing.name}.svg", drawing.svg)
        _write(folder / "figures" / f"{drawing.name}.pdf", drawing.pdf)


def _write(path: Path, content: str | bytes) -> None:
    check_regular(path)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def _missing(records: Sequence[Record]) -> list[str]:
    """Return a sentence for everything that the reader might look for in vain."""
    newest = _newest(records)
    finished = {
        record.problem: record.stamp == newest.stamp
        for record in records
        if record.suite == FINISHED
    }
    begun = {record.suite for record in records}
    never = [suite for suite in SUITES if suite not in begun and not finished.get(suite)]
    sentences = [
        f"The suite “{suite}” was not run to its end: `plumbob bench {suite}` takes it up again."
        for suite in SUITES
        if suite in begun and not finished.get(suite)
    ]
    if never:
        sentences.append(
            f"Not run: {', '.join(never)}. `plumbob bench {' '.join(never)}` measures them."
        )
    sentences += [
        f"{record.problem}, {record.solver} could not be measured: {record.failed}"
        for record in records
        if record.failed
    ]
    sentences += [
        f"{package} is not installed."
        for package, version in newest.stamp.get("versions", {}).items()
        if not version
    ]
    if names := absent(Results(records)):
        sentences.append(
            f"Absent peers: {listed(names)}. `make peers` (or `pip install -e .[peers]`) adds those"
            " that have a wheel for this Python; `plumbob bench ik cloth` then measures them."
        )
    if names := not_asked(Results(records)):
        sentences.append(f"Not asked: {listed(names)}. `plumbob bench ik cloth` asks all.")
    others = sum(record.stamp != newest.stamp for record in records)
    if others:
        sentences.append(
            f"{others} of {len(records)} records are from other sources, versions or another "
            "machine than the head of this page says; `plumbob bench` measures again what it runs."
        )
    return sentences


def _newest(records: Sequence[Record]) -> Record:
    return max(records, key=lambda record: record.when)
