"""What the arrays of a record are: times by a clock, answers, or neither; and what is better.

Reruns of the same sources give the same answers to the bit, unless a clock cuts them.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..harness.record import Record

# Arrays that a clock filled [s], by suite; those of other suites are called as the first two.
_USUAL = frozenset({"seconds", "setup"})
_CLOCKED: Mapping[str, frozenset[str]] = {
    "cloth_scale": frozenset({"assembly", "factor", "refactor", "solve", "local", "step", "limit"}),
}
# What depends on the system's state: bytes of memory.
_INCIDENTAL: Mapping[str, frozenset[str]] = {"cloth_scale": frozenset({"before", "memory"})}
# Less of these is more right.
_ERRORS = frozenset({
    "residual", "error", "position", "rotation", "beyond", "excess", "drift", "difference",
    "positions", "rotations", "jacobians", "implicit", "true", "diverged", "above",
})  # fmt: skip
# In other suites these are the distance of a target, and so an input.
_DISTANCES = frozenset({"cloth", "newton"})
# More of these is more right.
_MERITS = frozenset({"solved", "held", "covered", "same"})
# Which targets were solved; who has it has times by target too.
SOLVED = "solved"
# A setting by which a clock ends a solve: its answers differ from run to run.
_TIME_LIMIT = "seconds"
_NONE = np.zeros(0)
# What may change between runs of one row: the version of what is measured.
_MOVING = frozenset({"version"})


def is_clocked(suite: str, name: str) -> bool:
    """Return whether an array holds times by a clock."""
    return name in _CLOCKED.get(suite, _USUAL)


def is_answer(suite: str, name: str) -> bool:
    """Return whether an array is the same to the bit whenever it is measured."""
    return not is_clocked(suite, name) and name not in _INCIDENTAL.get(suite, frozenset())


def worse_sign(suite: str, name: str) -> int:
    """Return 1 if more of it is worse, -1 if more of it is better, 0 if neither is known."""
    if name in _ERRORS or (name == "distance" and suite in _DISTANCES):
        return 1
    return -1 if name in _MERITS else 0


def is_cut_by_clock(record: Record) -> bool:
    """Return whether a time limit ends each of its solves."""
    return _TIME_LIMIT in record.settings


def ended_by_clock(record: Record) -> np.ndarray:
    """Return which motions of a record a budget of time ended early; empty if it holds none.

    A solver that fails leaves a remark, and where there is one none is excused.
    """
    arrays = record.arrays
    if not {"frames", "wanted"} <= arrays.keys() or arrays.get("remark_particles", _NONE).size:
        return np.zeros(0, dtype=bool)
    return np.asarray(arrays["frames"] < arrays["wanted"])


def row_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that make two records of two runs the same row."""
    return {name: value for name, value in settings.items() if name not in _MOVING}


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two arrays hold the same numbers, NaN like NaN."""
    return a.shape == b.shape and bool(np.all((a == b) | ((a != a) & (b != b))))
