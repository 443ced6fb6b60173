"""What the numbers of answers show of a solver's precision, whatever its greeting says.

Programs compute in single precision, or print few digits, and do not say so: judged as double
precision all their answers would be wrong, and no fault would explain it.
"""

from collections.abc import Iterable, Sequence
from decimal import Decimal, DecimalTuple
from typing import Any

import msgspec
import numpy as np

from .contestant import Answer, Exchange
from .greeting import Greeting
from .judgement import TaskReport
from .sentence import Sentence, sentence

# So many numbers of an output decide, since 99 % of doubles have 15 digits or more; requests of
# which no larger share has as many are left out.
LEAST, FULL = 6, 0.25
# With fewer digits than these answers are compared as they are; with more they are whole doubles.
FEWEST, MOST = 4, 14
# How many digits single precision is printed with, and leaves correct in most cases.
SINGLE, LEFT = (8, 9), (5.0, 9.0)
AS_SINGLE = sentence(
    "The answers are single-precision numbers and are judged as such. Declare it: "
    '"precision": "single" in the greeting (of a Python file, in PLUMBOB).'
)
OFF = sentence(
    "The answers are as inexact as in single precision and are judged as such. Look for a float or "
    'a constant of few digits; if it is meant, declare "precision": "single" in the greeting (of a '
    "Python file, in PLUMBOB)."
)


class Rounded(Greeting, frozen=True):
    """A greeting as if it declared that answers have so many significant digits."""

    digits: int = MOST

    @property
    def epsilon(self) -> float:
        """Less than a last digit: printing rounds once, where laws allow many roundings."""
        return max(super().epsilon, 10.0 ** (1 - self.digits) / 8.0)


def judging_greeting(
    asked: Sequence[Exchange], greeting: Greeting
) -> tuple[Greeting, Sentence | None]:
    """Return the greeting that answers are judged by, and why it is another than was sent."""
    outputs = [numbers for numbers in _outputs(asked).values() if len(numbers) >= LEAST]
    greetings = [_greeting_of(numbers, greeting) for numbers in outputs]
    return max(greetings, key=lambda pair: pair[0].epsilon, default=(greeting, None))


def _greeting_of(numbers: np.ndarray, greeting: Greeting) -> tuple[Greeting, Sentence | None]:
    digits, reason = _digits(numbers), AS_SINGLE
    if digits in SINGLE or (numbers.astype(np.float32) == numbers).all():
        digits = SINGLE[1]
    elif FEWEST <= digits <= MOST:
        reason = sentence(
            "The answers have only {digits} significant digits (cout, %g and to_string print 6) "
            "and are judged by those. Print 17, or 9 and declare "
            '"precision": "single" in the greeting.',
            digits=digits,
        )
    else:
        return greeting, None
    precision = "single" if digits <= SINGLE[1] else greeting.precision
    fields = msgspec.structs.asdict(greeting) | {"precision": precision, "digits": digits}
    coarse = Rounded(**fields)
    return (coarse, reason) if coarse.epsilon > greeting.epsilon else (greeting, None)


def _digits(numbers: np.ndarray) -> int:
    """Return to how many significant digits numbers are rounded, or decimal places if to those."""
    decimals = _decimals(numbers)
    digits = [len(decimal.digits) for decimal in decimals]
    places = [-int(decimal.exponent) for decimal in decimals]
    is_fixed = places.count(max(places)) > max(digits.count(max(digits)), len(digits) / 2)
    return max(places) if is_fixed and max(digits) <= MOST else max(digits)


def _decimals(numbers: np.ndarray) -> list[DecimalTuple]:
    """Return the fewest digits that tell each number from other doubles."""
    return [Decimal(repr(x)).normalize().as_tuple() for x in numbers.tolist()]


def _outputs(asked: Sequence[Exchange]) -> dict[str, np.ndarray]:
    """Return the numbers of each output that are not from the request, where that is not short.

    Of a request in short decimals a double may answer so. A residual is a claim, not an answer.
    """
    outputs: dict[str, np.ndarray] = {}
    for question in asked:
        inputs = _long_numbers(question.case.inputs.values())
        count = sum(len(decimal.digits) > MOST for decimal in _decimals(inputs))
        if isinstance(question.answer, Answer) and count > FULL * len(inputs):
            for name, value in question.answer.values.items():
                if name != "residual":
                    numbers = np.setdiff1d(_long_numbers([value]), inputs)
                    outputs[name] = np.union1d(outputs.get(name, ()), numbers)
    return outputs


def _long_numbers(values: Iterable[Any]) -> np.ndarray:
    """Return those finite numbers that need more than 12 bits: not 0, 1 or a half."""
    numbers = np.concatenate([np.ravel(value) for value in values if not isinstance(value, str)])
    numbers = numbers[np.isfinite(numbers)].astype(float)
    return numbers[2.0**12 * np.frexp(numbers)[0] % 1.0 != 0.0]


def is_off_by_single(report: TaskReport) -> bool:
    """Return whether answers are off by what single precision loses, in most cases."""
    counts = (judgement.digits for judgement in report.judgements)
    digits = [count for count in counts if count is not None] or [0.0]
    return min(digits) >= LEFT[0] and float(np.median(digits)) <= LEFT[1]
