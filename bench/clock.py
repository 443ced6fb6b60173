"""The clock: how long a call takes, and which part of the call is its solver's library.

No other file of the bench reads a clock. The file stands below the adapters, which time requests
and the functions of their libraries.
"""

import math
import time
from collections.abc import Callable
from statistics import median
from timeit import Timer
from typing import Any, TypeVar

T = TypeVar("T")
Function = TypeVar("Function", bound=Callable[..., Any])
# A reading of the processor's clock takes up to 2 µs: below 1 % of a call as long as this [s].
LONG = 2e-4
# Solves whose median is the overhead: two disturbed solves do not change the median.
REPEATS = 5
# The time of a library's functions while an overhead is measured [s], else nothing.
_library_seconds: list[float] = []


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
    processor, (result, wall) = time.process_time(), time_call(call)
    if wall < LONG or is_metered():  # the functions of a library are too short for the other clock
        return result, wall
    return result, min(wall, time.process_time() - processor)


def processor_timer(call: Callable[[], object]) -> Timer:
    """Return a timer of a call by the clock of the processor, for calls in a loop."""
    return Timer(call, timer=time.process_time)


def pace() -> float:
    """Return how long a fixed loop takes [s], the median of nine."""
    return median(time_call(lambda: sum(range(10_000)))[1] for _ in range(9))


def time_limit(seconds: float) -> Callable[[], bool]:
    """Return a function to ask whether so long has passed from now on [s]."""
    end = time.perf_counter() + seconds
    return lambda: time.perf_counter() >= end


def library(function: Function) -> Function:
    """Return a library's function, with a sum of its time while an overhead is measured."""
    if not is_metered():
        return function

    def metered(*arguments: Any, **options: Any) -> Any:
        begin = time.perf_counter()
        result = function(*arguments, **options)
        report_library(time.perf_counter() - begin)
        return result

    call: Any = metered
    return call


def is_metered() -> bool:
    """Return whether an overhead is being measured."""
    return bool(_library_seconds)


def report_library(seconds: float) -> None:
    """Add the time of a library [s], such as of one in another process."""
    if is_metered():
        _library_seconds[0] += seconds


def overhead(prepare: Callable[[], Callable[[], Any]]) -> float:
    """Return the median time of a solve outside the functions of its library [s].

    `prepare` sets the solve up. The result is an upper bound, for reading the clock takes time,
    too; NaN if an exception is raised.
    """
    _library_seconds.append(0.0)
    try:
        solve, seconds = prepare(), []
        for _ in range(REPEATS):
            _library_seconds[0] = 0.0
            seconds.append(solve().time.seconds - _library_seconds[0])
        return median(seconds)
    except Exception:  # which is a failed attempt where its answers count
        return math.nan
    finally:
        _library_seconds.clear()
