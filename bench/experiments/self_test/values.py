"""The records of the judge's self-test."""

import msgspec

from ...harness.values import Details, Kind, Values


class TrialValues(Values, frozen=True):
    """Whether a law is broken, the fault named (or none, of an honest solver), all is right."""

    caught: bool
    named: bool
    passed: bool


class TrialDetails(Details, frozen=True):
    """The solver's family, whether it is faulty, and the laws that it breaks."""

    family: str
    faulty: bool
    laws: list[str] = msgspec.field(default_factory=list)


KINDS = {"": Kind(TrialValues, TrialDetails)}
