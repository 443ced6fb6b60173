"""Name the faults of wrong motions along curves."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence, with_code

from ..cause_search import JudgedAnswers
from ..contestant import Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from . import claims
from .fault_search import diagnosis_of
from .faults import TABLE, SwitchFault
from .inverse_kinematics import METHODS
from .report import with_hints
from .track import CONTINUES, TOLERANCE, Frame, as_poses, frames_of, prediction_bound


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the motions, likely those of the inverse kinematics."""
    exchanges, greeting, base = (
        judged_answers.exchanges,
        judged_answers.greeting,
        judged_answers.base or (),
    )
    judgements, method = judged_answers.report.judgements, judged_answers.report.method
    comparable = {e.case.name: as_poses(e) for e in exchanges if frames_of(e)}
    wrong = [
        comparable[judgement.case.name]
        for judgement in judgements
        if judgement.case.name in comparable and _is_wrong(judgement)
    ]
    diagnosis = _diagnosis(exchanges, comparable, wrong, greeting, method, base)
    answers = [
        claims.values_of(e.case, [frame.pose for frame in frames_of(e)], {}, method, greeting)
        for e in exchanges
        if e.case.name in comparable
    ]
    diagnosis = claims.with_claims(diagnosis, judgements, answers, not base)
    return with_hints(judgements, diagnosis)


def _diagnosis(
    exchanges: Sequence[Exchange],
    comparable: Mapping[str, Exchange],
    wrong: Sequence[Exchange],
    greeting: Greeting,
    method: str,
    base: Sequence[SwitchFault],
) -> Diagnosis:
    """Return the faults that reproduce the motions of a method, or of any of the textbook's."""
    bound = partial(prediction_bound, greeting)
    diagnoses = [
        diagnosis_of(f"track {textbook}", list(comparable.values()), wrong, bound, base=base)
        for textbook in METHODS
        if method in ("", textbook)
    ]
    shares = [max((e.share for e in d.explanations), default=0.0) for d in diagnoses]
    best = diagnoses[int(np.argmax(shares))] if diagnoses else Diagnosis()
    explanations = tuple(_of_solves(explanation, base) for explanation in best.explanations)
    if wrong and not any(explanation.share == 1.0 for explanation in explanations):
        blended = _blended([frames_of(exchange) for exchange in exchanges])
        explanations = (blended,) if blended else explanations
    return replace(best, explanations=explanations)


def _of_solves(explanation: Explanation, base: Sequence[SwitchFault]) -> Explanation:
    """Return an explanation that says if its faults are also of single solves."""
    keys = {fault.key for fault in base}
    if not keys.issuperset(explanation.faults[0].split(" + ")):
        return explanation
    words = sentence(
        "Its inverse_kinematics has the same mistake: {what}", what=explanation.sentence
    )
    return replace(explanation, sentence=words)


def _blended(answers: Sequence[Sequence[Frame]]) -> Explanation | None:
    """Return that effectors go a part of the way to each target, if they do.

    They set out where they were, or from the target before, and end within the tolerance.
    """
    pairs = [pair for frames in answers for pair in itertools.pairwise(frames)]
    pairs = [pair for pair in pairs if all(frame.case.facts["least"] == 0.0 for frame in pair)]
    for origin, start_of in STARTS:
        ways = np.array([frame.case.inputs["target"] - start_of(last) for last, frame in pairs])
        moves = np.array([_effector(frame) - start_of(last) for last, frame in pairs])
        part = float((ways * moves).sum() / max((ways * ways).sum(), 1e-300)) if pairs else 1.0
        misses = np.linalg.norm(moves - part * ways, axis=-1)
        if LEAST_PART < part < 1.0 - LEAST_PART and misses.max() <= 2.0 * TOLERANCE:
            entry = TABLE["follow"][BLENDED]
            words = sentence(
                "{what} It goes {part:.0%} of the way from {where} to each target.",
                what=Sentence(entry["sentence"], {}), part=part, where=origin,
            )  # fmt: skip
            return Explanation((BLENDED,), with_code(entry["code"], words), 1.0, 0.0)
    return None


def _effector(frame: Frame) -> FloatArray:
    return np.asarray(frame.pose.positions[frame.case.inputs["effector"]])


# Where effectors set out that go a part of the way to targets, by the frame before.
STARTS: Sequence[tuple[Sentence, Callable[[Frame], FloatArray]]] = (
    (sentence("the target before"), lambda last: np.asarray(last.case.inputs["target"])),
    (sentence("where it was"), _effector),
)


BLENDED, LEAST_PART = "targets blended", 0.02


def _is_wrong(judgement: CaseJudgement) -> bool:
    """Return whether frames break a law, or jump."""
    return judgement.verdict >= Verdict.WRONG or any(
        entry.verdict and entry.law in ("continuity", CONTINUES) for entry in judgement.findings
    )
