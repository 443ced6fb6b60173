"""Findings by the laws in `laws.toml`, and the judgement of a case by its findings."""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from .exchange import Answer, Exchange
from .gaps import largest_gap
from .judgement import CaseJudgement, Finding, Verdict
from .timing import time_call

# Numbers within this share of each other are alike, in single precision too.
ROUNDED = 1e-5
# Numbers of fewer decimals than these are rounded; single precision has as many [m].
MAX_DECIMALS = 6
HOLDS = sentence("It holds.")
LAWS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# The hint to leave out beside a known mistake, where NaN and infinity come from.
NO_NUMBERS = Sentence(LAWS["hints"]["numbers"]["sentence"], {})


def finding(
    key: str,
    error: float = np.inf,
    tolerance: float = 0.0,
    *,
    verdict: Verdict | None = None,
    index: int | None = None,
    law: str | None = None,
    **values: object,
) -> Finding:
    """Return RIGHT if an error is within its tolerance, else the finding of `laws.toml`.

    The key is a law, or a law and a reason after a comma. Fields of the sentence are {error},
    {index} of the worst joint, particle or point, and `values`. `verdict` and `law` replace the
    fields of the entry.
    """
    entry, error = LAWS[key], float(error)
    if verdict is None:
        verdict = Verdict[entry.get("verdict", "WRONG")]
    if error <= tolerance:
        verdict = Verdict.RIGHT
    words = Sentence(entry["sentence"], {"error": error, "index": index, **values})
    return Finding(
        law or key.partition(",")[0], verdict, error, tolerance, entry.get("unit", ""),
        words if verdict else HOLDS, index,
    )  # fmt: skip


def of_joints(
    key: str, errors: FloatArray, tolerance: float, verdict: Verdict | None = None
) -> Finding:
    """Return the finding about the worst joint, at the first: there the fault begins."""
    worst, wrong = int(np.argmax(errors)), errors > tolerance
    index = int(np.argmax(wrong)) if wrong.any() else worst
    return finding(key, errors[worst], tolerance, verdict=verdict, index=index, joint=worst)


def not_finite(key: str, outputs: FloatArray, tolerance: float = 0.0) -> Finding:
    """Return the finding of outputs of a joint as NaN or infinite."""
    return finding(key, tolerance=tolerance, index=int(np.argmin(np.isfinite(outputs))))


def digits(error: float, size: float) -> float:
    """Return the number of correct digits of a number of this size, at most 16."""
    if not np.isfinite(error):
        return 0.0
    return float(np.clip(-np.log10(max(error / size, 1e-16)), 0.0, 16.0))


def judge_case(
    exchange: Exchange,
    laws: Callable[[Mapping[str, Any]], Iterable[Finding]],
    allowed: float | Mapping[str, float],
    reference: Callable[[], Any] | None = None,
    expected: Mapping[str, Any] | None = None,
    correct_digits: float | None = None,
) -> CaseJudgement:
    """Return the judgement of an answer by the laws of its task and of all tasks.

    `laws` returns the findings about its outputs; `reference` is the call to time. Two answers to
    a request may differ by `allowed`, in any output or by its name.
    """
    answer, findings = exchange.answer, list[Finding]()
    seconds = time_call(reference)[1] if reference else None
    if isinstance(answer, Answer):
        findings += laws(answer.values)
        findings += [equal_answers(exchange, allowed), *map(_remark, answer.remarks)]
    return CaseJudgement(
        exchange.case, answer, tuple(findings), expected or {}, correct_digits, seconds
    )


def equal_answers(exchange: Exchange, allowed: float | Mapping[str, float]) -> Finding:
    """Return how far two answers to a request differ, in the worst of the outputs.

    NaN equals NaN, of which no difference is allowed.
    """
    answer, repeat = exchange.answer, exchange.repeat
    if not isinstance(answer, Answer) or not isinstance(repeat, Answer):
        return finding("equal answers, none")
    bounds = allowed if isinstance(allowed, Mapping) else dict.fromkeys(answer.values, allowed)
    findings = [
        finding("equal answers", largest_gap(output, repeat.values.get(name)),
                float(np.nan_to_num(bounds[name])), output=name)
        for name, output in answer.values.items()
        if name in bounds
    ]  # fmt: skip
    ratios = [entry.error / max(entry.tolerance, 1e-300) for entry in findings]
    return findings[int(np.argmax(ratios))] if findings else finding("equal answers", 0.0)


def hints_of(
    judgements: Sequence[CaseJudgement], is_explained: bool = False
) -> tuple[Sentence, ...]:
    """Return hints at mistakes without a program, from the broken laws."""
    findings = chain.from_iterable(judgement.findings for judgement in judgements)
    broken = {entry.law for entry in findings if entry.verdict >= Verdict.WRONG}
    hints = (
        Sentence(entry["sentence"], {}) for law, entry in LAWS["hints"].items() if law in broken
    )
    return tuple(hint for hint in hints if not (is_explained and hint == NO_NUMBERS))


