"""What adapters of all kinds share: the time that a solver counts itself, and why it fails."""

from collections.abc import Iterable
from typing import Any, NamedTuple


class OwnTime(NamedTuple):
    """The time that a solver, or its adapter, has counted itself.

    Attributes:
        seconds: by that count [s].
        round_trip: of its requests, 0 without any [s].
        doubt: why the count cannot be right, else "".
    """

    seconds: float
    round_trip: float = 0.0
    doubt: str = ""

    @property
    def overhead(self) -> float:
        """What requests have cost beside the solver [s], which is charged to no budget."""
        return max(0.0, self.round_trip - self.seconds)


def total(times: Iterable[OwnTime | None]) -> OwnTime | None:
    """Return the time of several calls, None if none of them counted its own."""
    counts = [time for time in times if time is not None]
    if not counts:
        return None
    seconds, round_trips, doubts = zip(*counts, strict=True)
    return OwnTime(sum(seconds), sum(round_trips), max(doubts))


class NoAnswerError(Exception):
    """A solver gave no answer; the message is a sentence that says why."""


def describe(error: Exception) -> str:
    """Return what an exception says, on one line; its type too unless it is a `NoAnswerError`."""
    kind = "" if isinstance(error, NoAnswerError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error}".split())[:300]


def remark_of(adapter: Any) -> str:
    """Return what an adapter has to say of its numbers, by a function `remark`, else ""."""
    return str(adapter.remark()) if hasattr(adapter, "remark") else ""
