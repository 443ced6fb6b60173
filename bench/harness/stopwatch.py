"""Time single calls; no other file of the bench but `run.py` and `timing/` reads a clock."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


# A budget ends after so many times its seconds, whatever a solver counts.
MOST_AT_DOORS = 10.0


def time_call(call: Callable[[], T]) -> tuple[T, float]:
    """Return what a call returns, and how long it took [s]."""
    begin = time.perf_counter()
    result = call()
    return result, time.perf_counter() - begin


class Budget:
    """A stretch of time from the moment it is made, without what doors cost."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._begin, self._at_doors = seconds, time.perf_counter(), 0.0

    def excuse(self, at_door: float) -> None:
        """Charge no more for time [s] that was a door's rather than a solver's."""
        self._at_doors += at_door

    @property
    def is_spent(self) -> bool:
        """Whether it is over."""
        passed = time.perf_counter() - self._begin
        is_over = passed - self._at_doors >= self._seconds
        return is_over or passed >= MOST_AT_DOORS * self._seconds
