"""The layout of a table: its question, subjects, columns and figures; and its provenance."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..measure.record import Record
from ..peers import catalogue
from .columns import extent_in_words
from .results import Results, settings
from .table import (
    NO_SUMMARY,
    Column,
    Source,
    Summary,
    Table,
    best_cells,
    cells,
    ranked_rows,
    with_rows,
)

# Returns the sketch of a figure, None if its records are missing.
Figure = Callable[[Results], Any]
# Arrays with an entry for each target, and the suites whose residuals are such an array.
_OF_TARGETS, _TARGETED_SUITES = ("solved", "converged", "solutions"), ("arm", "ik", "tracking")
NOT_MEASURED = "Nothing of this is on record yet."
# The package of an engine, by its name in the catalogue.
_PACKAGES = {
    catalogue.PINOCCHIO: "pin",
    catalogue.MUJOCO: "mujoco",
    catalogue.NEWTON: "newton",
    "SciPy": "scipy",
}


@dataclass(frozen=True, eq=False)
class Layout:
    """A table without rows, called with results to fill it."""

    question: str  # that the table answers, in the report
    name: str  # the stem of its files
    title: str  # its heading
    subjects: Callable[[Results], Iterable[Any]]  # of the rows, such as records
    # of the table, or a function from all subjects to the words
    columns: Sequence[Column] | Callable[[Any], Sequence[Column]]
    shows: str  # a sentence on the contents
    # a sentence on how the numbers were measured, or a function of all subjects
    measured: str | Callable[[Any], str]
    # of the numbers, called with all subjects if there are any
    summary: Callable[[Any], Summary] = lambda subjects: NO_SUMMARY
    figures: tuple[Figure, ...] = ()  # beside the table
    compared: int = 1  # rows with so many equal first cells are compared; 0: all are
    # whether a subject may be best in its group
    ranked: Callable[[Any], bool] = lambda subject: True
    # by titles of columns, whether a subject is best, where a test of its own decides
    leads: Callable[[Any], Mapping[str, bool]] = lambda subject: {}

    def __call__(self, results: Results) -> Table:
        """Return the table with a row for each subject, the best of each group first.

        Rows of our own loops on other engines are shown, and never marked best.
        """
        return results.cached(self._table)

    def _table(self, results: Results) -> Table:
        subjects = list(self.subjects(results))
        columns = tuple(self.columns(subjects) if callable(self.columns) else self.columns)
        measured = self.measured
        if callable(measured):
            measured = measured(subjects) if subjects else NOT_MEASURED
        table = Table(
            self.name,
            self.title,
            columns,
            cells(columns, subjects),
            self.shows,
            measured,
            self.summary(subjects) if subjects else NO_SUMMARY,
            self.compared,
            frozenset(i for i, s in enumerate(subjects) if not self.ranked(s) or is_loop(s)),
            tuple(map(source, subjects)),
            provenance(list(dict.fromkeys(records_of(subjects)))),
        )
        return with_rows(self._with_leaders(table, subjects), ranked_rows(table))

    def _with_leaders(self, table: Table, subjects: Sequence[Any]) -> Table:
        """Return a table whose best cells follow the deciding tests, if any.

        Where all rows tie, none is best.
        """
        titles = [column.title for column in table.columns]
        decided = {
            (i, titles.index(title)): is_best
            for i, subject in enumerate(subjects)
            for title, is_best in self.leads(subject).items()
            if title in titles
        }
        if not decided:
            return table
        groups = [row[: table.compared] for row in table.rows]
        losing = {(groups[i], j) for (i, j), is_best in decided.items() if not is_best}
        winning = {
            (i, j) for (i, j), is_best in decided.items() if is_best and (groups[i], j) in losing
        }
        return replace(table, best=frozenset((best_cells(table) - {*decided}) | winning))


def is_loop(subject: Any) -> bool:
    """Return whether the row of this subject is of our own loop on another engine."""
    return any(map(catalogue.is_loop, source(subject).solvers[:1]))


def source(subject: Any) -> Source:
    """Return the measurements behind the row of this subject."""
    records = [record for record in records_of(subject) if record.has_numbers]
    if not records:
        return Source()
    problems, solvers = ({r.problem: 0 for r in records}, {r.solver: 0 for r in records})
    return Source(records[0].suite, tuple(problems), tuple(solvers))


def records_of(subject: Any) -> Iterator[Record]:
    """Yield the records of a row's subject, from its attribute `record` or `records` if any."""
    if isinstance(subject, Record):
        yield subject
    elif isinstance(getattr(subject, "record", None), Record):
        yield subject.record
    elif isinstance(getattr(subject, "records", None), tuple):
        yield from subject.records
    elif isinstance(subject, Mapping):
        yield from records_of(tuple(subject.values()))
    elif isinstance(subject, tuple | list):
        for part in subject:
            yield from records_of(part)


def provenance(records: Sequence[Record]) -> str:
    """Return samples, tolerance, machine, versions and dates of records; "" if there are none."""
    tolerance = settings(records, "tolerance")
    newest = {r.solver: r for r in sorted(records, key=lambda record: record.when)}
    days = sorted({record.when[:10] for record in records if record.when})
    parts = [
        _samples(records),
        tolerance and f"tolerance {tolerance}",
        _distinct(_machine(record.stamp.get("machine", {})) for record in records),
        _distinct(_plumbob_and_python(record.stamp.get("versions", {})) for record in records),
        _distinct(map(_engine_version, newest.values())),
        " to ".join(dict.fromkeys([*days[:1], *days[-1:]])),
    ]
    return "; ".join(filter(None, parts))


def _distinct(texts: Iterable[str]) -> str:
    return ", ".join(filter(None, dict.fromkeys(texts)))


def _samples(records: Sequence[Record]) -> str:
    """Return the number of targets of a record, and of rounds: "20 to 200 targets, 3 rounds"."""
    counts: dict[str, set[int]] = {"target": set(), "round": set()}
    for record in records:
        numbers = record.numbers()
        names = (*_OF_TARGETS, *["residual"] * (record.suite in _TARGETED_SUITES))
        arrays = [numbers[name] for name in names if name in numbers]
        counts["target"] |= {array.size for array in arrays}
        seconds = numbers.get("seconds", np.empty(0))
        if seconds.ndim > 1:  # (round, target), or (sweep, round) without targets
            counts["round"].add(len(seconds) if arrays else seconds.size)
    extents = {noun: extent_in_words(sizes - {0, 1}) for noun, sizes in counts.items()}
    return ", ".join(f"{sizes} {noun}s" for noun, sizes in extents.items() if sizes)


def _machine(machine: Mapping[str, Any]) -> str:
    cores = machine.get("cores")
    return f"{machine.get('processor', '')}{f' ({cores} cores)' if cores else ''}"


def _plumbob_and_python(versions: Mapping[str, Any]) -> str:
    titles = ("Plumbob", "Python")
    return ", ".join(f"{t} {versions[t.lower()]}" for t in titles if versions.get(t.lower()))


def _engine_version(record: Record) -> str:
    """Return the package and version of a record's solver, "" if ours or unknown."""
    engine = catalogue.find(record.solver).engine
    package = _PACKAGES.get(engine, engine) or record.solver
    version = record.settings.get("version") or record.stamp.get("versions", {}).get(package)
    return f"{package} {version}" if version and package.lower() != "plumbob" else ""
