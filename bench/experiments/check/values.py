"""The records of the cross-check's claims."""

import msgspec

from ...harness.values import Details, Kind, Values


class ClaimValues(Values, frozen=True):
    """The largest relative difference over the cases, its tolerance, and the displacement."""

    cases: int
    difference: float
    tolerance: float
    moved: float
    holds: bool = msgspec.field(name="held")


class ClaimDetails(Details, frozen=True):
    """The quantity computed by us, the reason for the tolerance, and why the claim failed.

    An obstacle says why the claim could not be checked.
    """

    quantity: str = msgspec.field(default="", name="ours")
    reason: str = ""
    failure: str = msgspec.field(default="", name="missed")
    obstacle: str = ""


KINDS = {"": Kind(ClaimValues, ClaimDetails)}
