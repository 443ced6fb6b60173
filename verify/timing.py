"""The compared times: a solver's own, and the reference's for the same cases."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from .exchange import Answer, Failure

Returned = TypeVar("Returned")
# Calls of the reference: the first may compile; the others are as many as each case is asked.
CALLS = 3
# A solver sleeps until its request comes, which slows a call of microseconds down; so the reference
# also sleeps before each call [s].
PAUSE = 1e-4


def time_call(function: Callable[[], Returned]) -> tuple[Returned, float]:
    """Return the result of a function and its shortest time after a pause [s]."""
    shortest = float("inf")
    for _ in range(CALLS):
        time.sleep(PAUSE)
        start = time.perf_counter()
        answer = function()
        shortest = min(shortest, time.perf_counter() - start)
    return answer, shortest


def with_lesser_time(first: Answer | Failure, second: Answer | Failure) -> Answer | Failure:
    """Return the first answer with the lesser time of both, 0 only if the clock sees neither."""
    if isinstance(first, Failure) or isinstance(second, Failure) or first.untimed:
        return first
    if second.untimed:
        return replace(first, seconds=second.seconds, untimed=second.untimed)
    lesser, greater = sorted((first.seconds, second.seconds))
    return replace(first, seconds=lesser or greater)
