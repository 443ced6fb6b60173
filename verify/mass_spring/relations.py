"""Find what answers tell: a number, or a combination of known terms with the same coefficients."""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from .faults import relation_fault
from .options import Option, read_table

# The maximum of terms of a combination, and how many numbers have to support each of them.
MOST_TERMS, ROWS_FOR_EACH = 3, 4
# Columns whose singular values differ by more are taken for dependent.
INDEPENDENT = 1e-7
# The number of trials of a number in a round, of the rounds, and of the corrections after them.
TRIALS, ROUNDS, CORRECTIONS = 24, 2, 12
# Relative changes: of a number for its derivative, and of the last correction.
DIFFERENCE, EXACT = 1e-6, 1e-12
# A coefficient this near to a fraction of a small denominator is that fraction.
SIMPLE, DENOMINATOR = 1e-7, 100


_TABLE = read_table("relations.toml")
SUMS = ("total", "potential")  # of energies
EVERYWHERE = sentence("in all answers")


class Sample(NamedTuple):
    """A quantity of an answer, by particle and component."""

    quantity: FloatArray
    value: Callable[[str], FloatArray]  # of a formula, for this answer
    allowed: float  # how far rounding may take the quantity


def relation_of(
    name: str, samples: Sequence[Sample], known: Sequence[Option] = ()
) -> Option | None:
    """Return the fault that a quantity is another combination of its known terms, if it is.

    The combination is that of a known fault, or has the fewest terms, with the same coefficients in
    all samples, or in a region of all samples outside of which they are right.
    """
    if not samples:
        return None

    def stacked(formula: str) -> FloatArray:
        values = [np.broadcast_to(s.value(formula), s.quantity.shape) for s in samples]
        return np.concatenate(values)

    target = np.concatenate([sample.quantity for sample in samples])
    allowed = np.concatenate([np.full(s.quantity.shape, s.allowed) for s in samples])
    terms = {term["formula"]: stacked(term["formula"]) for term in _TABLE[name]}
    is_right = np.abs(target - stacked(_TABLE["right"][name])) <= allowed
    if is_right.all():
        return None
    for fault in known:
        if (np.abs(target - stacked(fault.fields[name])) <= 2.0 * allowed).all():
            return fault
    regions = _TABLE["region"] if target.ndim == 2 else []
    for region in ({"formula": "True"}, *regions):
        mask = stacked(region["formula"]).astype(bool)
        if not mask.any() or not is_right[~mask].all():
            continue
        factors = combination(
            target[mask], {formula: term[mask] for formula, term in terms.items()}, allowed[mask]
        )
        if factors is not None:
            return _fault(name, factors, region)
    return None


def _fault(name: str, factors: Mapping[str, float], region: Mapping[str, str]) -> Option:
    symbols = {term["formula"]: term["symbol"] for term in _TABLE[name]}
    words, formula = "", "0.0"
    for term, factor in factors.items():
        size = f"{abs(factor):.6g} ".removeprefix("1 ")
        words += f" {'-' if factor < 0.0 else '+'} {size}{symbols[term]}"
        formula += f" + {factor!r} * ({term})"
    words = words.removeprefix(" + ") if factors else "0"
    place = Sentence(region["sentence"], {}) if "sentence" in region else EVERYWHERE
    right = _TABLE["right"][name]
    if "sentence" in region:
        formula = f"np.where({region['formula']}, {formula}, {right})"
    values = {"relation": words.strip(), "formula": formula, "where": place, "whole": name}
    return relation_fault("sum" if name in SUMS else name, values)


def combination(
    target: FloatArray, terms: Mapping[str, FloatArray], allowed: FloatArray
) -> dict[str, float] | None:
    """Return the fewest terms whose sum with some factors is a target, None if no few are."""
    columns = {term: column for term, column in terms.items() if np.abs(column).max() > 0.0}
    for count in range(MOST_TERMS + 1):
        if count * ROWS_FOR_EACH > len(target):
            break
        for names in combinations(columns, count):
            factors = _factors(target, [columns[term] for term in names], allowed)
            if factors is not None:
                return dict(zip(names, factors, strict=True))
    return None


def _factors(
    y: FloatArray, columns: Sequence[FloatArray], allowed: FloatArray
) -> list[float] | None:
    """Return the factors of columns whose sum is y within rounding, None if there are none."""
    if not columns:
        return [] if (np.abs(y) <= allowed).all() else None
    A = np.array(columns).T
    scales = np.abs(A).max(axis=0)
    solution, _, rank, _ = np.linalg.lstsq(A / scales, y, INDEPENDENT)
    factors = [_simple(number) for number in solution / scales]
    bound = allowed * (1.0 + np.abs(factors).sum())
    is_exact = rank == len(columns) and (np.abs(A @ factors - y) <= bound).all()
    return factors if is_exact and 0.0 not in factors else None


def _simple(number: float) -> float:
    """Return the fraction of a small denominator that is very near, or the number."""
    fraction = float(Fraction(number).limit_denominator(DENOMINATOR))
    return fraction if abs(fraction - number) <= SIMPLE * max(1.0, abs(number)) else float(number)


@np.errstate(all="ignore")
def fitted(
    fault: Option, difference: Callable[[Option], FloatArray], allowed: float
) -> Option | None:
    """Return a fault with the number that answers tell, None if they seem to tell none."""
    if fault.at is None or fault.range is None:
        return fault
    at, (low, high) = fault.at, fault.range
    number = fitted_number(lambda number: difference(at(number)), low, high, allowed)
    return None if number is None else at(number)._replace(range=fault.range)


def fitted_number(
    difference: Callable[[float], FloatArray], low: float, high: float, allowed: float
) -> float | None:
    """Return the number between two bounds at which a difference vanishes, if there is one.

    Some numbers are tried, evenly or by their logarithms if both bounds are positive, then some
    between the neighbours of the best. That is corrected by Newton's method for least squares until
    the difference is no more than allowed, or the number stays.
    """
    space = np.geomspace if low > 0.0 else np.linspace
    first, last = low, high
    for _ in range(ROUNDS):
        trials = space(first, last, TRIALS)
        best = int(np.argmin([_norm(difference(float(number))) for number in trials]))
        first, last = trials[max(best - 1, 0)], trials[min(best + 1, TRIALS - 1)]
    number = float(trials[best])
    for _ in range(CORRECTIONS):
        change = DIFFERENCE * max(abs(number), low if low > 0.0 else 1.0)
        before = difference(number)
        if _norm(before) <= allowed:
            break
        slope = (difference(number + change) - before) / change
        square = float(slope @ slope)
        if not np.isfinite(square) or square == 0.0:
            return None
        step = float(before @ slope) / square
        number = float(np.clip(number - step, low, high))
        if abs(step) <= EXACT * abs(number):
            break
    return _simple(number)


def _norm(x: FloatArray) -> float:
    size = float(np.sqrt((x * x).sum()))
    return size if np.isfinite(size) else np.inf
