"""A claim that two independent computations agree, and the function to check the claim."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from plumbob.reference import arguments
from plumbob.reference.arguments import FloatArray

from .tolerances import ClaimTolerance

# Least distance of our quantity from its baseline, relative to the scale. The least distance
# exceeds all tolerances by far: comparing two results at rest proves nothing.
LEAST_DISPLACEMENT = 1e-4


class Comparison(NamedTuple):
    """A case: a quantity computed by the reference and independently, of any shape."""

    actual: FloatArray  # by the reference
    expected: FloatArray  # by the independent computation
    baseline: FloatArray  # its value without motion and forces
    scale: float  # the positive number to which differences are relative


@dataclass(frozen=True)
class Claim:
    """A quantity of the reference equals its counterpart, in every case, to a tolerance."""

    name: str  # unique, for tables and the command line
    quantity: str  # what the reference computes
    counterpart: str  # what it is compared with
    compare: Callable[[int], Iterable[Comparison]]  # yields those of the first n cases
    tolerance: ClaimTolerance  # the largest difference allowed, with its reason
    cases: int  # number of cases in a full check
    obstacle: str = ""  # why the claim cannot be checked here; empty if it can


@dataclass(frozen=True)
class ClaimVerdict:
    """The result of checking a claim; numbers are NaN if a value is not finite or not known."""

    claim: Claim
    cases: int  # how many were compared
    difference: float  # the largest relative one of a case
    displacement: float  # the least relative distance of a case from its baseline
    failure: str  # why the claim does not hold; empty if it holds or was not checked

    @property
    def holds(self) -> bool:
        """Whether the claim was checked and holds."""
        return not (self.failure or self.claim.obstacle)

    @property
    def words(self) -> str:
        """The verdict as in tables."""
        if self.claim.obstacle:
            return f"not checked: {self.claim.obstacle}"
        return "MISSED" if self.failure else "held"


def each_case(compare: Callable[[int], Comparison]) -> Callable[[int], Iterable[Comparison]]:
    """Return the comparisons of the first n cases from the comparison of case i."""
    return lambda cases: map(compare, range(cases))


def check_claim(claim: Claim, cases: int | None = None) -> ClaimVerdict:
    """Compare all cases of a claim, or the first few, and return the verdict.

    Raise a ValueError for no claim, or a number other than an integer of at least 0.
    """
    arguments.instance("claim", claim, Claim)
    count = claim.cases if cases is None else arguments.integer("cases", cases, minimum=0)
    if claim.obstacle:
        return ClaimVerdict(claim, 0, np.nan, np.nan, "")
    comparisons = list(claim.compare(count))
    differences = [_relative_difference(c.actual, c.expected, c.scale) for c in comparisons]
    displacements = [_relative_difference(c.actual, c.baseline, c.scale) for c in comparisons]
    difference = float(np.max(differences, initial=0.0))
    displacement = float(np.min(displacements or [0.0]))
    failure = ""
    if not comparisons:
        failure = "no cases"
    elif not np.isfinite([difference, displacement]).all():
        failure = "not a number"
    elif difference > claim.tolerance.value:
        failure = "they differ"
    elif displacement < LEAST_DISPLACEMENT:
        failure = "nothing moved"
    return ClaimVerdict(claim, len(comparisons), difference, displacement, failure)


def _relative_difference(a: FloatArray, b: FloatArray, scale: float) -> float:
    """Return the largest difference over the scale, or NaN if a value is not finite.

    Raise a ValueError if the shapes differ, which would broadcast, or are empty.
    """
    if a.shape != b.shape or a.size == 0:
        raise ValueError(f"comparison: expected two equal shapes, got {a.shape} and {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all() and 0.0 < scale < np.inf):
        return np.nan
    return float(np.max(np.abs(a - b))) / scale
