"""The records of the judge's self-test."""

import msgspec

from ...harness.values import Details, Kind, Values


class TrialValues(Values, frozen=True):
    """Whether a solver was judged rightly.

    Attributes:
        caught: whether a law is broken.
        named: whether the fault is named; of an honest solver, whether nothing is.
        passed: whether the judge did all that it should.
    """

    caught: bool
    named: bool
    passed: bool


class TrialDetails(Details, frozen=True):
    """The solver's family, whether it is faulty, and the laws that it breaks."""

    family: str
    faulty: bool
    laws: list[str] = msgspec.field(default_factory=list)


KINDS = {"": Kind(TrialValues, TrialDetails)}
