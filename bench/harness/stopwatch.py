"""Time single calls; no other file of the bench but `run.py` and `timing/` reads a clock."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


# What solvers behind a door counted themselves since the last call that is timed was begun [s].
_own: list[float] = []


def count(seconds: float) -> None:
    """Note what a solver took by its own count: a door costs time that is not the solver's."""
    _own.append(seconds)


def timed(call: Callable[[], T]) -> tuple[T, float]:
    """Return what a call returns, and how long it took [s], by the solver's count if it counts."""
    _own.clear()
    begin = time.perf_counter()
    result = call()
    seconds = time.perf_counter() - begin
    return result, sum(_own) if _own else seconds


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
