"""Infer a solver's precision from its answers: many compute in undeclared floats."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from decimal import Decimal, DecimalTuple
from typing import Any

import msgspec
import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, TaskReport, Verdict
from .examination import Examination

# A sufficient number of an output's numbers, since 99 % of doubles have 15 digits or more. Requests
# with no larger share of long numbers are left out.
MIN_NUMBERS, MIN_SHARE = 6, 0.25
# Answers with fewer digits are compared unchanged; answers with more digits are whole doubles.
MIN_DIGITS, MAX_DIGITS = 4, 14
# The printed digits of single precision, and the range of its correct digits in most cases.
SINGLE, CORRECT = (8, 9), (5.0, 9.0)
# Single precision keeps lengths to about 1e-7, double precision to much less.
EXACT = 1e-11
# Fewer answers that single precision excuses may be of stiff cases, which enlarge rounding.
MIN_FORGIVEN = 3
AS_SINGLE = sentence(
    "Judged in single precision: all its numbers are single-precision values. Declare it with "
    '"precision": "single" in the greeting (of a Python file, in PLUMBOB).'
)
INEXACT = sentence(
    "The answers are as inexact as in single precision and are judged as such. Look for a float or "
    'a constant of few digits; if it is meant, declare "precision": "single" in the greeting (of a '
    "Python file, in PLUMBOB)."
)


class RoundedGreeting(Greeting, frozen=True):
    """A greeting with the number of significant digits of the answers."""

    digits: int = MAX_DIGITS

    @property
    def epsilon(self) -> float:
        """Less than a last digit: printing rounds once, where laws allow many roundings."""
        return max(super().epsilon, 10.0 ** (1 - self.digits) / 8.0)


def judging_greeting(
    exchanges: Sequence[Exchange], greeting: Greeting
) -> tuple[Greeting, Sentence | None]:
    """Return the greeting by which to judge answers, and why the solver's own is not used."""
    outputs = [numbers for numbers in _outputs(exchanges).values() if len(numbers) >= MIN_NUMBERS]
    greetings = [_greeting_of(numbers, greeting) for numbers in outputs]
    return max(greetings, key=lambda pair: pair[0].epsilon, default=(greeting, None))


def _greeting_of(numbers: np.ndarray, greeting: Greeting) -> tuple[Greeting, Sentence | None]:
    digits, reason = _digits(numbers), AS_SINGLE
    with np.errstate(over="ignore"):  # too large for single precision
        is_single = (numbers.astype(np.float32) == numbers).all()
    if digits in SINGLE or is_single:
        digits = SINGLE[1]
    elif MIN_DIGITS <= digits <= MAX_DIGITS:
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
    rounded = RoundedGreeting(**fields)
    return (rounded, reason) if rounded.epsilon > greeting.epsilon else (greeting, None)


def _digits(numbers: np.ndarray) -> int:
    """Return the significant digits of rounded numbers, or their decimal places if these fit."""
    decimals = _decimals(numbers)
    digits = [len(decimal.digits) for decimal in decimals]
    places = [-int(decimal.exponent) for decimal in decimals]
    is_fixed = places.count(max(places)) > max(digits.count(max(digits)), len(digits) / 2)
    return max(places) if is_fixed and max(digits) <= MAX_DIGITS else max(digits)


def _decimals(numbers: np.ndarray) -> list[DecimalTuple]:
    """Return the fewest digits of each number for the same double."""
    return [Decimal(repr(x)).normalize().as_tuple() for x in numbers.tolist()]


def examine(examination: Examination, report: TaskReport) -> TaskReport:
    """Return the report on wrong answers as rounded answers, or judged in single precision.

    Single precision has to make all answers right, or to excuse answers with errors of single
    precision. The other answers are wrong in single precision too.
    """
    greeting = report.greeting
    if report.verdict is not Verdict.WRONG or greeting is None:
        return report
    places = decimal_places(report.exchanges)
    if places is not None:
        words = sentence(
            "All numbers of its answers are rounded to {places} decimals. Return all digits.",
            places=places,
        )
        return replace(report, diagnosis=Diagnosis(first_broken=words, is_certain=True))
    if greeting.precision == "single" or report.diagnosis.is_double or _is_exact(report):
        return report
    single = examination.judge(
        msgspec.structs.replace(greeting, precision="single"), report.exchanges
    )
    forgiven = [
        before
        for before, after in zip(report.judgements, single.judgements, strict=True)
        if before.verdict >= Verdict.WRONG > after.verdict
    ]
    is_right = single.verdict <= Verdict.RIGHT_EXCEPT
    if not is_right and len(forgiven) < MIN_FORGIVEN:
        return report
    if not are_off_by_single(report.judgements if is_right else forgiven):
        return report
    return replace(single, assumptions=(INEXACT,))


def decimal_places(exchanges: Sequence[Exchange]) -> int | None:
    """Return the few decimals of all answers if rounded, else None."""
    numbers = np.concatenate([*_outputs(exchanges).values(), ()])
    places = max((-int(decimal.exponent) for decimal in _decimals(numbers)), default=MIN_DIGITS)
    return places if len(numbers) >= MIN_NUMBERS and places < MIN_DIGITS else None


def _outputs(exchanges: Sequence[Exchange]) -> dict[str, np.ndarray]:
    """Return the numbers of each output beyond the request's, residuals aside."""
    outputs: dict[str, np.ndarray] = {}
    for exchange in exchanges:
        inputs = _long_numbers(exchange.case.inputs.values())
        count = sum(len(decimal.digits) > MAX_DIGITS for decimal in _decimals(inputs))
        if isinstance(exchange.answer, Answer) and count > MIN_SHARE * len(inputs):
            for name, output in exchange.answer.values.items():
                if name != "residual":
                    numbers = np.setdiff1d(_long_numbers([output]), inputs)
                    outputs[name] = np.union1d(outputs.get(name, ()), numbers)
    return outputs


def _long_numbers(arrays: Iterable[Any]) -> np.ndarray:
    """Return the finite numbers of more than 12 bits: not 0, 1 or a half."""
    numbers = np.concatenate([np.ravel(array) for array in arrays if not isinstance(array, str)])
    numbers = numbers[np.isfinite(numbers)].astype(float)
    return numbers[2.0**12 * np.frexp(numbers)[0] % 1.0 != 0.0]


def _is_exact(report: TaskReport) -> bool:
    """Return whether most answers keep lengths as only double precision does."""
    errors = [
        finding.error
        for judgement in report.judgements
        for finding in judgement.findings
        if finding.law in ("unit quaternions", "link lengths")
    ]
    return bool(errors) and float(np.median(errors)) < EXACT


def are_off_by_single(judgements: Sequence[CaseJudgement]) -> bool:
    """Return whether the errors of most answers are errors of single precision."""
    counts = (judgement.digits for judgement in judgements)
    digits = [count for count in counts if count is not None] or [0.0]
    return min(digits) >= CORRECT[0] and float(np.median(digits)) <= CORRECT[1]
