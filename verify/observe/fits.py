"""The fewest terms whose sum, with a coefficient each, is a quantity in all cases."""

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

# Residuals of a sum relative to the quantity: above rounding in single precision.
TOLERANCE = 1e-5
# A term with a smaller contribution to every number is not a part of a sum.
MIN_SHARE = 1e-3
# Each term of a sum needs so many numbers, and two more: fewer are met by chance.
NUMBERS_FOR_EACH = 4
# Columns whose singular values differ by more are dependent.
INDEPENDENT = 1e-7
# A coefficient is a fraction of numbers up to this if the two differ by less than NEAR.
DENOMINATOR, NEAR = 12, 1e-6
# Coefficients this near to right coefficients are right: single precision leaves 0.99998.
RIGHT = 1e-4


class Term(NamedTuple):
    """A coefficient and the symbol of a quantity."""

    coefficient: float
    symbol: str


def fit(quantity: FloatArray, terms: Mapping[str, FloatArray], max_terms: int) -> list[Term] | None:
    """Return the fewest terms, [] for zero; among sums of as many terms the plainest coefficients.

    None if no sum of so few terms is the quantity.
    """
    if not quantity.any():
        return []
    columns = {name: column for name, column in terms.items() if np.abs(column).max() > 0.0}
    for count in range(1, min(max_terms, len(columns)) + 1):
        if len(quantity) < NUMBERS_FOR_EACH * count + 2:
            break
        sums = list(_sums(quantity, columns, count))
        if sums:
            return min(sums, key=_plainness)
    return None


def _sums(
    quantity: FloatArray, columns: Mapping[str, FloatArray], count: int
) -> Iterator[list[Term]]:
    """Yield the sums equal to a quantity, of so many columns, all needed and independent."""
    scale = np.abs(quantity).max()
    y = quantity / scale
    names, sizes = list(columns), np.array([np.abs(column).max() for column in columns.values()])
    rows = np.stack(list(columns.values())) / sizes[:, None]
    sets = np.array(list(combinations(range(len(names)), count)))
    A = np.swapaxes(rows[sets], 1, 2)  # (set, number, term)
    solutions = np.linalg.pinv(A, INDEPENDENT) @ y
    gaps = np.abs((A @ solutions[:, :, None])[:, :, 0] - y).max(axis=1)
    is_needed = (np.abs(solutions) > MIN_SHARE).all(axis=1)
    for i in np.flatnonzero(is_needed & (gaps <= TOLERANCE)):
        if np.linalg.matrix_rank(A[i], rtol=INDEPENDENT) == count:
            coefficients = scale * solutions[i] / sizes[sets[i]]
            pairs = zip(coefficients.tolist(), sets[i], strict=True)
            yield [Term(_simple(number), names[column]) for number, column in pairs]


def _simple(number: float) -> float:
    fraction = float(Fraction(number).limit_denominator(DENOMINATOR))
    return fraction if abs(fraction - number) < NEAR else number


def _plainness(terms: Sequence[Term]) -> float:
    """Return how far coefficients are from 1 and -1, in orders of magnitude."""
    return round(sum(abs(np.log(abs(term.coefficient))) for term in terms), 6)


def is_sum(terms: Sequence[Term], due: Mapping[str, float]) -> bool:
    """Return whether terms and coefficients are right."""
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
