"""Findings that several tasks share, and the judgement of a case from them."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray, distinct_texts

from ..contestant import Answer, Exchange
from ..explain import largest_gap
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, Verdict
from ..sentence import Sentence, sentence
from ..timing import time_call

HOLDS = sentence("It holds.")


def judge_case(
    exchange: Exchange,
    greeting: Greeting,
    laws: Callable[[Mapping[str, Any]], Iterable[Finding]],
    reference: Callable[[], Any] | None = None,
    expected: Mapping[str, Any] | None = None,
    digits: float | None = None,
) -> CaseJudgement:
    """Return the judgement of an answer by the laws of its task and of all tasks."""
    case, answer = exchange.case, exchange.answer
    seconds = time_call(reference)[1] if reference else None
    findings: tuple[Finding, ...] = ()
    if isinstance(answer, Answer):
        repeats = _equal_answers(answer, exchange.repeat, case.facts["size"], greeting)
        findings = (*laws(answer.values), repeats, *map(_remark, answer.remarks))
    return CaseJudgement(case, answer, findings, expected or {}, digits, seconds)


def bounded(
    law: str,
    error: float,
    tolerance: float,
    unit: str,
    message: Sentence,
    *,
    verdict: Verdict = Verdict.WRONG,
    index: int | None = None,
) -> Finding:
    """Return RIGHT if an error is within its tolerance, else the verdict with its sentence."""
    if error <= tolerance:
        return Finding(law, Verdict.RIGHT, float(error), tolerance, unit, HOLDS, index)
    filled = Sentence(message.template, {"error": error, "joint": index, **message.values})
    return Finding(law, verdict, float(error), tolerance, unit, filled, index)


def of_joints(
    law: str,
    errors: FloatArray,
    tolerance: float,
    unit: str,
    message: Sentence,
    verdict: Verdict = Verdict.WRONG,
) -> Finding:
    """Return the finding about the worst joint, at the first wrong one: there the fault begins."""
    worst, wrong = int(np.argmax(errors)), errors > tolerance
    filled = Sentence(message.template, {"joint": worst, **message.values})
    index = int(np.argmax(wrong)) if wrong.any() else worst
    return bounded(law, errors[worst], tolerance, unit, filled, verdict=verdict, index=index)


def missing(message: Sentence) -> Finding:
    """Return the finding that an answer lacks the output to judge."""
    return Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", message)


def no_numbers(law: str, outputs: FloatArray, tolerance: float) -> Finding:
    """Return the finding that outputs of a joint are NaN or infinite."""
    joint = int(np.argmin(np.isfinite(outputs)))
    message = sentence("The answer of joint {joint} is not a number.", joint=joint)
    return Finding(law, Verdict.BROKEN, np.inf, tolerance, "", message, joint)


def unit(lengths: FloatArray, tolerance: float) -> Finding:
    """Return whether quaternions have unit length; other laws normalise them."""
    errors = np.abs(lengths - 1.0)
    joint = int(np.argmax(errors))
    message = sentence(
        "The quaternion of joint {joint} has the length {length}, not 1; normalise after each "
        "product.",
        length=distinct_texts(lengths[joint], 1.0)[0],
    )
    law, verdict = "unit quaternions", Verdict.RIGHT_BUT
    return bounded(law, errors[joint], tolerance, "", message, verdict=verdict, index=joint)


def angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles [rad] between the rotations of unit quaternions."""
    chords = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return 4.0 * np.arcsin(np.minimum(0.5 * chords, 1.0))


def digits(error: float, size: float) -> float:
    """Return the number of correct digits, at most 16."""
    if not np.isfinite(error):
        return 0.0
    return float(np.clip(-np.log10(max(error, 1e-300) / size), 0.0, 16.0))


def _equal_answers(answer: Answer, repeat: object, size: float, greeting: Greeting) -> Finding:
    """Return whether the same request got the same answer a second time."""
    if not isinstance(repeat, Answer):
        message = sentence("The repeated request got no answer.")
        return Finding("equal answers", Verdict.BROKEN, np.inf, 0.0, "", message)
    gaps = [largest_gap(a, repeat.values.get(name)) for name, a in answer.values.items()]
    tolerance = 16.0 * greeting.epsilon * max(size, 1.0)  # threads may add up in another order
    message = sentence(
        "The repeated request got an answer that differs by {error:.2g}: state is left over, or "
        "memory is not initialised."
    )
    return bounded("equal answers", max(gaps, default=0.0), tolerance, "", message)


def _remark(remark: Sentence) -> Finding:
    """Return the finding of an oddity; a changed skeleton spoils every later request."""
    spoils = remark.values.get("name") in ("offsets", "parents")
    verdict = Verdict.WRONG if spoils else Verdict.RIGHT_BUT
    return Finding("untouched inputs", verdict, 1.0, 0.0, "", remark)
