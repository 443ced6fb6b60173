"""What comes of files of anyone beside the engines, as tables and sentences."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from plumbob.crosscheck.engines.file_kind import FRAGMENT
from plumbob.crosscheck.robots import files
from plumbob.crosscheck.robots.files import (
    AGREES,
    DIFFERS,
    ENGINES,
    CheckedFile,
    FileReading,
    FileSelection,
)

from ...tables.columns import text
from ...tables.table import Column, Summary, Table, cells, words

# Outcomes by which a file is counted; the first two are shown whether there are any or not.
OUTCOMES = (
    AGREES,
    DIFFERS,
    files.DEVIATES,
    files.UNREAD,
    files.REFUSED,
    files.NEITHER,
    files.CRASHED,
)
SHOWS = (
    "Differences are the largest in random configurations, or frames: of positions and linear "
    "velocities over the extent of the links, of rotation matrices and angular velocities."
)
# A kind of files and an engine, with all readings of such files by it.
Group = tuple[tuple[str, str], list[FileReading]]


class Report(NamedTuple):
    """A row for each file, a row for each kind and engine, and how many readings disagree."""

    files: Table
    summary: Table
    disagreements: int


def report(found: FileSelection, checked: Sequence[CheckedFile]) -> Report:
    """Return the tables of files that were checked."""
    readings = [reading for file in checked for reading in file.readings]
    engines = dict.fromkeys(engine for engines in ENGINES.values() for engine in engines)
    asked = [engine for engine in engines if engine in {reading.engine for reading in readings}]
    columns = (
        text("file", _name),
        text("format", lambda checked: checked.file.kind),
        *(text(engine, partial(_outcome, engine)) for engine in asked),
    )
    whole = [file for file in checked if file.file.kind != FRAGMENT]
    points = tuple(point for file in checked for point in _points(file))
    table = Table("files", "Files", columns, cells(columns, whole), summary=Summary(SHOWS, points))
    disagreements = sum(reading.outcome == DIFFERS for reading in readings)
    summary = Summary(_sentence(found, checked, disagreements))
    return Report(table, _summary(list(_groups(checked)), summary), disagreements)


def _groups(checked: Sequence[CheckedFile]) -> Iterator[Group]:
    """Yield the readings of each kind of files by each engine, if there are any."""
    for kind, engines in ENGINES.items():
        of_kind = [r for file in checked if file.file.kind == kind for r in file.readings]
        for engine in engines:
            if readings := [reading for reading in of_kind if reading.engine == engine]:
                yield (kind, engine), readings


def _summary(groups: Sequence[Group], summary: Summary) -> Table:
    """Return a row for each kind and engine, with the outcomes that there are."""
    present = {AGREES, DIFFERS, *(r.outcome for _, readings in groups for r in readings)}
    columns = (
        text("format", lambda group: group[0][0]),
        text("beside", lambda group: group[0][1]),
        Column("files", read=lambda group: len(group[1])),
        *(Column(o, read=partial(_count, o)) for o in OUTCOMES if o in present),
        Column("agrees within", read=_largest_difference),
    )
    title = "Who reads and who agrees"
    return Table("summary", title, columns, cells(columns, groups), summary=summary)


def _outcome(engine: str, checked: CheckedFile) -> str | None:
    """Return what came of an engine's reading, with the difference; None if it was not asked."""
    reading = next((r for r in checked.readings if r.engine == engine), None)
    if reading is None or reading.difference is None:
        return reading and reading.outcome
    return f"{reading.outcome} ({words(reading.difference)})"


def _count(outcome: str, group: Group) -> int:
    return sum(reading.outcome == outcome for reading in group[1])


def _largest_difference(group: Group) -> float | None:
    """Return the largest difference of the readings that agree, None where none does."""
    return max((r.difference or 0.0 for r in group[1] if r.outcome == AGREES), default=None)


def _name(checked: CheckedFile) -> str:
    root = checked.file.root
    return (Path(root.resolve().name) / checked.file.path.relative_to(root)).as_posix()


def _points(checked: CheckedFile) -> Iterator[str]:
    """Return what is to be said of a file beyond its row."""
    reasons = [f"{r.engine}: {r.outcome}: {r.why}" for r in checked.readings if r.why]
    notes = dict.fromkeys(note for reading in checked.readings for note in reading.notes)
    return (f"{_name(checked)}: {sentence}" for sentence in (*reasons, *notes))


def _sentence(found: FileSelection, checked: Sequence[CheckedFile], disagreements: int) -> str:
    fragments = sum(file.file.kind == FRAGMENT for file in checked)
    outcomes = ({reading.outcome for reading in file.readings} for file in checked)
    unread = sum(outcome == {files.NEITHER} for outcome in outcomes)
    silent = f", {_counted(unread, 'is', 'are')} read by none" if unread else ""
    differ = _counted(disagreements, "reading disagrees", "readings disagree")
    parts = _counted(fragments, "is a part", "are parts")
    others = _counted(found.ignored, "XML file is", "XML files are")
    return (
        f"Of {len(checked) - fragments:,} files {differ if disagreements else 'nothing disagrees'}"
        f"{silent}; {parts} that others include, {others} of other kinds"
    )


def _counted(count: int, one: str, many: str) -> str:
    return f"{count:,} {one if count == 1 else many}"
