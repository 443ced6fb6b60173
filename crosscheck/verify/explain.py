"""Find which variants of the reference reproduce a solver's answers.

A variant is the reference with faults, each an independent small change. The variants with the
fewest faults are tried first, so that a combination is named only where no part of it suffices.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, groupby
from typing import Any, NamedTuple

import numpy as np

from .case import Case
from .contestant import Answer, Exchange
from .judgement import LEAST_SHARE, CaseJudgement, Explanation, Verdict
from .sentence import Sentence, sentence

# A variant is compared with all answers only if it reproduces one of so many, the telling ones.
TRIAL = 4
# How many explanations are told.
MOST_TOLD = 3


class Variant(NamedTuple):
    """The reference with some faults."""

    faults: tuple[str, ...]  # their keys, in the order of the computation; () for an honest model
    # returns outputs by name for a case; those that are also answered are compared. An exception of
    # NumPy or a ValueError means that it has no answer.
    predict: Callable[[Case], Mapping[str, Any]]


class Match(NamedTuple):
    """How well a variant reproduces answers."""

    variant: Variant
    share: float
    distance: float
    predictions: list[Mapping[str, Any]]


def explain(
    variants: Iterable[Variant],
    asked: Sequence[Exchange],
    tolerance: Callable[[Case], float],
    describe: Callable[[Sequence[str]], Sentence],
) -> tuple[tuple[Explanation, ...], int]:
    """Return the variants that reproduce most answers, nearest first, and how many were tried.

    Args:
        variants: in ascending order of the number of faults.
        asked: the cases to compare, the most telling first: small, and answered wrongly.
        tolerance: the relative difference from a prediction that rounding explains.
        describe: puts faults into words, given the keys of a class that no answer tells apart.
    """
    answered = [one for one in asked if isinstance(one.answer, Answer)]
    tried, best = 0, list[Match]()
    for _, same_size in groupby(variants, key=lambda one: len(one.faults)):
        for variant in same_size:
            tried += 1
            match = _match(variant, answered, tolerance)
            if match is not None and match.share >= LEAST_SHARE:
                best.append(match)
        if any(match.share == 1.0 for match in best):
            break
    best = _telling(best)
    best.sort(key=lambda match: (-match.share, len(match.variant.faults), match.distance))
    classes = _classes(best, answered, tolerance)[:MOST_TOLD]
    return tuple(_explanation(one, describe) for one in classes), tried


def _telling(matches: Sequence[Match]) -> list[Match]:
    """Return those that reproduce more than what has no fault; if one reproduces all, only such."""
    right = max((match.share for match in matches if not match.variant.faults), default=0.0)
    most = max((match.share for match in matches), default=0.0)
    return [
        match for match in matches if match.share == 1.0 or (most < 1.0 and match.share > right)
    ]


def _match(
    variant: Variant, answered: Sequence[Exchange], tolerance: Callable[[Case], float]
) -> Match | None:
    hits, distance = 0, 0.0
    predictions: list[Mapping[str, Any]] = []
    for i, one in enumerate(answered):
        if i == TRIAL and not hits:
            return None
        assert isinstance(one.answer, Answer)
        predicted = _prediction(variant, one.case)
        predictions.append({k: v for k, v in predicted.items() if k in one.answer.values})
        apart = difference(predictions[-1], one.answer.values)
        if apart <= tolerance(one.case):
            hits, distance = hits + 1, max(distance, apart)
    return Match(variant, hits / len(answered), distance, predictions) if hits else None


def _prediction(variant: Variant, case: Case) -> Mapping[str, Any]:
    try:
        with np.errstate(all="ignore"):
            return variant.predict(case)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        return {}


def difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """Return the largest difference of outputs that both have, relative to the output's size.

    Quaternions, outputs named rotations, are compared up to their sign. NaN equals NaN. Infinite
    if they share no output, or if an output has another shape.
    """
    shared = one.keys() & other.keys()
    return max((_apart(name, one[name], other[name]) for name in shared), default=np.inf)


def _apart(name: str, one: Any, other: Any) -> float:
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    if name.endswith("rotations") and a.shape == b.shape:
        b = b * np.where(np.nansum(a * b, -1, keepdims=True) < 0.0, -1.0, 1.0)
    return largest_gap(a, b) / max(float(np.abs(np.nan_to_num(a)).max(initial=0.0)), 1e-300)


def largest_gap(one: Any, other: Any) -> float:
    """Return the largest difference of two arrays, infinite between shapes, or NaN and number."""
    a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    return float(np.abs(np.nan_to_num(a) - np.nan_to_num(b)).max(initial=0.0))


def _classes(
    matches: Sequence[Match], answered: Sequence[Exchange], tolerance: Callable[[Case], float]
) -> list[list[Match]]:
    """Return matches grouped with those of as many faults that no answer tells apart."""

    def alike(one: Match, other: Match) -> bool:
        return len(one.variant.faults) == len(other.variant.faults) and all(
            difference(a, b) <= tolerance(asked.case)
            for a, b, asked in zip(one.predictions, other.predictions, answered, strict=True)
        )

    classes: list[list[Match]] = []
    for match in matches:
        known = next((one for one in classes if alike(one[0], match)), None)
        if known is None:
            classes.append([match])
        else:
            known.append(match)
    return classes


def _explanation(matches: Sequence[Match], describe: Callable[[Sequence[str]], Sentence]) -> Any:
    keys = [" + ".join(match.variant.faults) for match in matches]
    return Explanation(tuple(keys), describe(keys), matches[0].share, matches[0].distance)


def together(said: Sequence[Sentence]) -> Sentence:
    """Return the sentences of up to three mistakes that a solver has at once, as one."""
    if len(said) == 1:
        return said[0]
    template = (
        sentence("Two mistakes at once: (1) {one} (2) {other}")
        if len(said) == 2
        else sentence("Three mistakes at once: (1) {one} (2) {other} (3) {another}")
    )
    return _filled(template, said)


def either(explanations: Sequence[Sequence[Sentence]]) -> Sentence:
    """Return explanations that no answer tells apart as one sentence.

    An explanation is the mistakes that a solver has at once. Those that all explanations share are
    said once; of the rest up to three alternatives are said.
    """
    shared = [one for one in explanations[0] if all(one in mistakes for mistakes in explanations)]
    rests = [[one for one in mistakes if one not in shared] for mistakes in explanations]
    if not all(rests):
        return together(explanations[0])
    template = (
        sentence("One of two explanations, which the answers do not tell apart: (a) {one} (b) "
                 "{other}")
        if len(rests) == 2
        else sentence("One of several explanations, which the answers do not tell apart: (a) {one} "
                      "(b) {other} (c) {another}")
    )  # fmt: skip
    return together([*shared, _filled(template, list(map(together, rests)))])


def _filled(template: Sentence, said: Sequence[Sentence]) -> Sentence:
    values = dict(zip(("one", "other", "another"), said, strict=False))
    return Sentence(template.template, values)


def first_broken(judgements: Sequence[CaseJudgement], at_joints: bool = False) -> Sentence | None:
    """Return the law that broke first along the computation, and the joint where there are some."""
    for judgement in judgements:
        for finding in judgement.findings:
            if finding.verdict >= Verdict.WRONG:
                return sentence(
                    "The first law to break is '{law}', at joint {joint} of the case '{case}': "
                    "{why}"
                    if at_joints and finding.index is not None
                    else "The first law to break is '{law}', in the case '{case}': {why}",
                    law=finding.law,
                    joint=finding.index,
                    case=judgement.case.name,
                    why=finding.sentence,
                )
    return None


def hints_of(judgements: Sequence[CaseJudgement]) -> tuple[Sentence, ...]:
    """Return hints at what no variant explains."""
    findings = chain.from_iterable(judgement.findings for judgement in judgements)
    broken = {finding.law for finding in findings if finding.verdict >= Verdict.WRONG}
    hints = []
    if broken & {"equal answers", "equal requests"}:
        hints.append(
            sentence(
                "Equal requests get different answers. Look for state that is left over from the "
                "request before, and for memory that is read before it is written or dangles (in "
                "Eigen, a product kept with auto); a sanitizer (-fsanitize=address,undefined, or "
                "valgrind) finds the latter."
            )
        )
    if "untouched inputs" in broken:
        hints.append(
            sentence(
                "The solver writes into the skeleton that it is given, so that every later answer "
                "is about another skeleton. Copy what you change."
            )
        )
    return tuple(hints)
