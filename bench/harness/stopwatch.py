"""The clock of single solves; apart from `run.py` and `timing/`, only this file reads one."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """Return what a call returns, and how long it took [s]."""
    begin = time.perf_counter()
    result = call()
    return result, time.perf_counter() - begin


def timed_twice(call: Callable[[], T]) -> tuple[T, float, float]:
    """Return what a call returns, how long it took, and how long the processor worked [s]."""
    begin = time.process_time()
    result, seconds = timed(call)
    return result, seconds, time.process_time() - begin


class Budget:
    """A stretch of time that runs from the moment it is made."""

    def __init__(self, seconds: float) -> None:
        self._end = time.perf_counter() + seconds

    @property
    def is_spent(self) -> bool:
        """Whether it is over."""
        return time.perf_counter() >= self._end
