"""What comes of files of anyone beside the engines, as tables and sentences."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from crosscheck.engines.file_kind import FRAGMENT
from crosscheck.robots.files import (
    AGREES,
    DEVIATES,
    DIFFERS,
    ENGINES,
    LOST,
    NEITHER,
    REFUSED,
    UNREAD,
    Checked,
    Found,
    Reading,
)

from ...presentation.tables.table import Column, Summary, Table

OUTCOMES = (AGREES, DIFFERS, DEVIATES, UNREAD, REFUSED, NEITHER, LOST)
NAMES = tuple(dict.fromkeys(engine for engines in ENGINES.values() for engine in engines))
SHOWS = (
    "Differences are the largest in random configurations, or frames: of positions and linear "
    "velocities over the extent of the links, of rotation matrices and angular velocities."
)


class Report(NamedTuple):
    """A row for each file, a row for each kind and engine, and how many readings disagree."""

    files: Table
    summary: Table
    disagreements: int


def report(found: Found, checked: Sequence[Checked]) -> Report:
    """Return the tables of files that were checked."""
    rows = [_row(one) for one in checked if one.file.kind != FRAGMENT]
    files = Table(
        "files",
        "Files",
        tuple(Column(name, words=True) for name in ("file", "format", *NAMES)),
        tuple(rows),
        shows=SHOWS,
        summary=Summary("", tuple(point for one in checked for point in _points(one))),
    )
    return Report(files, *_summary(found, checked))


def _summary(found: Found, checked: Sequence[Checked]) -> tuple[Table, int]:
    """Return a row for each kind and engine, of the outcomes that there are, and disagreements."""
    readings: dict[tuple[str, str], list[Reading]] = {
        (kind, engine): [] for kind, engines in ENGINES.items() for engine in engines
    }
    for one in checked:
        for reading in one.readings:
            readings[one.file.kind, reading.engine].append(reading)
    found_outcomes = {r.outcome for of in readings.values() for r in of}
    outcomes = [name for name in OUTCOMES if name in (AGREES, DIFFERS, *found_outcomes)]
    disagreements = sum(r.outcome == DIFFERS for of in readings.values() for r in of)
    names = [Column(name, words=True) for name in ("format", "beside")]
    summary = Table(
        "summary",
        "Who reads and who agrees",
        (*names, *map(Column, ("files", *outcomes, "agrees within"))),
        tuple((*of, *_count(these, outcomes)) for of, these in readings.items() if these),
        summary=Summary(_sentence(found, checked, disagreements)),
    )
    return summary, disagreements


def _row(one: Checked) -> tuple[str, ...]:
    said = {reading.engine: _cell(reading) for reading in one.readings}
    return (_name(one), one.file.kind, *(said.get(name, "–") for name in NAMES))


def _cell(reading: Reading) -> str:
    if reading.difference is None:
        return reading.outcome
    return f"{reading.outcome} ({reading.difference:.1e})"


def _name(one: Checked) -> str:
    root = one.file.root
    return (Path(root.resolve().name) / one.file.path.relative_to(root)).as_posix()


def _points(one: Checked) -> list[str]:
    """Return what is to be said of a file beyond its row."""
    said = [f"{r.engine}: {r.outcome}: {r.why}" for r in one.readings if r.why]
    notes = dict.fromkeys(note for r in one.readings for note in r.notes)
    return [f"{_name(one)}: {sentence}" for sentence in (*said, *notes)]


def _count(readings: list[Reading], outcomes: list[str]) -> list[int | float | None]:
    """Return how many files there are, how many of each outcome, and the largest difference."""
    agreed = [r.difference or 0.0 for r in readings if r.outcome == AGREES]
    counts = [sum(r.outcome == outcome for r in readings) for outcome in outcomes]
    return [len(readings), *counts, max(agreed, default=None)]


def _sentence(found: Found, checked: Sequence[Checked], disagreements: int) -> str:
    fragments = sum(one.file.kind == FRAGMENT for one in checked)
    unread = sum(
        bool(one.readings) and all(reading.outcome == NEITHER for reading in one.readings)
        for one in checked
    )
    silent = f", {_counted(unread, 'is', 'are')} read by none" if unread else ""
    differ = _counted(disagreements, "reading disagrees", "readings disagree")
    parts = _counted(fragments, "is a part", "are parts")
    others = _counted(found.others, "XML file is", "XML files are")
    return (
        f"Of {len(checked) - fragments:,} files {differ if disagreements else 'nothing disagrees'}"
        f"{silent};"
        f" {parts} that others include, {others} of other kinds"
    )


def _counted(count: int, one: str, many: str) -> str:
    return f"{count:,} {one if count == 1 else many}"
