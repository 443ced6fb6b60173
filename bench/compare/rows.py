"""Rows of a comparison: the records of the same problem, solver and settings in two runs."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from ..measure.record import FINISHED, Record
from ..measure.record import key as record_key

# Suite, problem, solver, and settings as JSON.
RowKey = tuple[str, str, str, str]


class ChangeVerdict(StrEnum):
    """Verdict on a row of a comparison, the worst first."""

    LESS_RIGHT = "LESS RIGHT"
    CHANGED = "CHANGED"
    GONE = "GONE"
    SLOWER = "SLOWER"
    UNDECIDED = "UNDECIDED"
    MORE_RIGHT = "MORE RIGHT"
    FASTER = "FASTER"
    NEW = "NEW"
    SAME = "SAME"


ORDER = list(ChangeVerdict)


class TimeRatio(NamedTuple):
    """Ratio of the new to the old time, its 95 % interval, and its probability under no change."""

    ratio: float
    low: float
    high: float
    chance: float


class Pair(NamedTuple):
    """The records of a row in two runs."""

    old: Record
    new: Record


@dataclass(frozen=True)
class RowChange:
    """Difference of a quantity of a row between two runs."""

    key: RowKey  # suite, problem, solver, and settings as JSON without the version
    quantity: str  # the array that decided; "" for the whole record
    verdict: ChangeVerdict  # of this quantity
    change: float = 0.0  # relative size of the difference, for sorting
    why: str = ""  # a sentence
    ratio: TimeRatio | None = None  # of the new to the old time, where times are compared

    @property
    def title(self) -> str:
        """Problem, solver and quantity."""
        return ", ".join(filter(None, [*self.key[1:3], self.quantity]))


def row_key(record: Record) -> RowKey:
    """Return the key shared by the records of a row, whatever version was measured."""
    settings = {name: setting for name, setting in record.settings.items() if name != "version"}
    return record_key(record.suite, record.problem, record.solver, settings)


def by_row(records: Iterable[Record]) -> dict[RowKey, Record]:
    """Return the latest record of each measured or failed row."""
    return {
        row_key(record): record
        for record in sorted(records, key=lambda record: record.when)
        if record.suite != FINISHED
        and not record.superseded
        and (record.has_numbers or record.failed)
    }


def match_rows(
    old: Mapping[RowKey, Record], new: Mapping[RowKey, Record]
) -> tuple[dict[RowKey, Pair], list[RowChange]]:
    """Return the rows measured in both runs, and a change for each other row."""
    pairs, changes = {}, []
    for key in {**old, **new}:
        before, after = old.get(key), new.get(key)
        if before and after and not before.failed and not after.failed:
            pairs[key] = Pair(before, after)
        elif after is None:
            changes.append(RowChange(key, "", ChangeVerdict.GONE, why="only in the old run"))
        elif not after.failed:
            changes.append(RowChange(key, "", ChangeVerdict.NEW, why="only in the new run"))
        elif before is None or not before.failed:
            verdict = ChangeVerdict.LESS_RIGHT if before else ChangeVerdict.NEW
            changes.append(RowChange(key, "", verdict, 1.0, f"failed: {after.failed}"))
    return pairs, changes


def distinguishing(keys: Iterable[RowKey]) -> dict[RowKey, str]:
    """Return the settings in which a row differs from others of its problem and solver."""
    groups: dict[tuple[str, ...], dict[RowKey, dict[str, str]]] = {}
    for key in keys:
        settings = json.loads(key[3])
        texts = {name: json.dumps(settings[name], ensure_ascii=False) for name in settings}
        groups.setdefault(key[:3], {})[key] = texts
    words = {}
    for group in groups.values():
        for key, settings in group.items():
            names = [n for n in settings if len({row.get(n) for row in group.values()}) > 1]
            words[key] = ", ".join(f"{name} {settings[name]}" for name in names)
    return words


def worst_first(rows: Iterable[RowChange]) -> list[RowChange]:
    """Return rows by verdict, and within a verdict the largest change first."""
    return sorted(rows, key=lambda row: (ORDER.index(row.verdict), -row.change, row.title))


def contains_any(key: Sequence[str], words: Sequence[str]) -> bool:
    """Return whether the problem or solver contains any of the words; True without words."""
    return not words or any(word in part for word in words for part in key[1:3])
