"""The outcome of an iterative solve: a value, never an exception."""

from enum import IntEnum
from typing import Self


class SentenceEnum(IntEnum):
    """Sentences numbered in their order; records hold the numbers, so new sentences come last."""

    _value_: int
    sentence: str

    def __new__(cls, sentence: str) -> Self:
        """Return the member of the next number."""
        member = int.__new__(cls, len(cls.__members__))
        member._value_, member.sentence = len(cls.__members__), sentence
        return member


class Outcome(SentenceEnum):
    """How a solve ended; `sentence` is the outcome in words."""

    CONVERGED = "The residual is within the tolerance."
    UNREACHABLE = (
        "No pose reaches the target: geometry forbids it; the iterations settled at this one."
    )
    STALLED = "The iterations stopped making progress before the tolerance was met."
    ITERATION_LIMIT = "All iterations were used before the tolerance was met."
    DIVERGED = (
        "The iterations left the finite numbers; what is returned is the last finite iterate."
    )
    AT_ROUNDING = (
        "The residual is above the tolerance, but no larger than rounding may leave it, and the "
        "iterations no longer make it smaller."
    )
    UNREACHABLE_UNSETTLED = (
        "No pose reaches the target: geometry forbids it; all iterations were used before they "
        "settled, and some pose may be nearer."
    )
    SADDLE = (
        "The iterations ended at a saddle point: the residual is small enough, but the objective "
        "falls in some direction."
    )

    @property
    def unreachable(self) -> bool:
        """Whether geometry proves that no pose reaches the target."""
        return self in (Outcome.UNREACHABLE, Outcome.UNREACHABLE_UNSETTLED)

    @property
    def solved(self) -> bool:
        """Whether the residual is within the tolerance, or within rounding."""
        return self in (Outcome.CONVERGED, Outcome.AT_ROUNDING)
