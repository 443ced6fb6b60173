"""The records of a report, and how problems and solvers are written."""

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from ..harness.metrics import Ranking
from ..harness.record import Record, on_record
from ..peers import registry
from ..text import all_visible
from .table import words

# So much may a time that is shown be off, in relative terms, by the drift of its machine.
PRECISION = 0.05
# Of more solvers that tie with the first a sentence gives only the number.
NAMED_TIES = 3

Subject = TypeVar("Subject")
Key = TypeVar("Key", bound=Hashable)


class Results:
    """The records that hold numbers, in the order of the file, to be asked for by what they are.

    Whatever their words are, they can be shown anywhere.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        """Leave out those that say why there are none, and those under settings of before."""
        self.every = [printable(record) for record in records if not record.superseded]
        self.records = [record for record in self.every if not record.failed]
        self.failed = [record for record in self.every if record.failed]

    @property
    def entrants(self) -> frozenset[str]:
        """The solvers that a user has entered."""
        return frozenset(r.solver for r in self.records if r.facts.get("entrant") is True)

    def all(self, suite: str, failed: bool = False, **wanted: Any) -> list[Record]:
        """Return a suite's records with these facts and settings; failed ones only on demand."""
        records = [*self.records, *self.failed] if failed else self.records
        return [record for record in records if record.suite == suite and _has(record, wanted)]

    def one(self, suite: str, problem: str, solver: str, **wanted: Any) -> Record | None:
        """Return the record of exactly this problem and solver, or None."""
        found = self.all(suite, **wanted)
        return next((r for r in found if (r.problem, r.solver) == (problem, solver)), None)


def _has(record: Record, wanted: dict[str, Any]) -> bool:
    known = {**record.settings, **record.facts}
    return all(known.get(name) == value for name, value in wanted.items())


def printable(record: Record) -> Record:
    """Return a record whose words can be shown anywhere."""
    names = ("suite", "problem", "solver", "settings", "notes", "stamp", "facts")
    return replace(record, **{name: all_visible(getattr(record, name)) for name in names})


def results_of(folder: Path) -> tuple[Results, str]:
    """Return what a folder has on record to be shown, and a sentence on what cannot be, or "".

    Raises:
        ValueError: if there are no records, or they cannot be read.
    """
    records, warning = on_record(folder)
    results = Results(records)
    if not results.every:
        raise ValueError(f"no records in {folder}: all are superseded; run `plumbob bench` first")
    return results, warning


def label(solver: str) -> str:
    """Return how a solver is written."""
    return registry.find(solver).label


def grouped(subjects: Iterable[Subject], key: Callable[[Subject], Key]) -> dict[Key, list[Subject]]:
    """Return the subjects of each key, in order."""
    groups: dict[Key, list[Subject]] = {}
    for subject in subjects:
        groups.setdefault(key(subject), []).append(subject)
    return groups


def by_problem(records: Iterable[Record]) -> dict[str, list[Record]]:
    """Return the records of each problem, in order."""
    return grouped(records, lambda record: record.problem)


def problems(records: Iterable[Record]) -> list[str]:
    """Return the names of the problems, each once, in the order of the records."""
    return list(dict.fromkeys(record.problem for record in records))


def solvers(records: Iterable[Record]) -> list[str]:
    """Return the names of the solvers, each once, in the order of the records."""
    return list(dict.fromkeys(record.solver for record in records))


def settings(records: Iterable[Record], name: str) -> str:
    """Return the values of a setting as words, smallest first: "100 or 1,000"."""
    values = sorted({r.settings[name] for r in records if name in r.settings})
    return listed([words(value) for value in values], "or")


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names as a list in a sentence: "a, b and c", or "a, 1; b, 2 and c"."""
    comma = "; " if any(", " in name for name in names) else ", "
    return f" {last} ".join(filter(None, [comma.join(names[:-1]), *names[-1:]]))


def counted(count: int, name: str) -> str:
    """Return a count of things: "1 iteration", "2 iterations"."""
    return f"{words(count)} {name}{'' if count == 1 else 's'}"


def leaders(ranking: Ranking) -> str:
    """Return who is first, and who is not told from that one: "a, in a tie with b and c"."""
    first, *tied = ranking.first
    others = listed(tied) if len(tied) <= NAMED_TIES else f"{len(tied)} others"
    return f"{first}, in a tie with {others}" if tied else first


def steadiness(noise: float) -> str:
    """Return whether a machine was steady enough for the precision that is stated, "" if unknown.

    `noise` is half the width of the middle eight tenths of a fixed loop's times, over their median.
    """
    if math.isnan(noise):
        return ""
    said = f"a fixed loop timed meanwhile varied by ± {round(100 * noise, 1):g} %"
    stated = f"{100 * PRECISION:g} %"
    if noise > PRECISION:
        return f"The machine was too noisy for the {stated} that are aimed at: {said}."
    return f"The machine was steady within the {stated} that are aimed at: {said}."
