"""The records of the cross-check's claims."""

from ...harness.values import Details, Kind, Values


class ClaimValues(Values, frozen=True):
    """The largest relative difference over cases, what it may be, and what moved in each case."""

    cases: int
    difference: float
    tolerance: float
    moved: float
    held: bool


class ClaimDetails(Details, frozen=True):
    """What a claim compares, the reason for its tolerance, and why it was missed."""

    ours: str = ""
    reason: str = ""
    missed: str = ""


KINDS = {"": Kind(ClaimValues, ClaimDetails)}
