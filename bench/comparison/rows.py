"""The rows of a comparison: what two runs have of the same problem, solver and settings."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from ..harness import record as records
from ..harness.record import FINISHED, Record

RowKey = tuple[str, str, str, str]


class Verdict(StrEnum):
    """What a comparison says of a row, the worst first."""

    LESS_RIGHT = "LESS RIGHT"
    CHANGED = "CHANGED"
    GONE = "GONE"
    SLOWER = "SLOWER"
    UNDECIDED = "UNDECIDED"
    MORE_RIGHT = "MORE RIGHT"
    FASTER = "FASTER"
    NEW = "NEW"
    SAME = "SAME"


ORDER = list(Verdict)
# What may change between runs of one row: the version of what is measured.
_MOVING = frozenset({"version"})


class Ratio(NamedTuple):
    """New time over old, its interval, and how likely as much is by chance.

    The interval holds the ratio in 95 % of runs.
    """

    value: float
    low: float
    high: float
    chance: float


class Pair(NamedTuple):
    """The records of a row in two runs."""

    old: Record
    new: Record


@dataclass(frozen=True)
class Row:
    """A quantity of a problem solved by a solver, in two runs.

    Attributes:
        key: suite, problem, solver, and settings as JSON, but for versions.
        quantity: the array that decided; "" where the whole record did.
        verdict: what is said of it.
        change: by what it is sorted: how far apart the two are, as a share.
        why: one sentence.
        ratio: new time over old, where times are compared.
    """

    key: RowKey
    quantity: str
    verdict: Verdict
    change: float = 0.0
    why: str = ""
    ratio: Ratio | None = None

    @property
    def title(self) -> str:
        """Problem, solver and quantity in one."""
        return ", ".join(filter(None, [*self.key[1:3], self.quantity]))

    @property
    def settings(self) -> dict[str, Any]:
        """The settings by which the row is joined."""
        return json.loads(self.key[3])


def row_key(record: Record) -> RowKey:
    """Return what makes two records of two runs the same row."""
    settings = {name: value for name, value in record.settings.items() if name not in _MOVING}
    return records.key(record.suite, record.problem, record.solver, settings)


def by_row(some: Iterable[Record]) -> dict[RowKey, Record]:
    """Return the records that measured something or failed, by row, the latest if several."""
    return {
        row_key(record): record
        for record in sorted(some, key=lambda record: record.when)
        if record.suite != FINISHED and not record.superseded and (record.arrays or record.failed)
    }


def pairs(old: Mapping[RowKey, Record], new: Mapping[RowKey, Record]) -> dict[RowKey, Pair]:
    """Return the rows that both runs have numbers of."""
    both = {key: Pair(record, new[key]) for key, record in old.items() if key in new}
    return {key: pair for key, pair in both.items() if not any(r.failed for r in pair)}


def come_and_gone(old: Mapping[RowKey, Record], new: Mapping[RowKey, Record]) -> Iterator[Row]:
    """Yield the rows that only one run has numbers of."""
    for key in {**old, **new}:
        before, after = old.get(key), new.get(key)
        fails, failed = (record is not None and bool(record.failed) for record in (after, before))
        if after and fails and not failed:
            verdict = Verdict.LESS_RIGHT if before else Verdict.NEW
            yield Row(key, "", verdict, 1.0, f"it failed: {after.failed}")
        elif before is None or (failed and after and not fails):
            yield Row(key, "", Verdict.NEW, why="measured in the new run only")
        elif after is None:
            yield Row(key, "", Verdict.GONE, why="measured in the old run only")


def distinguishing(keys: Iterable[RowKey]) -> dict[RowKey, str]:
    """Return the settings that tell a row from others of its problem and solver, as words."""
    groups: dict[tuple[str, ...], dict[RowKey, dict[str, str]]] = {}
    for key in keys:
        settings = {name: json.dumps(value) for name, value in json.loads(key[3]).items()}
        groups.setdefault(key[:3], {})[key] = settings
    return {
        key: ", ".join(f"{name} {value}" for name, value in settings.items()
                       if len({other.get(name) for other in group.values()}) > 1)
        for group in groups.values() for key, settings in group.items()
    }  # fmt: skip


def worst_first(rows: Iterable[Row]) -> list[Row]:
    """Return rows by verdict, and within a verdict the greatest change first."""
    return sorted(rows, key=lambda row: (ORDER.index(row.verdict), -row.change, row.title))


def is_meant(key: Sequence[str], words: Sequence[str]) -> bool:
    """Return whether a problem or a solver contains one of the words; any does if there is none."""
    return not words or any(word in part for word in words for part in key[1:3])
