"""The records of the cross-check's claims."""

from ...harness.values import Details, Kind, Values


class ClaimValues(Values, frozen=True):
    """What became of a claim.

    Attributes:
        cases: in how many random systems it was looked at.
        difference: the largest of them, relative.
        tolerance: how large it may be.
        moved: by how much the quantity changed, at least.
        held: whether the claim holds.
    """

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
