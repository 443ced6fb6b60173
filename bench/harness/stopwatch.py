"""Time single calls; no other file of the bench but `run.py` and `timing/` reads a clock."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


# Of the requests since the last call that is timed was begun: what solvers behind a door counted
# themselves, the round trips [s], and why such a count cannot be, else "".
_own: list[tuple[float, float, str]] = []
# What doors have cost in all, beyond what solvers counted [s].
_doors = [0.0]
# A budget ends after so many times its seconds, whatever a solver counts.
MOST_AT_DOORS = 10.0


def behind_door(
    call: Callable[[], T], own: Callable[[T], float], doubt: Callable[[T], str] = lambda _: ""
) -> T:
    """Return what a call returns that takes so long by the solver's own count, 0 for none [s].

    What a door costs beside it is not the solver's time, and is charged to no budget.
    """
    begin = time.perf_counter()
    result = call()
    round_trip = time.perf_counter() - begin
    counted = own(result) or round_trip
    _own.append((counted, round_trip, doubt(result)))
    _doors[0] += max(0.0, round_trip - counted)
    return result


def round_trips() -> tuple[float, str]:
    """Return the round trips of the last timed call [s], and why its own count cannot be, or ""."""
    return sum(seconds for _, seconds, _ in _own), max((why for *_, why in _own), default="")


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """Return what a call returns, and how long it took [s], by the solver's count if it counts."""
    _own.clear()
    begin = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - begin
    return result, sum(counted for counted, *_ in _own) if _own else seconds


class Budget:
    """A stretch of time from the moment it is made, without what doors cost."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._begin, self._doors = seconds, time.perf_counter(), _doors[0]

    @property
    def is_spent(self) -> bool:
        """Whether it is over."""
        passed = time.perf_counter() - self._begin
        at_doors = _doors[0] - self._doors
        return passed - at_doors >= self._seconds or passed >= MOST_AT_DOORS * self._seconds
