"""A block: one problem for one solver, measured in one go."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Measured(NamedTuple):
    """What a block found: arrays of numbers, and words that belong to them."""

    arrays: Mapping[str, Any]
    notes: Mapping[str, str] = {}


@dataclass(frozen=True)
class Scale:
    """How much is measured: random targets a problem, seconds a benchmark."""

    targets: int
    seconds: float


SCALES = {"quick": Scale(targets=200, seconds=0.2), "full": Scale(targets=2000, seconds=2.0)}


@dataclass(frozen=True)
class Block:
    """One problem for one solver with the settings that change the answer, and how to measure it.

    The numbers are made only when `measure` is called. `size` says how many, where that varies.
    """

    suite: str
    problem: str
    solver: str
    measure: Callable[[], Measured]
    settings: Mapping[str, Any] = field(default_factory=dict)
    size: int = 0
