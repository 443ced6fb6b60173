"""Time single calls; few other files of the bench read a clock (`tests/bench/test_flow.py`)."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
# A reading of the processor's clock takes up to 2 µs: below 1 % of a call as long as this [s].
LONG = 2e-4


def time_call(call: Callable[[], T]) -> tuple[T, float]:
    """Return the result of a call, and its time [s]."""
    begin = time.perf_counter()
    result = call()
    return result, time.perf_counter() - begin


def compute_time_of(call: Callable[[], T]) -> tuple[T, float]:
    """Return the result of a call in this process, and its computing time [s].

    Wall time includes the work of other programs on the same core, so a call longer than `LONG`
    takes its processor time. With several threads the wall time is shorter, and counts.
    """
    processor, begin = time.process_time(), time.perf_counter()
    result = call()
    wall = time.perf_counter() - begin
    return result, wall if wall < LONG else min(wall, time.process_time() - processor)


class Patience:
    """A time limit from now on."""

    def __init__(self, seconds: float) -> None:
        self._end = time.perf_counter() + seconds

    @property
    def is_spent(self) -> bool:
        """Whether the time is over."""
        return time.perf_counter() >= self._end
