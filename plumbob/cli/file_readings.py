"""Lines and a table on how engines and the reference read a user's files."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from plumbob.bench.tables.columns import text
from plumbob.bench.tables.table import Column, Summary, Table, cells, words
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
from plumbob.text.printable import visible

# Outcomes by which files are counted; the first two are shown even where there are none.
READ = (AGREES, DIFFERS, files.DEVIATES)
OUTCOMES = (*READ, files.UNREAD, files.REFUSED, files.NEITHER, files.CRASHED)
SHOWS = (
    "Differences are the largest in random configurations, or frames: of positions and linear "
    "velocities over the extent of the links, of rotation matrices and angular velocities."
)


class FileGroup(NamedTuple):
    """How an engine read all files of a format."""

    kind: str
    engine: str
    readings: list[FileReading]


def lines_on(checked: CheckedFile) -> list[str]:
    """Return a line on how engines read a file, and lines on disagreements; none for a fragment."""
    if checked.file.kind == FRAGMENT:
        return []
    outcomes = "; ".join(f"{reading.engine} {_outcome(reading)}" for reading in checked.readings)
    return [visible(f"{_name(checked)} ({checked.file.kind}): {outcomes}"), *_points(checked)]


def summary(scan: FileSelection, checked: Sequence[CheckedFile]) -> tuple[Table, int]:
    """Return a row for each kind of file and engine, and how many readings disagree."""
    groups = [
        FileGroup(kind, engine, readings)
        for kind, engines in ENGINES.items()
        for engine in engines
        if (readings := _readings(kind, engine, checked))
    ]
    outcomes = [reading.outcome for group in groups for reading in group.readings]
    disagreements = outcomes.count(DIFFERS)
    sentences = f"{SHOWS} {_sentence(scan, checked, disagreements)}"
    return _summary(groups, {*outcomes}, Summary(sentences)), disagreements


def _readings(kind: str, engine: str, checked: Sequence[CheckedFile]) -> list[FileReading]:
    of_kind = [r for file in checked if file.file.kind == kind for r in file.readings]
    return [reading for reading in of_kind if reading.engine == engine]


def _summary(groups: Sequence[FileGroup], outcomes: set[str], summary: Summary) -> Table:
    """Return a row for each kind and engine, with a count of each outcome."""

    def count(outcome: str, group: FileGroup) -> int:
        return sum(reading.outcome == outcome for reading in group.readings)

    columns = (
        text("format", lambda group: group.kind),
        text("compared with", lambda group: group.engine),
        Column("files", read=lambda group: len(group.readings)),
        *(Column(o, read=partial(count, o)) for o in OUTCOMES if o in {AGREES, DIFFERS, *outcomes}),
        Column("largest difference", read=_largest_difference),
    )
    title = "Who reads and who agrees"
    return Table("summary", title, columns, cells(columns, groups), summary=summary)


def _outcome(reading: FileReading) -> str:
    """Return the outcome of a reading, with any difference."""
    if reading.difference is None:
        return reading.outcome
    return f"{reading.outcome} ({words(reading.difference)})"


def _largest_difference(group: FileGroup) -> float | None:
    """Return the largest difference of the readings in agreement, None without any."""
    return max((r.difference or 0.0 for r in group.readings if r.outcome == AGREES), default=None)


def _name(checked: CheckedFile) -> str:
    root = checked.file.root
    return (Path(root.resolve().name) / checked.file.path.relative_to(root)).as_posix()


def _points(checked: CheckedFile) -> Iterator[str]:
    """Return indented lines with the reasons and notes of a file's readings."""
    reasons = [f"{r.engine}: {r.outcome}: {r.why}" for r in checked.readings if r.why]
    notes = dict.fromkeys(note for reading in checked.readings for note in reading.notes)
    return (f"  {visible(sentence)}" for sentence in (*reasons, *notes))


def _sentence(scan: FileSelection, checked: Sequence[CheckedFile], disagreements: int) -> str:
    def counted(count: int, singular: str, plural: str) -> str:
        return f"{count:,} {singular if count == 1 else plural}"

    fragments = sum(file.file.kind == FRAGMENT for file in checked)
    outcomes = ({reading.outcome for reading in file.readings} for file in checked)
    unread = sum(outcome == {files.NEITHER} for outcome in outcomes)
    silent = f", {counted(unread, 'is', 'are')} read by none" if unread else ""
    differ = counted(disagreements, "reading", "readings") if disagreements else "no reading"
    verb = "disagrees" if disagreements < 2 else "disagree"
    total = counted(len(checked) - fragments, "file", "files")
    parts = counted(fragments, "is a part", "are parts")
    ignored = counted(scan.ignored, "XML file is", "XML files are")
    return (
        f"In {total} {differ} {verb}{silent}; {parts} that others include, {ignored} of other kinds"
    )
