"""A table as data: the question it answers, what its rows are about, its columns and figures."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..harness.record import Record
from .provenance import provenance
from .results import Results
from .table import NO_SUMMARY, Column, Source, Summary, Table, cells

# Makes a sketch of results, None of what is not on record.
Figure = Callable[[Results], Any]
# How the numbers of a table came about that has none.
NOT_MEASURED = "Nothing of this is on record yet."


@dataclass(frozen=True, eq=False)
class Layout:
    """A table before it has rows, called with results to fill it.

    Attributes:
        question: what it answers, in the report.
        name: the stem of its files.
        title: what it is called.
        subjects: what the rows are about, one each, such as records.
        columns: how the cells are read from a subject, or what makes the columns from all.
        shows: one sentence on what can be read off, or what makes it from all subjects.
        measured: one sentence on how the numbers came about, likewise.
        summary: what the numbers say, asked for only where there are subjects.
        figures: what stands beside it.
        compared: rows whose first so many cells agree are compared with one another; 0: all are.
        ranked: whether a subject may be best in its group.
        optional: whether nothing is missing where it is empty.
    """

    question: str
    name: str
    title: str
    subjects: Callable[[Results], Iterable[Any]]
    columns: Sequence[Column] | Callable[[Any], Sequence[Column]]
    shows: str | Callable[[Any], str]
    measured: str | Callable[[Any], str]
    summary: Callable[[Any], Summary] = lambda subjects: NO_SUMMARY
    figures: tuple[Figure, ...] = ()
    compared: int = 1
    ranked: Callable[[Any], bool] = lambda subject: True
    optional: bool = False

    def __call__(self, results: Results) -> Table:
        """Return the table with a row for each subject."""
        subjects = list(self.subjects(results))
        columns = tuple(self.columns(subjects) if callable(self.columns) else self.columns)
        measured = self.measured
        if callable(measured):
            measured = measured(subjects) if subjects else NOT_MEASURED
        return Table(
            self.name,
            self.title,
            columns,
            cells(columns, subjects),
            self.shows if isinstance(self.shows, str) else self.shows(subjects),
            measured,
            self.summary(subjects) if subjects else NO_SUMMARY,
            self.compared,
            frozenset(i for i, subject in enumerate(subjects) if not self.ranked(subject)),
            tuple(map(source, subjects)),
            provenance(list(dict.fromkeys(records_of(subjects)))),
        )


def source(subject: Any) -> Source:
    """Return what was measured for the row that is about this subject."""
    records = [record for record in records_of(subject) if record.arrays]
    if not records:
        return Source()
    problems, solvers = ({r.problem: 0 for r in records}, {r.solver: 0 for r in records})
    return Source(records[0].suite, tuple(problems), tuple(solvers))


def records_of(subject: Any) -> Iterator[Record]:
    """Yield the records in a subject; where it has one of its own, only that."""
    if isinstance(subject, Record):
        yield subject
    elif isinstance(getattr(subject, "record", None), Record):
        yield subject.record
    elif isinstance(subject, Mapping):
        yield from records_of(tuple(subject.values()))
    elif isinstance(subject, tuple | list):
        for part in subject:
            yield from records_of(part)
