"""The number in a changed line, fitted to answers: c e or c + e in the place of e."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..exchange import Answer, Exchange
from .changes import CONSTANT
from .mutants import Mutant, Program

# The number of answers for a fit, of corrections, and the first change of the fitted number.
FITTED, CORRECTIONS, CHANGE = 2, 6, 0.25
# A number this near to a fraction of a small denominator becomes the fraction.
NEAR, DENOMINATOR = 1e-7, 100
Run = Callable[[Case], Mapping[str, Any]]


def fitted(
    program: Program,
    run: Run,
    exchanges: Sequence[Exchange],
    passes: Mapping[str, int],
    tolerance: float,
) -> Iterator[tuple[Mutant, float]]:
    """Yield the changes with a number by the first answers, and the number.

    The program has been observed.
    """
    exchanges = exchanges[:FITTED]
    target = np.concatenate([_numbers(e.answer.values, e) for e in exchanges])  # type: ignore[union-attr]
    scale = max(float(np.abs(target).max()), 1e-300)
    for mutant in program.with_constants():

        def gap(number: float, mutant: Mutant = mutant) -> FloatArray:
            answers = [with_number(program, mutant, number, passes, run, e.case) for e in exchanges]
            parts = [_numbers(a, e) for a, e in zip(answers, exchanges, strict=True)]
            return (np.concatenate(parts) - target) / scale

        neutral = 1.0 if mutant.kind == "factor" else 0.0
        number = _root(gap, neutral, tolerance)
        if number is not None and abs(number - neutral) > tolerance:
            yield mutant, number


def with_number(
    program: Program,
    mutant: Mutant,
    number: float,
    passes: Mapping[str, int],
    run: Run,
    case: Case,
) -> Mapping[str, Any]:
    """Return the answer of a program with a changed line and its number."""
    program.names[CONSTANT] = number
    with program.changed(mutant, passes[case.name]):
        return run(case)


def text_of(mutant: Mutant, number: float) -> Mutant:
    """Return a changed line with its number in the place of the name."""
    return mutant._replace(wrong=mutant.wrong.replace(CONSTANT, f"{number:.6g}"))


def _numbers(values: Mapping[str, Any], exchange: Exchange) -> FloatArray:
    """Return the answered outputs as a single list."""
    assert isinstance(exchange.answer, Answer)
    return np.concatenate([np.ravel(values[name]) for name in exchange.answer.values])


def _root(gap: Callable[[float], FloatArray], start: float, tolerance: float) -> float | None:
    """Return the number at which a gap vanishes, by secants from a start, None if none is near."""
    try:
        before, number = gap(start), start + CHANGE
        last = start
        for _ in range(CORRECTIONS):
            now = gap(number)
            slope = (now - before) / (number - last)
            square = float(slope @ slope)
            if not np.isfinite(square) or square == 0.0:
                return None
            step = float(now @ slope) / square
            last, before, number = number, now, number - step
            if np.abs(gap(number)).max() <= tolerance:
                return _simple(number)
            if abs(step) <= tolerance * abs(number):
                return None
    except (ArithmeticError, ValueError, LookupError, TypeError, np.linalg.LinAlgError):
        return None
    return None


def _simple(number: float) -> float:
    """Return a very near fraction of a small denominator, or the number."""
    fraction = float(Fraction(number).limit_denominator(DENOMINATOR))
    return fraction if abs(fraction - number) <= NEAR * max(1.0, abs(number)) else number


def is_fraction(number: float) -> bool:
    """Return whether a fitted number is a fraction of a small denominator."""
    return float(Fraction(number).limit_denominator(DENOMINATOR)) == number
