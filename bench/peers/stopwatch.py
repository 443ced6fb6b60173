"""Time single calls; no other file of the bench but `run.py` and `timing/` reads a clock."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


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


class Patience:
    """A time limit that starts now."""

    def __init__(self, seconds: float) -> None:
        self._end = time.perf_counter() + seconds

    @property
    def is_spent(self) -> bool:
        """Whether the time is over."""
        return time.perf_counter() >= self._end
