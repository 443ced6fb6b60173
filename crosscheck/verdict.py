"""A claim that two independent computations agree, and the function that checks it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from plumbob.reference import arguments
from plumbob.reference.arguments import FloatArray

from .tolerances import Tolerance

# Least distance of our quantity from its baseline, relative to the scale. It exceeds all tolerances
# by far, so that a comparison of two results at rest proves nothing.
LEAST_DISPLACEMENT = 1e-4


class Comparison(NamedTuple):
    """One case: a quantity computed by the reference and independently.

    Attributes:
        ours: the quantity by the reference, of any shape.
        theirs: the same quantity, computed independently.
        baseline: its value without motion and forces.
        scale: the positive number to which differences are relative.
    """

    ours: FloatArray
    theirs: FloatArray
    baseline: FloatArray
    scale: float


@dataclass(frozen=True)
class Claim:
    """Our quantity equals theirs, in every case, to a tolerance.

    Attributes:
        name: unique, for tables and the command line.
        ours: description of our quantity.
        theirs: description of the independent one.
        compare: yields the comparisons of the first n cases.
        tolerance: the largest difference allowed, with its reason.
        cases: number of cases in a full check.
    """

    name: str
    ours: str
    theirs: str
    compare: Callable[[int], Iterable[Comparison]]
    tolerance: Tolerance
    cases: int


@dataclass(frozen=True)
class Verdict:
    """The result of checking a claim.

    Attributes:
        claim: the claim.
        cases: the number of cases compared.
        difference: the largest relative difference of a case; NaN if a value is not finite.
        displacement: the least relative distance of a case from its baseline; NaN likewise.
        failure: the reason why the claim does not hold; empty if it holds.
    """

    claim: Claim
    cases: int
    difference: float
    displacement: float
    failure: str

    @property
    def holds(self) -> bool:
        """Whether the claim holds."""
        return not self.failure


def each_case(compare: Callable[[int], Comparison]) -> Callable[[int], Iterable[Comparison]]:
    """Return the comparisons of the first n cases from the comparison of case i."""
    return lambda cases: map(compare, range(cases))


def check_claim(claim: Claim, cases: int | None = None) -> Verdict:
    """Compare all cases of a claim, or the first few, and return the verdict.

    Raises:
        ValueError: if it is no claim, or the number not an integer of at least 0.
    """
    arguments.instance("claim", claim, Claim)
    count = claim.cases if cases is None else arguments.integer("cases", cases, least=0)
    compared = list(claim.compare(count))
    differences = [_relative_difference(c.ours, c.theirs, c.scale) for c in compared]
    displacements = [_relative_difference(c.ours, c.baseline, c.scale) for c in compared]
    difference = float(np.max(differences, initial=0.0))
    displacement = float(np.min(displacements or [0.0]))
    failure = _failure(len(compared), difference, displacement, claim.tolerance.value)
    return Verdict(claim, len(compared), difference, displacement, failure)


def _relative_difference(a: FloatArray, b: FloatArray, scale: float) -> float:
    """Return the largest difference over the scale, or NaN if a value is not finite.

    Raises:
        ValueError: if the shapes differ, which would broadcast, or are empty.
    """
    if a.shape != b.shape or a.size == 0:
        raise ValueError(f"comparison: expected two equal shapes, got {a.shape} and {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all() and 0.0 < scale < np.inf):
        return np.nan
    return float(np.max(np.abs(a - b))) / scale


def _failure(cases: int, difference: float, displacement: float, tolerance: float) -> str:
    if cases == 0:
        return "no cases"
    if not np.isfinite([difference, displacement]).all():
        return "not a number"
    if difference > tolerance:
        return "they differ"
    if displacement < LEAST_DISPLACEMENT:
        return "nothing moved"
    return ""
