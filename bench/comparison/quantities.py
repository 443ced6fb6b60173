"""What the arrays of a record are: times by a clock, answers, or neither; and what is better.

Reruns of the same sources give the same answers to the bit, unless a clock cuts them.
"""

from collections.abc import Mapping

import numpy as np

from ..harness.record import Record

# Arrays that a clock filled [s], by suite; those of other suites are called as the first two.
_USUAL = frozenset({"seconds", "setup"})
_CLOCKED: Mapping[str, frozenset[str]] = {
    "cloth_scale": frozenset({"assembly", "factor", "refactor", "solve", "local", "step", "limit"}),
    "first_call": frozenset({"cold wall", "cold processor", "warm wall", "warm processor"}),
}
# What depends on the system's state: bytes of memory.
_INCIDENTAL = frozenset({("cloth_scale", "before"), ("cloth_scale", "memory")})
# Less of these is more right.
_ERRORS = frozenset({
    "residual", "error", "position", "rotation", "beyond", "excess", "drift", "difference",
    "positions", "rotations", "jacobians", "implicit", "true", "diverged", "above",
})  # fmt: skip
# Elsewhere these are the distance of a target, and so an input.
_DISTANCES = frozenset({("cloth", "distance"), ("newton", "distance")})
# More of these is more right.
_MERITS = frozenset({"solved", "held", "covered", "same"})
# Which targets were solved; who has it has times by target too.
SOLVED = "solved"
# A setting by which a clock ends a solve: its answers differ from run to run.
_TIME_LIMIT = "seconds"


def is_clocked(suite: str, name: str) -> bool:
    """Return whether an array holds times by a clock."""
    return name in _CLOCKED.get(suite, _USUAL)


def is_answer(suite: str, name: str) -> bool:
    """Return whether an array is the same to the bit whenever it is measured."""
    return not is_clocked(suite, name) and (suite, name) not in _INCIDENTAL


def worse_sign(suite: str, name: str) -> int:
    """Return 1 if more of it is worse, -1 if more of it is better, 0 if neither is known."""
    if name in _ERRORS or (suite, name) in _DISTANCES:
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
    if not {"frames", "wanted"} <= arrays.keys() or np.size(arrays.get("remark_particles", ())):
        return np.zeros(0, dtype=bool)
    return np.asarray(arrays["frames"] < arrays["wanted"])


def differing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return where two arrays of one shape hold other numbers; NaN is like NaN."""
    return np.asarray(~((a == b) | ((a != a) & (b != b))))
