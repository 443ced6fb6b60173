"""What comes of files of anyone beside the engines, as tables and sentences."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from plumbob.crosscheck.engines.file_kind import FRAGMENT
from plumbob.crosscheck.robots.files import (
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

from ...tables.columns import text
from ...tables.table import Column, Summary, Table, cells, words

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
    asked = {reading.engine for one in checked for reading in one.readings}
    columns = (
        text("file", _name),
        text("format", lambda one: one.file.kind),
        *(text(engine, partial(_outcome, engine)) for engine in NAMES if engine in asked),
    )
    whole = [one for one in checked if one.file.kind != FRAGMENT]
    points = tuple(point for one in checked for point in _points(one))
    files = Table("files", "Files", columns, cells(columns, whole), summary=Summary(SHOWS, points))
    return Report(files, *_summary(found, checked))


def _summary(found: Found, checked: Sequence[Checked]) -> tuple[Table, int]:
    """Return a row for each kind and engine, of the outcomes that there are, and disagreements."""
    groups: dict[tuple[str, str], list[Reading]] = {
        (kind, engine): [] for kind, engines in ENGINES.items() for engine in engines
    }
    for one in checked:
        for reading in one.readings:
            groups[one.file.kind, reading.engine].append(reading)
    found_outcomes = {r.outcome for of in groups.values() for r in of}
    disagreements = sum(r.outcome == DIFFERS for of in groups.values() for r in of)
    columns = (
        text("format", lambda group: group[0][0]),
        text("beside", lambda group: group[0][1]),
        Column("files", read=lambda group: len(group[1])),
        *(
            Column(outcome, read=partial(_count, outcome))
            for outcome in OUTCOMES
            if outcome in (AGREES, DIFFERS, *found_outcomes)
        ),
        Column("agrees within", read=_largest_difference),
    )
    summary = Summary(_sentence(found, checked, disagreements))
    rows = cells(columns, (group for group in groups.items() if group[1]))
    title = "Who reads and who agrees"
    return Table("summary", title, columns, rows, summary=summary), disagreements


def _outcome(engine: str, checked: Checked) -> str | None:
    """Return what came of an engine's reading, with the difference; None if it was not asked."""
    reading = next((r for r in checked.readings if r.engine == engine), None)
    if reading is None or reading.difference is None:
        return reading and reading.outcome
    return f"{reading.outcome} ({words(reading.difference)})"


def _count(outcome: str, group: tuple[object, Sequence[Reading]]) -> int:
    return sum(reading.outcome == outcome for reading in group[1])


def _largest_difference(group: tuple[object, Sequence[Reading]]) -> float | None:
    """Return the largest difference of the readings that agree, None where none does."""
    return max((r.difference or 0.0 for r in group[1] if r.outcome == AGREES), default=None)


def _name(one: Checked) -> str:
    root = one.file.root
    return (Path(root.resolve().name) / one.file.path.relative_to(root)).as_posix()


def _points(one: Checked) -> list[str]:
    """Return what is to be said of a file beyond its row."""
    said = [f"{r.engine}: {r.outcome}: {r.why}" for r in one.readings if r.why]
    notes = dict.fromkeys(note for r in one.readings for note in r.notes)
    return [f"{_name(one)}: {sentence}" for sentence in (*said, *notes)]


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
