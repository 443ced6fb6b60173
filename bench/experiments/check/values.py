"""The records of the cross-check's claims."""

from ...harness.values import Values


class ClaimWords(Values, frozen=True, kw_only=True):
    """The quantity computed by us, the reason for the tolerance, and why the claim failed.

    An obstacle says why the claim could not be checked.
    """

    quantity: str = ""
    reason: str = ""
    failure: str = ""
    obstacle: str = ""


class ClaimValues(ClaimWords, frozen=True):
    """The largest relative difference over the cases, its tolerance, and the displacement."""

    cases: int
    difference: float
    tolerance: float
    moved: float
    holds: bool


KINDS = {"": ClaimValues}
