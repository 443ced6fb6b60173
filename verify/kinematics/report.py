"""The report on a task of kinematics: its diagnosis, and the smallest failure."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from plumbob.text.sentence import Sentence

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import TRIAL, explain
from ..judgement import (
    LEAST_SHARE,
    CaseJudgement,
    Diagnosis,
    Explanation,
    TaskReport,
    Verdict,
    first_broken,
    smallest_failures,
)
from ..laws import finding, hints_of, laws_that_hold, proportion_of
from .faults import SwitchFault, describe
from .predictions import variants

# The most cases that are compared with every variant, small and wrong ones first.
COMPARED = 20
# A track takes hundreds of sweeps: with faults that are known it has to be reproduced at once.
TRIAL_OF_TRACKS = 1


def diagnosis_of(
    method: str,
    exchanges: Sequence[Exchange],
    wrong: Sequence[Exchange],
    tolerance: Callable[[Case], float],
    behaviour: Sentence | None = None,
    *,
    max_faults: int = 3,
    base: Sequence[SwitchFault] = (),
) -> Diagnosis:
    """Return the faults of a method that reproduce the answers, if some answers are wrong."""
    compared: list[Exchange] = []
    for group in (wrong, [exchange for exchange in exchanges if exchange not in wrong]):
        with_answers = [exchange for exchange in group if isinstance(exchange.answer, Answer)]
        if not with_answers and group is wrong:
            return Diagnosis(behaviour=behaviour)
        compared += sorted(with_answers, key=lambda exchange: exchange.case.size)
    compared = compared[:COMPARED]
    trial = TRIAL_OF_TRACKS if base and method.startswith("track") else TRIAL
    explanations, count = explain(
        variants(method, max_faults, base), compared, tolerance, partial(describe, method), trial
    )
    # of the answers that are wrong, as many as of all answers to an unknown solver
    right_share = sum(exchange not in wrong for exchange in compared) / len(compared)
    least_share = right_share + LEAST_SHARE * (1.0 - right_share)
    faulty = tuple(
        explanation
        for explanation in explanations
        if explanation.faults != ("",)
        and explanation.share >= least_share
        and (explanation.share == 1.0 or not _adds(explanation, base))
    )
    return Diagnosis(faulty, behaviour, variant_count=count)


def _adds(explanation: Explanation, base: Sequence[SwitchFault]) -> bool:
    """Return whether an explanation adds faults to those of what the task builds upon.

    What these alone do to a program of another structure is more likely than one more fault.
    """
    keys = {fault.key for fault in base}
    return bool(keys) and not keys.issuperset(explanation.faults[0].split(" + "))


def report(
    task: str, method: str, judgements: Sequence[CaseJudgement], behaviour: Sentence | None = None
) -> TaskReport:
    """Return the report on answers of which no cause is sought yet."""
    if not any(map(_has_numbers, judgements)):
        judgements = list(map(_as_broken, judgements))
    diagnosis = with_hints(judgements, Diagnosis(behaviour=behaviour))
    return TaskReport(task, method, judgements, diagnosis)


def with_hints(judgements: Sequence[CaseJudgement], diagnosis: Diagnosis) -> Diagnosis:
    """Return a diagnosis with hints, and the first broken law where no fault explains answers."""
    failures = smallest_failures(judgements, diagnosis.explained)
    broken = None
    if len(failures) == 1 and not diagnosis.explained:
        broken = first_broken(failures)
    hints = (*diagnosis.hints, *hints_of(judgements, diagnosis.explained))
    if broken:
        hints += proportion_of(judgements)
    if max((judgement.verdict for judgement in judgements), default=0) == Verdict.UNDECIDED:
        hints += (laws_that_hold(judgements),)
    return replace(diagnosis, first_broken=broken, hints=hints)


def _has_numbers(judgement: CaseJudgement) -> bool:
    """Return whether an answer has an output that holds numbers alone."""
    answer = judgement.answer
    outputs = answer.values.values() if isinstance(answer, Answer) else ()
    return any(
        isinstance(output, np.ndarray) and output.size > 0 and bool(np.isfinite(output).all())
        for output in outputs
    )


def _as_broken(judgement: CaseJudgement) -> CaseJudgement:
    """Return a judgement without pardon: a solver that answers no case passes none."""
    if judgement.verdict is Verdict.BROKEN:
        return judgement
    is_answered = isinstance(judgement.answer, Answer)
    return replace(judgement, findings=(finding("numbers, never"),) if is_answered else ())
