"""Findings that several tasks share, and the judgement of an answer from them."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray, distinct_texts

from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed

HOLDS = sentence("It holds.")


def judged(
    asked: Exchange,
    greeting: Greeting,
    laws: Callable[[Mapping[str, Any]], Iterable[Finding]],
    reference: Callable[[], Any] | None = None,
    expected: Mapping[str, Any] | None = None,
    digits: float | None = None,
) -> CaseJudgement:
    """Return the judgement of an answer: the laws of its task, then those of every answer.

    Args:
        asked: the case with its answers.
        greeting: of the solver.
        laws: the findings from the answer's values.
        reference: what is timed beside the solver.
        expected: what the reference answers, by output.
        digits: correct significant digits.
    """
    case, answer = asked.case, asked.answer
    seconds = timed(reference)[1] if reference else None
    findings: list[Finding] = []
    if isinstance(answer, Answer):
        repeats = _repeated(answer, asked.repeat, case.facts["size"], greeting)
        findings = [*laws(answer.values), repeats, *map(_remark, answer.remarks)]
    return CaseJudgement(case, answer, tuple(findings), expected or {}, digits, seconds)


def bounded(
    law: str,
    error: float,
    tolerance: float,
    unit: str,
    message: Sentence,
    *,
    verdict: Verdict = Verdict.WRONG,
    where: int | None = None,
) -> Finding:
    """Return the finding that an error is within its tolerance, or the verdict if it is not.

    The sentence is given the error and the joint where it is, unless it has them.
    """
    if error <= tolerance:
        return Finding(law, Verdict.RIGHT, float(error), tolerance, unit, HOLDS, where)
    words = Sentence(message.template, {"error": error, "joint": where, **message.values})
    return Finding(law, verdict, float(error), tolerance, unit, words, where)


def of_joints(
    law: str,
    errors: FloatArray,
    tolerance: float,
    unit: str,
    message: Sentence,
    verdict: Verdict = Verdict.WRONG,
) -> Finding:
    """Return the finding of the worst joint, at the first that is off: there the fault begins."""
    worst, wrong = int(np.argmax(errors)), errors > tolerance
    words = Sentence(message.template, {"joint": worst, **message.values})
    where = int(np.argmax(wrong)) if wrong.any() else worst
    return bounded(law, errors[worst], tolerance, unit, words, verdict=verdict, where=where)


def missing(message: Sentence) -> Finding:
    """Return the finding that an answer lacks what is to be judged."""
    return Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", message)


def no_numbers(law: str, values: FloatArray, tolerance: float) -> Finding:
    """Return the finding that some values of joints are NaN or infinite."""
    joint = int(np.argmin(np.isfinite(values)))
    message = sentence("The answer of joint {joint} is not a number.", joint=joint)
    return Finding(law, Verdict.BROKEN, np.inf, tolerance, "", message, joint)


def unit(lengths: FloatArray, tolerance: float) -> Finding:
    """Return how far quaternions are off unit length; they are normalised after that."""
    errors = np.abs(lengths - 1.0)
    joint = int(np.argmax(errors))
    message = sentence(
        "The quaternion of joint {joint} has the length {length}, not 1; normalise after each "
        "product.",
        length=distinct_texts(lengths[joint], 1.0)[0],
    )
    law, verdict = "unit quaternions", Verdict.RIGHT_BUT
    return bounded(law, errors[joint], tolerance, "", message, verdict=verdict, where=joint)


def angles(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angles [rad] between unit quaternions, q and -q being one rotation."""
    chords = np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))
    return 4.0 * np.arcsin(np.minimum(0.5 * chords, 1.0))


def digits(error: float, size: float) -> float:
    """Return how many digits are correct, at most 16."""
    if not np.isfinite(error):
        return 0.0
    return float(np.clip(-np.log10(max(error, 1e-300) / size), 0.0, 16.0))


def _repeated(answer: Answer, again: object, size: float, greeting: Greeting) -> Finding:
    """Return whether the same request got the same answer again."""
    if not isinstance(again, Answer):
        message = sentence("Asked again, it gave no answer.")
        return Finding("equal answers", Verdict.BROKEN, np.inf, 0.0, "", message)
    error = max(
        (_difference(value, again.values.get(name)) for name, value in answer.values.items()),
        default=0.0,
    )
    tolerance = 16.0 * greeting.epsilon * max(size, 1.0)  # threads may add up in another order
    message = sentence(
        "Asked the same again, it answers something else, {error:.2g} away: state left over, or "
        "memory that nobody has filled."
    )
    return bounded("equal answers", error, tolerance, "", message)


def _difference(value: object, other: object) -> float:
    a, b = np.asarray(value, dtype=float), np.asarray(other, dtype=float)
    if a.shape != b.shape or (np.isnan(a) != np.isnan(b)).any():
        return np.inf
    return float(np.abs(np.nan_to_num(a) - np.nan_to_num(b)).max(initial=0.0))


def _remark(remark: Sentence) -> Finding:
    """Return what was odd about an answer; a changed skeleton spoils every later request."""
    spoils = remark.values.get("name") in ("offsets", "parents")
    verdict = Verdict.WRONG if spoils else Verdict.RIGHT_BUT
    return Finding("untouched inputs", verdict, 1.0, 0.0, "", remark)