def proportion_of(judgements: Sequence[CaseJudgement]) -> tuple[Sentence, ...]:
    """Return which outputs are zero in all answers, or the right outputs times a number."""
    answers = [
        (judgement.answer.values, judgement.expected)
        for judgement in judgements
        if isinstance(judgement.answer, Answer)
    ]
    sentences = []
    for name in answers[0][0] if answers else ():
        if not any(np.any(values.get(name, 0.0)) for values, _ in answers):
            sentences.append(sentence("All numbers of {name} in its answers are zero.", name=name))
            continue
        pairs = [
            (np.asarray(values[name], dtype=float), np.asarray(expected[name], dtype=float))
            for values, expected in answers
            if name in values and name in expected
        ]
        if pairs and all(a.shape == b.shape and np.isfinite(a).all() for a, b in pairs):
            sentences += _relations(name, pairs)
    return tuple(sentences)


Pairs = Sequence[tuple[FloatArray, FloatArray]]


def _relations(name: str, pairs: Pairs) -> Iterable[Sentence]:
    """Yield relations of an output's answers, first in each pair, to the right answers."""
    if _has_one_row(pairs):
        yield sentence(
            "In each answer all {name} but the first are the same: do they share one array?",
            name=name,
        )
    if name.endswith("rotations"):
        return
    factor, axes, decimals = _common_factor(pairs), _axes(pairs), _decimals(pairs)
    if factor is not None and abs(factor - 1.0) > ROUNDED:
        yield sentence(
            "All numbers of {name} in its answers are {factor:.6g} times the right ones: look "
            "for a unit or a factor.", name=name, factor=factor,
        )  # fmt: skip
    elif axes not in ("", "x, y, z"):
        yield sentence(
            "In its answers {name} are the right ones written as ({axes}): look for axes that are "
            "exchanged, or negative.", name=name, axes=axes,
        )  # fmt: skip
    elif decimals is not None:
        yield sentence(
            "All numbers of {name} in its answers have at most {decimals} decimals: return them as "
            "they are, not rounded.", name=name, decimals=decimals,
        )  # fmt: skip


def _has_one_row(pairs: Pairs) -> bool:
    """Return whether all rows but the first are alike in each first array, and seldom should."""
    long = [pair for pair in pairs if pair[0].ndim == 2 and len(pair[0]) > 2]
    spreads = [[np.ptp(rows[1:], axis=0).max() for rows in pair] for pair in long]
    return all(a == 0.0 for a, _ in spreads) and sum(b > 0.0 for _, b in spreads) > 2


def _axes(pairs: Pairs) -> str:
    """Return of which axes the first arrays' columns are in the second, "" if of none."""
    if any(a.shape[-1:] != (3,) for a, _ in pairs):
        return ""
    a, b = (np.concatenate([pair[i].reshape(-1, 3) for pair in pairs]).T for i in range(2))
    bound = ROUNDED * np.abs(b).max(initial=0.0)
    axes = list[str]()
    for i, column in enumerate(a):
        near = [
            f"{sign}{'xyz'[j]}"
            for j in (i, *range(3))
            for sign, right in (("", b[j]), ("-", -b[j]))
            if np.abs(column - right).max(initial=0.0) <= bound
        ]
        axes += near[:1]
    return ", ".join(axes) if len(axes) == 3 else ""


def _decimals(pairs: Pairs) -> int | None:
    """Return the number of decimals of the first arrays if these are the second arrays rounded."""
    a, b = (np.concatenate([pair[i].ravel() for pair in pairs]) for i in range(2))
    for decimals in range(MAX_DECIMALS):
        is_round = np.abs(a - np.round(a, decimals)).max() <= 1e-3 * 0.1**decimals
        if is_round and np.abs(a - b).max() <= 0.1**decimals:
            return decimals
    return None


def _common_factor(pairs: Pairs) -> float | None:
    """Return the common factor from the second arrays to the first, or None."""
    a, b = (np.concatenate([pair[i].ravel() for pair in pairs]) for i in range(2))
    square = float(b @ b)
    factor = float(a @ b) / square if square > 0.0 else 0.0
    is_common = np.abs(a - factor * b).max() <= ROUNDED * np.abs(a).max(initial=0.0)
    return factor if is_common else None


def laws_that_hold(judgements: Sequence[CaseJudgement]) -> Sentence:
    """Return the laws without a violation."""
    verdicts: dict[str, Verdict] = {}
    for entry in chain.from_iterable(judgement.findings for judgement in judgements):
        verdicts[entry.law] = max(entry.verdict, verdicts.get(entry.law, Verdict.RIGHT))
    names = ", ".join(law for law, verdict in verdicts.items() if not verdict)
    return sentence("Laws that hold in every case: {laws}.", laws=names or "–")


def _remark(remark: Sentence) -> Finding:
    """Return the finding of an oddity; a changed skeleton spoils every later request."""
    spoils = remark.values.get("name") in ("offsets", "parents")
    law, verdict = (
        ("untouched inputs", Verdict.WRONG) if spoils else ("remarks", Verdict.RIGHT_EXCEPT)
    )
    return Finding(law, verdict, 1.0, 0.0, "", remark)
