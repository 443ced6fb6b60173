"""The time inside the clock that a solver's library does not use: what the harness adds."""

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any, TypeVar

from .protocol import Ask, PoseRequest, Solve

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


def overhead(prepare: Callable[[], Ask], request: PoseRequest) -> float:
    """Return the median time of a solve that its solver's library does not use [s].

    It is an upper bound, for reading the clock costs time too. NaN of solvers in other processes
    that do not tell.

    Args:
        prepare: sets the solver up, as an adapter does.
        request: a target, which is solved several times.
    """
    meter = Meter()
    _meters.append(meter)
    try:
        solve = prepare()(request)
        seconds = [_remaining(solve, meter) for _ in range(REPEATS)]
    finally:
        _meters.remove(meter)
    return median(seconds)


def _remaining(solve: Any, meter: Meter) -> float:
    """Return the time of a solve without that of its library's functions [s].

    Where none is known the whole call is the library's: a function that returns its stored answer
    takes its place.
    """
    meter.seconds = 0.0
    output = solve()
    if meter.seconds:
        return output.time.seconds - meter.seconds
    if not isinstance(solve, Solve):
        return float("nan")
    answer = output
    stored = Solve(lambda: answer, lambda answer: (answer.q, answer.claim))
    return stored().time.seconds  # type: ignore[union-attr]
