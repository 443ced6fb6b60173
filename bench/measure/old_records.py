"""Records of format 3, of which numbers, words and truth values stood in three places."""

from collections.abc import Mapping
from typing import Any

import msgspec

# Other names of measured values in old records, by suite.
RENAMED: Mapping[str, Mapping[str, str]] = {
    "check": {"ours": "quantity", "missed": "failure", "held": "holds"},
    "robot_models": {"free mimics": "free_mimics"},
    "ik": {"claimed": "claims", "tips": "effectors", "wanted": "target", "false": "wrong"},
    "arm": {"claimed": "claims"},
    "cloth": {"apart": "difference"},
    "newton": {"apart": "newton_distance"},
}


class OldLine(msgspec.Struct, tag_field="format", tag=3):
    """The fields of an old line."""

    suite: str
    problem: str
    solver: str
    settings: dict[str, Any]
    size: float
    arrays: dict[str, Any]
    notes: dict[str, str]
    stamp: dict[str, Any]
    when: str
    seconds: float
    facts: dict[str, Any]
    conditions: dict[str, Any]


def measured_of(line: OldLine) -> dict[str, Any]:
    """Return what an old record measured, by the names of today."""
    names = RENAMED.get(line.suite, {})
    measured = {**line.facts, **line.notes, **line.arrays}
    return {names.get(name, name): _number(value) for name, value in measured.items()}


def _number(value: Any) -> Any:
    """Return a single number that JSON has not, written as a word, in today's form."""
    return {"number": value} if value in ("nan", "inf", "-inf") else value
