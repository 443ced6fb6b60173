"""The times that are compared: a solver's own, and the reference's for the same cases."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from .contestant import Answer, Failure

Returned = TypeVar("Returned")
# Calls of the reference: the first may compile; the others are as many as each case is asked.
CALLS = 3
# A solver has slept until its request came, which slows a call of microseconds down. So has the
# reference: it sleeps so long before each call [s].
PAUSE = 1e-4


def timed(function: Callable[[], Returned]) -> tuple[Returned, float]:
    """Return what the reference answers and the least time it took after a pause [s]."""
    least = float("inf")
    for _ in range(CALLS):
        time.sleep(PAUSE)
        start = time.perf_counter()
        answer = function()
        least = min(least, time.perf_counter() - start)
    return answer, least


def with_lesser_time(first: Answer | Failure, again: Answer | Failure) -> Answer | Failure:
    """Return the first answer with the lesser time of both, 0 only if the clock sees neither."""
    if isinstance(first, Failure) or isinstance(again, Failure) or first.untimed:
        return first
    if again.untimed:
        return replace(first, seconds=again.seconds, untimed=again.untimed)
    lesser, greater = sorted((first.seconds, again.seconds))
    return replace(first, seconds=lesser or greater)
