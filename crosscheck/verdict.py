"""A claim that two independent computations agree, and the one judge of all claims."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from reference import arguments
from reference.arguments import FloatArray

from .tolerances import Tolerance

# A case counts only if our quantity differs from what it would be had nothing moved by this, of
# the scale: far more than any tolerance, so that two answers that both stood still are no proof.
LEAST_MOVEMENT = 1e-4


class Comparison(NamedTuple):
    """One case: a quantity by us and by the others.

    Attributes:
        ours: our quantity, of any shape.
        theirs: the same, computed independently.
        still: what it would be if nothing moved, turned or pulled.
        scale: what a difference is measured against, greater than zero.
    """

    ours: FloatArray
    theirs: FloatArray
    still: FloatArray
    scale: float


@dataclass(frozen=True)
class Claim:
    """Our quantity equals theirs, in every case, to a tolerance.

    Attributes:
        name: unique, for tables and for asking for it.
        ours: what we compute.
        theirs: with what it is held against.
        compare: makes the comparisons of the first so many cases.
        tolerance: the largest difference allowed, with its reason.
        cases: how many cases a full check takes.
    """

    name: str
    ours: str
    theirs: str
    compare: Callable[[int], Iterable[Comparison]]
    tolerance: Tolerance
    cases: int


@dataclass(frozen=True)
class Verdict:
    """What came of a claim.

    Attributes:
        claim: the claim.
        cases: the number of cases compared.
        difference: the largest difference over its scale; NaN if a case is not all numbers.
        moved: the least movement of a case over its scale; NaN likewise.
        missed: why the claim does not hold, in words; empty if it holds.
    """

    claim: Claim
    cases: int
    difference: float
    moved: float
    missed: str

    @property
    def held(self) -> bool:
        """Whether the claim holds."""
        return not self.missed


def judge(claim: Claim, cases: int | None = None) -> Verdict:
    """Compare all cases of a claim, or the number given, and return the verdict.

    Raises:
        ValueError: if it is no claim, or the number not an integer of at least 0.
    """
    arguments.instance("claim", claim, Claim)
    count = claim.cases if cases is None else arguments.integer("cases", cases, least=0)
    compared = list(claim.compare(count))
    difference = np.max([_apart(c.ours, c.theirs, c.scale) for c in compared], initial=0.0)
    moved = np.min([_apart(c.ours, c.still, c.scale) for c in compared] or [0.0])
    missed = _missed(len(compared), difference, moved, claim.tolerance.value)
    return Verdict(claim, len(compared), float(difference), float(moved), missed)


def _apart(a: FloatArray, b: FloatArray, scale: float) -> float:
    """Return the largest difference over the scale, NaN if there is anything but numbers.

    Raises:
        ValueError: if the shapes differ, which would broadcast, or there is nothing to compare.
    """
    if a.shape != b.shape or a.size == 0:
        raise ValueError(f"comparison: expected two equal shapes, got {a.shape} and {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all() and 0.0 < scale < np.inf):
        return np.nan
    return float(np.max(np.abs(a - b))) / scale


def _missed(cases: int, difference: float, moved: float, tolerance: float) -> str:
    if cases == 0:
        return "no cases"
    if not np.isfinite([difference, moved]).all():
        return "not a number"
    if difference > tolerance:
        return "they differ"
    if moved < LEAST_MOVEMENT:
        return "nothing moved"
    return ""
