"""Time single calls; no other file of the bench but `run.py` and `timing/` reads a clock."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
# A budget ends after so many times its seconds, whatever a solver counts.
MAXIMUM_EXTENSION = 10.0


def time_call(call: Callable[[], T]) -> tuple[T, float]:
    """Return the result of a call, and how long it took [s]."""
    begin = time.perf_counter()
    result = call()
    return result, time.perf_counter() - begin


def processor_time_of(call: Callable[[], T]) -> tuple[T, float]:
    """Return the result of a call, and how long processors worked in it [s], all threads."""
    begin = time.process_time()
    result = call()
    return result, time.process_time() - begin


class Budget:
    """A time limit that starts now and does not count the overhead of requests."""

    def __init__(self, seconds: float) -> None:
        self._seconds, self._begin, self._excused = seconds, time.perf_counter(), 0.0

    def excuse(self, seconds: float) -> None:
        """Do not count these seconds, which a request cost beside the solver."""
        self._excused += seconds

    @property
    def is_spent(self) -> bool:
        """Whether the time is over."""
        passed = time.perf_counter() - self._begin
        limit = min(self._seconds + self._excused, MAXIMUM_EXTENSION * self._seconds)
        return passed >= limit
