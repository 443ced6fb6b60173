"""The time inside the clock that a solver's library does not use: what the harness adds.

Most adapters time a single call of their library, so that the harness adds the reading of the clock
and one call. An adapter that calls its library in a loop passes the functions through `library` and
says `METERED = True`.
"""

import math
from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any, TypeVar

from .protocol import Ask, PoseRequest, Solve, SolverOutput

REPEATS = 5
Function = TypeVar("Function", bound=Callable[..., Any])


class Meter:
    """The time that functions of a library take.

    Attributes:
        seconds: their sum [s].
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    def metered(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function whose time is added up."""

        def call(*arguments: Any, **options: Any) -> Any:
            begin = perf_counter()
            result = function(*arguments, **options)
            self.seconds += perf_counter() - begin
            return result

        return call


_meters: list[Meter] = []


def library(function: Function) -> Function:
    """Return a library's function itself; a metered one while an overhead is measured."""
    metered: Any = _meters[-1].metered(function) if _meters else function
    return metered


def is_metered() -> bool:
    """Return whether an overhead is being measured."""
    return bool(_meters)


def report_library(seconds: float) -> None:
    """Report the time that a library took in another process [s]."""
    if _meters:
        _meters[-1].seconds += seconds


def overhead(adapter: Any, prepare: Callable[[], Ask], request: PoseRequest) -> float:
    """Return the median time of a solve that its solver's library does not use [s].

    It is an upper bound, for reading the clock costs time too; NaN if the solver raises.

    Args:
        adapter: its module.
        prepare: sets the solver up by the adapter.
        request: a target, which is solved several times if the adapter is metered.
    """
    if not getattr(adapter, "METERED", False):
        stored = Solve(lambda: None, lambda answer: (answer, None))
        return median(_seconds(stored()) for _ in range(REPEATS))
    meter = Meter()
    _meters.append(meter)
    try:
        solve = prepare()(request)
        return median(_remaining(solve, meter) for _ in range(REPEATS))
    except Exception:  # which is a failed attempt where its answers count
        return math.nan
    finally:
        _meters.remove(meter)


def _remaining(solve: Callable[[], SolverOutput], meter: Meter) -> float:
    meter.seconds = 0.0
    return _seconds(solve()) - meter.seconds


def _seconds(output: SolverOutput) -> float:
    return output.time.seconds if output.time else math.nan
