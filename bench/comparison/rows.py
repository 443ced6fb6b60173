"""The rows of a comparison: what two runs have of the same problem, solver and settings."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from ..harness.record import FINISHED, Record
from .intervals import Ratio
from .quantities import row_settings

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
# What is said of answers, and of times.
OF_ANSWERS = frozenset({Verdict.LESS_RIGHT, Verdict.CHANGED, Verdict.MORE_RIGHT})
OF_TIMES = frozenset({Verdict.SLOWER, Verdict.FASTER, Verdict.UNDECIDED})


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
    settings = json.dumps(row_settings(record.settings), sort_keys=True)
    return record.suite, record.problem, record.solver, settings


def by_row(records: Iterable[Record]) -> dict[RowKey, Record]:
    """Return the records that measured something, by row, the latest where there are several."""
    kept = [r for r in records if r.suite != FINISHED and not r.superseded and holds_anything(r)]
    return {row_key(record): record for record in sorted(kept, key=lambda record: record.when)}


def holds_anything(record: Record) -> bool:
    """Return whether a record has numbers or says why it failed."""
    return bool(record.arrays) or bool(record.failed)


def pairs(old: dict[RowKey, Record], new: dict[RowKey, Record]) -> Iterator[tuple[RowKey, Pair]]:
    """Yield the rows that both runs have numbers of."""
    for key, record in old.items():
        other = new.get(key)
        if other is not None and not record.failed and not other.failed:
            yield key, Pair(record, other)


def come_and_gone(old: dict[RowKey, Record], new: dict[RowKey, Record]) -> Iterator[Row]:
    """Yield the rows that only one run has numbers of."""
    for key in {**old, **new}:
        before, after = old.get(key), new.get(key)
        if after is not None and after.failed and not (before is not None and before.failed):
            why = f"it failed: {after.failed}"
            yield Row(key, "", Verdict.LESS_RIGHT if before else Verdict.NEW, 1.0, why)
        elif before is None or (before.failed and after is not None and not after.failed):
            yield Row(key, "", Verdict.NEW, why="measured in the new run only")
        elif after is None:
            yield Row(key, "", Verdict.GONE, why="measured in the old run only")


def distinguishing(rows: Iterable[Row]) -> dict[RowKey, str]:
    """Return the settings that tell a row from others of its problem and solver, as words."""
    groups: dict[tuple[str, ...], dict[RowKey, dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(row.key[:3], {})[row.key] = row.settings
    return {
        key: ", ".join(f"{n} {json.dumps(v)}" for n, v in settings.items() if _varies(group, n))
        for group in groups.values() for key, settings in group.items()
    }  # fmt: skip


def _varies(group: dict[RowKey, dict[str, Any]], name: str) -> bool:
    return len({json.dumps(settings.get(name)) for settings in group.values()}) > 1


def worst_first(rows: Iterable[Row]) -> list[Row]:
    """Return rows by verdict, and within a verdict the greatest change first."""
    return sorted(rows, key=lambda row: (ORDER.index(row.verdict), -row.change, row.title))
