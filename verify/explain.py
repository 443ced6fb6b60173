"""Find the variants of the reference with a solver's answers.

The variants with the fewest faults come first, so a combination is named only where no part
suffices.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from plumbob.text.sentence import Sentence, sentence

from .case import Case
from .exchange import Answer, Exchange
from .gaps import difference
from .judgement import LEAST_SHARE, Explanation

# A variant without the first, most telling answers is not compared with all.
TRIAL = 4
# A combination of faults with unexplained answers reproduces at least this share, and so much
# more than any of its parts. Else chance may explain the match.
MOST_ANSWERS, MORE = 0.7, 0.2
# The number of explanations to report.
EXPLANATIONS = 3


class Variant(NamedTuple):
    """The reference with some faults."""

    faults: tuple[str, ...]  # their keys, in the order of the computation; () for an honest model
    # returns the outputs for a case by name; answered outputs are compared. An exception of
    # NumPy or a ValueError stands for no answer
    predict: Callable[[Case], Mapping[str, Any]]
    is_special: bool = False  # compared only if no plain one with as few faults explains all
    amplification: float = 1.0  # by which its faults enlarge rounding


class Match(NamedTuple):
    """How well a variant reproduces answers."""

    variant: Variant
    share: float  # of the answers
    distance: float  # the largest relative difference of the reproduced answers
    predictions: list[Mapping[str, Any]]


def explain(
    variants: Iterable[Variant],
    exchanges: Sequence[Exchange],
    tolerance: float,
    describe: Callable[[Sequence[str]], Sentence],
    trial: int = TRIAL,
) -> tuple[Explanation, ...]:
    """Return the variants with most answers, nearest first.

    The variants come in ascending order of the number of faults, special variants last; the most
    telling answers come first: small, and wrong. `tolerance` is the relative difference by
    rounding; `describe` puts faults into words, given the keys of a class without a difference in
    any answer. A variant has to reproduce an answer among the first `trial` answers.
    """
    answers = [exchange for exchange in exchanges if isinstance(exchange.answer, Answer)]
    matches = list[Match]()
    for _, same_size in groupby(variants, key=lambda v: (len(v.faults), v.is_special)):
        matches += filter(None, (_match(v, answers, tolerance, trial) for v in same_size))
        if any(match.share == 1.0 for match in matches):
            break
    matches = _telling(matches)
    matches.sort(key=lambda match: (-match.share, len(match.variant.faults), match.distance))
    explanations = []
    for group in _classes(matches, tolerance)[:EXPLANATIONS]:
        keys = tuple(dict.fromkeys(" + ".join(match.variant.faults) for match in group))
        explanations.append(Explanation(keys, describe(keys), group[0].share, group[0].distance))
    return tuple(explanations)


def _telling(matches: Sequence[Match]) -> list[Match]:
    """Return the perfect or else the faulty matches with a larger share than any of their parts.

    A combination with unexplained answers has to explain many, and many more than its parts.
    """

    def is_needless(match: Match) -> bool:
        faults, is_vague = set(match.variant.faults), match.share < 1.0
        is_vague &= len(faults) > 1
        share = match.share - MORE * is_vague
        parts = [part.share for part in matches if set(part.variant.faults) < faults]
        return (is_vague and match.share < MOST_ANSWERS) or any(part >= share for part in parts)

    perfect = [match for match in matches if match.share == 1.0]
    faulty = [m for m in matches if m.variant.faults and m.share >= LEAST_SHARE]
    return [match for match in perfect or faulty if not is_needless(match)]


def _match(
    variant: Variant, answers: Sequence[Exchange], tolerance: float, trial: int
) -> Match | None:
    """Return how well a variant reproduces answers, or None without an early answer."""
    distances, predictions = list[float](), list[Mapping[str, Any]]()
    for i, exchange in enumerate(answers):
        if i == trial and not distances:
            return None
        assert isinstance(exchange.answer, Answer)
        outputs = exchange.answer.values
        prediction = _predict(variant, exchange.case)
        predictions.append({k: v for k, v in prediction.items() if k in outputs})
        distance = difference(predictions[-1], outputs)
        if distance <= variant.amplification * tolerance:
            distances.append(distance)
    if not distances:
        return None
    return Match(variant, len(distances) / len(answers), max(distances), predictions)


def _predict(variant: Variant, case: Case) -> Mapping[str, Any]:
    try:
        with np.errstate(all="ignore"):
            return variant.predict(case)
    except (ValueError, IndexError, ArithmeticError, np.linalg.LinAlgError):
        return {}


def _classes(matches: Sequence[Match], tolerance: float) -> list[list[Match]]:
    """Return matches in groups: of the same faults, or with as many faults and the same answers.

    Programs with the same faults may differ in other choices.
    """

    def is_alike(first: Match, second: Match) -> bool:
        faults, second_faults = first.variant.faults, second.variant.faults
        pairs = zip(first.predictions, second.predictions, strict=True)
        return faults == second_faults or (
            len(faults) == len(second_faults)
            and all(difference(*pair) <= tolerance for pair in pairs)
        )

    classes: list[list[Match]] = []
    for match in matches:
        group = next((group for group in classes if is_alike(group[0], match)), None)
        if group is None:
            classes.append([match])
        else:
            group.append(match)
    return classes


def ending_test(
    tests: Sequence[tuple[Callable[[Any], Any], float | None, Sentence]],
    runs: Sequence[Any],
    is_early: Sequence[bool],
) -> Sentence | None:
    """Return the test by which iterations end too early, None if no test does.

    Its quantity has a number for each iterate. Numbers at early ends are smaller than all numbers
    before an end, and smaller than the constant of the test, if any. The first test is of the
    number of iterations, which no single run shows; round bounds of other tests are likelier.
    """
    candidates = list[tuple[bool, Sentence]]()
    for quantity, constant, words in tests:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = [quantity(run) for run in runs]
        last = [v[-1] for v, early in zip(values, is_early, strict=True) if early]
        before = np.concatenate([v[:-1] for v in values])
        largest, smallest_before = float(max(last)), float(min(before, default=np.inf))
        if constant is not None and not largest < constant <= smallest_before:
            continue
        bound = separating_bound(largest, smallest_before)
        is_count = quantity is tests[0][0]
        if bound is not None and (len(last) > 1 or not is_count):
            count = -round(max(last))
            candidates.append((is_count or is_round(bound), Sentence(words.template, {
                **words.values, "bound": bound, "sweeps": count, "iterations": count,
            })))  # fmt: skip
    return max(candidates, key=lambda candidate: candidate[0], default=(False, None))[1]


def is_round(number: float) -> bool:
    """Return whether a number is 1, 2 or 5 times a power of ten."""
    mantissa = number / 10.0 ** math.floor(math.log10(number)) if number > 0.0 else 0.0
    return any(math.isclose(mantissa, digit) for digit in (1.0, 2.0, 5.0, 10.0))


def separating_bound(last: float, before: float) -> float | None:
    """Return a round number above `last` and not above `before`, None if there is none.

    The number is 1, 2 or 5 times a power of ten if possible, else their geometric mean.
    """
    if not last < before < np.inf:
        return None
    if last <= 0.0:
        return before
    power = 10.0 ** math.floor(math.log10(last))
    numbers = (power * factor for factor in (1.0, 10.0, 5.0, 2.0))
    return next((n for n in numbers if last < n <= before), math.sqrt(last * before))


def together(mistakes: Sequence[Sentence]) -> Sentence:
    """Return the sentences of a mistake, or of two simultaneous mistakes, as a single sentence."""
    if len(mistakes) == 1:
        return mistakes[0]
    return sentence(
        "Two mistakes at once: (1) {one} (2) {other}", one=mistakes[0], other=mistakes[1]
    )
