"""The report on a task of kinematics: its diagnosis, and the smallest failure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from plumbob.text.sentence import Sentence

from ..exchange import Answer
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    TaskReport,
    Verdict,
    first_broken,
    smallest_failures,
)
from ..laws import finding, hints_of, laws_that_hold, proportion_of


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
