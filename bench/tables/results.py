"""The records of a report, and the words for problems, solvers and counts."""

import math
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from plumbob.text.printable import all_visible

from ..measure.metrics import Ranking
from ..measure.record import Record, on_record
from ..peers import catalogue
from .table import words

# The relative precision of a displayed time, given the drift of its machine: half of the margin
# within which `plumbob compare` calls times the same.
PRECISION = 0.05
# If more solvers tie with the first, a sentence gives only their number.
NAMED_TIES = 3

Subject = TypeVar("Subject")
Key = TypeVar("Key", bound=Hashable)
Product = TypeVar("Product")


class Results:
    """The current records of a folder in the order of the file, without unprintable characters.

    Attributes:
        every: all records.
        records: records with numbers.
        failed: records that could not be measured.
    """

    def __init__(self, records: Iterable[Record]) -> None:
        """Leave out superseded records."""
        self.every = [printable(record) for record in records if not record.superseded]
        self.records = [record for record in self.every if not record.failed]
        self.failed = [record for record in self.every if record.failed]
        self._products: dict[tuple[Any, ...], Any] = {}

    def cached(self, make: Callable[..., Product], *arguments: Hashable) -> Product:
        """Return what a function makes of the results and arguments, made at the first request."""
        if (key := (make, *arguments)) not in self._products:
            self._products[key] = make(self, *arguments)
        product: Product = self._products[key]
        return product

    @property
    def user_solvers(self) -> frozenset[str]:
        """The solvers entered by a user."""
        return frozenset(r.solver for r in self.records if r.measured.get("entrant") is True)

    def all(self, suite: str, failed: bool = False, **facts: Any) -> list[Record]:
        """Return a suite's records with these facts or settings; failed records only on demand."""
        records = [*self.records, *self.failed] if failed else self.records
        return [record for record in records if record.suite == suite and _has(record, facts)]


def _has(record: Record, facts: dict[str, Any]) -> bool:
    properties = {**record.settings, **record.measured}
    return all(properties.get(name) == fact for name, fact in facts.items())


def printable(record: Record) -> Record:
    """Return a record with words that are safe to print anywhere."""
    names = ("suite", "problem", "solver", "settings", "measured", "stamp")
    return replace(record, **{name: all_visible(getattr(record, name)) for name in names})


def results_of(folder: Path) -> tuple[Results, str]:
    """Return the results in a folder, and a warning on lines that cannot be read, or "".

    Raises:
        ValueError: if there are no records, or records cannot be read.
    """
    records, warning = on_record(folder)
    results = Results(records)
    if not results.every:
        raise ValueError(f"no records in {folder}: all are superseded; run `plumbob bench` first")
    return results, warning


def label(solver: str) -> str:
    """Return a solver's name in tables and figures."""
    return catalogue.find(solver).label


def grouped(subjects: Iterable[Subject], key: Callable[[Subject], Key]) -> dict[Key, list[Subject]]:
    """Return the subjects of each key, in order."""
    groups: dict[Key, list[Subject]] = {}
    for subject in subjects:
        groups.setdefault(key(subject), []).append(subject)
    return groups


def by_problem(records: Iterable[Record]) -> dict[str, list[Record]]:
    """Return the records of each problem, in order."""
    return grouped(records, lambda record: record.problem)


def solvers(records: Iterable[Record]) -> list[str]:
    """Return the distinct solvers in the order of the records."""
    return list(dict.fromkeys(record.solver for record in records))


def settings(records: Iterable[Record], name: str) -> str:
    """Return the distinct values of a setting, smallest first: "100 or 1,000"."""
    distinct = sorted({r.settings[name] for r in records if name in r.settings})
    return listed([words(setting) for setting in distinct], "or")


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names as a list in a sentence: "a, b and c", or "a, 1; b, 2 and c"."""
    comma = "; " if any(", " in name for name in names) else ", "
    return f" {last} ".join(filter(None, [comma.join(names[:-1]), *names[-1:]]))


def counted(count: int, noun: str) -> str:
    """Return a count with its noun: "1 iteration", "2 iterations"."""
    return f"{words(count)} {noun}{'' if count == 1 else 's'}"


def most_often(firsts: Sequence[str], noun: str) -> str:
    """Return the name most often first: "A on 3 of 5 robots", "nobody on 2 robots".

    A name is "" where solvers of different engines tie.
    """
    names = Counter(filter(None, firsts))
    if not names:
        return f"nobody on {counted(len(firsts), noun)}"
    name, count = names.most_common(1)[0]
    return f"{name} on {count} of {counted(len(firsts), noun)}"


def first_of_kinds(firsts: Iterable[tuple[str, str]], noun: str) -> str:
    """Return the name most often first of each kind: "A on 3 of 3 robots (one start) and ...".

    `firsts` are pairs of a kind, "" if there is one only, and a name as in `most_often`.
    """
    kinds = grouped(firsts, lambda pair: pair[0])
    parts = ((kind, most_often([name for _, name in kinds[kind]], noun)) for kind in kinds)
    return listed([f"{part} ({kind})" if kind else part for kind, part in parts])


def only_first(ranking: Ranking) -> str:
    """Return the first of a ranking, "" if there is none or another ties with the first."""
    return ranking.first[0] if len(ranking.first) == 1 else ""


def leaders(ranking: Ranking) -> str:
    """Return the first of a ranking and its ties: "a, in a tie with b and c"."""
    first, *ties = ranking.first
    names = listed(ties) if len(ties) <= NAMED_TIES else f"{len(ties)} others"
    return f"{first}, in a tie with {names}" if ties else first


def steadiness(noise: float) -> str:
    """Return a sentence on whether the machine was steady enough for `PRECISION`, "" if unknown.

    `noise` is half the width of the middle eight tenths of a fixed loop's times, over their median.
    """
    if math.isnan(noise):
        return ""
    variation = f"the time of a fixed loop varied by ± {round(100 * noise, 1):g} %"
    goal = f"{100 * PRECISION:g} %"
    if noise > PRECISION:
        return f"The machine was too noisy for a precision of {goal}: {variation}."
    return f"The machine was steady within {goal}: {variation}."
