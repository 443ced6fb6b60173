"""The parts common to all adapters: the time measured by a solver itself, and its failures."""

from collections.abc import Iterable
from typing import Any, NamedTuple


class OwnTime(NamedTuple):
    """The time measured by a solver or its adapter itself."""

    seconds: float  # by its own clock [s]
    round_trip: float = 0.0  # of its requests, 0 without any [s]
    doubt: str = ""  # why its clock cannot be right, else ""


def total(times: Iterable[OwnTime | None]) -> OwnTime | None:
    """Return the time of several calls, None if no call measured its own."""
    measured = [time for time in times if time is not None]
    if not measured:
        return None
    seconds, round_trips, doubts = zip(*measured, strict=True)
    return OwnTime(sum(seconds), sum(round_trips), max(doubts))


class NoAnswerError(Exception):
    """A solver gave no answer; the message is a sentence with the reason."""


def describe(error: Exception) -> str:
    """Return an exception on a single line; with its type unless a `NoAnswerError`."""
    kind = "" if isinstance(error, NoAnswerError) else f"{type(error).__name__}: "
    return " ".join(f"{kind}{error}".split())[:300]


def remark_of(adapter: Any) -> str:
    """Return an adapter's remark on its numbers, by its function `remark`, else ""."""
    return str(adapter.remark()) if hasattr(adapter, "remark") else ""
