"""The records of the self-test of `plumbob verify`."""

import msgspec

from ...harness.values import Details, Kind, Values


class TrialValues(Values, frozen=True):
    """Whether a law is violated, the fault (or none) named, and the verdict right."""

    caught: bool
    is_named: bool = msgspec.field(name="named")
    passed: bool


class TrialDetails(Details, frozen=True):
    """The solver's family, whether it is faulty, and the laws that it violates."""

    family: str
    faulty: bool
    laws: list[str] = msgspec.field(default_factory=list)


KINDS = {"": Kind(TrialValues, TrialDetails)}
