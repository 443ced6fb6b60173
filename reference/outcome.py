"""The outcome of an iterative solve: a value, never an exception."""

from enum import IntEnum


class Outcome(IntEnum):
    """How a solve ended; `sentence` says it in words."""

    CONVERGED = 0
    UNREACHABLE = 1
    STALLED = 2
    ITERATION_LIMIT = 3
    DIVERGED = 4
    AT_ROUNDING = 5
    UNREACHABLE_UNSETTLED = 6
    SADDLE = 7

    @property
    def unreachable(self) -> bool:
        """Whether geometry proves that no pose reaches the target."""
        return self in (Outcome.UNREACHABLE, Outcome.UNREACHABLE_UNSETTLED)

    @property
    def sentence(self) -> str:
        """The outcome as a sentence."""
        return _SENTENCES[self]

    @property
    def solved(self) -> bool:
        """Whether the residual is within the tolerance, or within rounding."""
        return self in (Outcome.CONVERGED, Outcome.AT_ROUNDING)


_SENTENCES = {
    Outcome.CONVERGED: "The residual is within the tolerance.",
    Outcome.UNREACHABLE: "No pose reaches the target: geometry forbids it; the iterations settled "
    "at this one.",
    Outcome.STALLED: "The iterations stopped making progress before the tolerance was met.",
    Outcome.ITERATION_LIMIT: "All iterations were used before the tolerance was met.",
    Outcome.DIVERGED: "The iterations left the finite numbers; what is returned is the last finite "
    "iterate.",
    Outcome.AT_ROUNDING: "The residual is above the tolerance, but no larger than rounding may "
    "leave it, and the iterations no longer make it smaller.",
    Outcome.UNREACHABLE_UNSETTLED: "No pose reaches the target: geometry forbids it; all "
    "iterations were used before they settled, and some pose may be nearer.",
    Outcome.SADDLE: "The iterations ended at a saddle point: the residual is small enough, but the "
    "objective falls in some direction.",
}
