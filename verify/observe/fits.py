"""The fewest terms whose sum, with one coefficient each, is a quantity in all cases."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

# Residuals of a sum relative to the quantity: above rounding in single precision.
TOLERANCE = 1e-5
# A term that contributes less to every number is not a part of a sum.
MIN_SHARE = 1e-3
# Each term of a sum needs so many numbers, and two more: fewer are met by chance.
NUMBERS_FOR_EACH = 4
# Columns whose singular values differ by more are dependent.
INDEPENDENT = 1e-7
# What is added to the squares of columns, so that dependent ones can be solved for; the share of a
# square sum that near sums leave at the most, far above that and above TOLERANCE squared.
RIDGE, NEARLY = 1e-12, 1e-6
# A coefficient is a fraction of numbers up to this if the two differ by less than NEAR.
DENOMINATOR, NEAR = 12, 1e-6
# Coefficients this near to the right ones are right: single precision leaves 0.99998.
RIGHT = 1e-4


class Term(NamedTuple):
    """A coefficient and the symbol of a quantity."""

    coefficient: float
    symbol: str


def fit(quantity: FloatArray, terms: Mapping[str, FloatArray], max_terms: int) -> list[Term] | None:
    """Return the fewest terms, [] for zero; among sums of as many terms the plainest coefficients.

    None if no sum of so few terms is the quantity.
    """
    scale = float(np.abs(quantity).max(initial=0.0))
    if scale == 0.0:
        return []
    columns = {name: column for name, column in terms.items() if np.abs(column).max() > 0.0}
    for count in range(1, max_terms + 1):
        if len(quantity) < NUMBERS_FOR_EACH * count + 2:
            break
        sums = [
            terms_of(names, coefficients)
            for names in _near_sums(quantity, columns, count)
            if (coefficients := _coefficients(quantity, [columns[n] for n in names], scale))
        ]
        if sums:
            return min(sums, key=_plainness)
    return None


def _near_sums(
    quantity: FloatArray, columns: Mapping[str, FloatArray], count: int
) -> list[tuple[str, ...]]:
    """Return the sets of so many columns whose best sum leaves next to nothing of a quantity.

    All sets are solved at once by their normal equations, which are good enough to choose by.
    """
    sets = np.array(list(combinations(range(len(columns)), count)))
    if not len(sets):
        return []
    A = np.stack([column / np.abs(column).max() for column in columns.values()], axis=1)
    y = quantity / np.abs(quantity).max()
    gram, right = A.T @ A, A.T @ y
    matrices = gram[sets[:, :, None], sets[:, None, :]] + RIDGE * len(y) * np.eye(count)
    solutions = np.linalg.solve(matrices, right[sets][:, :, None])[:, :, 0]
    residuals = y @ y - (right[sets] * solutions).sum(axis=1)
    names = list(columns)
    return [tuple(names[i] for i in sets[k]) for k in np.flatnonzero(residuals <= NEARLY * (y @ y))]


def _coefficients(
    quantity: FloatArray, columns: Sequence[FloatArray], scale: float
) -> list[float] | None:
    A = np.stack(columns, axis=1)
    sizes = np.abs(A).max(axis=0)
    solution, _, rank, _ = np.linalg.lstsq(A / sizes, quantity, INDEPENDENT)
    coefficients = solution / sizes
    if rank < len(columns) or np.abs(A @ coefficients - quantity).max() > TOLERANCE * scale:
        return None
    is_needed = (np.abs(solution) > MIN_SHARE * scale).all()
    return coefficients.tolist() if is_needed else None


def terms_of(symbols: Sequence[str], coefficients: Sequence[float]) -> list[Term]:
    """Return terms with simple fractions where coefficients are nearly so."""
    pairs = zip(map(_simple, coefficients), symbols, strict=True)
    return [Term(coefficient, symbol) for coefficient, symbol in pairs]


def _simple(number: float) -> float:
    fraction = float(Fraction(number).limit_denominator(DENOMINATOR))
    return fraction if abs(fraction - number) < NEAR else number


def _plainness(terms: Sequence[Term]) -> float:
    """Return how far coefficients are from 1 and -1, in orders of magnitude."""
    return round(sum(abs(np.log(abs(term.coefficient))) for term in terms), 6)


def is_sum(terms: Sequence[Term], due: Mapping[str, float]) -> bool:
    """Return whether terms are the right ones, with right coefficients."""
    return {term.symbol for term in terms} == due.keys() and all(
        abs(term.coefficient - due[term.symbol]) <= RIGHT for term in terms
    )


def formula(terms: Sequence[Term]) -> str:
    """Return a sum as a formula: "1/2 k l - k r"."""
    text = ""
    for term in terms:
        sign, number = " - " if term.coefficient < 0.0 else " + ", _number(abs(term.coefficient))
        text += sign + f"{number} ".removeprefix("1 ") + term.symbol
    text = text.removeprefix(" + ")
    return text.replace(" - ", "-", 1) if text.startswith(" - ") else text or "0"


def _number(number: float) -> str:
    fraction = Fraction(number).limit_denominator(DENOMINATOR)
    is_fraction = abs(float(fraction) - number) < NEAR and fraction.numerator <= DENOMINATOR
    return str(fraction) if is_fraction else f"{number:.6g}"
