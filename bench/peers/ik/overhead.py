"""The time inside the clock but outside a solver's library: the overhead of the harness.

Most adapters time a single call of their library: the harness adds the reading of the clock and a
call. An adapter with a loop around its library passes the functions through `library` and says
`METERED = True`.
"""

import math
from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any, TypeVar

from .protocol import Ask, PoseRequest, Solve, SolverOutput

REPEATS = 5
Function = TypeVar("Function", bound=Callable[..., Any])
# The time of a library's functions while an overhead is measured [s], else nothing.
_library_seconds: list[float] = []


def library(function: Function) -> Function:
    """Return a library's function, with a sum of its time while an overhead is measured."""
    if not is_metered():
        return function

    def metered(*arguments: Any, **options: Any) -> Any:
        begin = perf_counter()
        result = function(*arguments, **options)
        _library_seconds[0] += perf_counter() - begin
        return result

    call: Any = metered
    return call


def is_metered() -> bool:
    """Return whether an overhead is being measured."""
    return bool(_library_seconds)


def report_library(seconds: float) -> None:
    """Report the time of a library in another process [s]."""
    if is_metered():
        _library_seconds[0] += seconds


def overhead(adapter: Any, prepare: Callable[[], Ask], request: PoseRequest) -> float:
    """Return the median time of a solve outside its solver's library [s].

    The result is an upper bound, for reading the clock costs time too; NaN if the solver raises.
    `prepare` sets the solver up by its adapter.
    """
    _library_seconds.append(0.0)
    try:
        is_loop = getattr(adapter, "METERED", False)
        solve = prepare()(request) if is_loop else Solve(lambda: None, lambda q: (q, None))
        return median(_remaining(solve) for _ in range(REPEATS))
    except Exception:  # which is a failed attempt where its answers count
        return math.nan
    finally:
        _library_seconds.clear()


def _remaining(solve: Callable[[], SolverOutput]) -> float:
    _library_seconds[0] = 0.0
    time = solve().time
    return time.seconds - _library_seconds[0] if time else math.nan
