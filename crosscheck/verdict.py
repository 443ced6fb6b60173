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
    """One case: a quantity computed by the reference and independently, of any shape."""

    ours: FloatArray
    theirs: FloatArray
    baseline: FloatArray  # its value without motion and forces
    scale: float  # the positive number to which differences are relative


@dataclass(frozen=True)
class Claim:
    """Our quantity equals theirs, in every case, to a tolerance."""

    name: str  # unique, for tables and the command line
    ours: str  # description of our quantity
    theirs: str  # of the independent one
    compare: Callable[[int], Iterable[Comparison]]  # yields those of the first n cases
    tolerance: Tolerance  # the largest difference allowed, with its reason
    cases: int  # number of cases in a full check


@dataclass(frozen=True)
class Verdict:
    """The result of checking a claim; numbers are NaN if a value is not finite."""

    claim: Claim
    cases: int  # how many were compared
    difference: float  # the largest relative one of a case
    displacement: float  # the least relative distance of a case from its baseline
    failure: str  # why the claim does not hold; empty if it holds

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
