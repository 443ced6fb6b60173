"""The report on a task of kinematics: its diagnosis, and the smallest failure."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import explain, first_broken
from ..judgement import CaseJudgement, Diagnosis, TaskReport, smallest_failure
from ..laws import hints_of
from ..sentence import Sentence
from .faults import describe
from .predictions import variants

# The most cases that are compared with every variant, small and wrong ones first.
COMPARED = 12


def diagnosis_of(
    method: str,
    exchanges: Sequence[Exchange],
    wrong: Sequence[Exchange],
    tolerance: Callable[[Case], float],
    behaviour: Sentence | None = None,
    *,
    max_faults: int = 3,
) -> Diagnosis:
    """Return the faults of a method that reproduce the answers, if some answers are wrong."""
    compared: list[Exchange] = []
    for group in (wrong, [exchange for exchange in exchanges if exchange not in wrong]):
        with_answers = [exchange for exchange in group if isinstance(exchange.answer, Answer)]
        if not with_answers and group is wrong:
            return Diagnosis(behaviour=behaviour)
        compared += sorted(with_answers, key=lambda exchange: exchange.case.size)
    explanations, count = explain(
        variants(method, max_faults), compared[:COMPARED], tolerance, partial(describe, method)
    )
    faulty = tuple(explanation for explanation in explanations if explanation.faults != ("",))
    return Diagnosis(faulty, behaviour, variant_count=count)


def report(
    task: str, method: str, judgements: Sequence[CaseJudgement], diagnosis: Diagnosis
) -> TaskReport:
    """Return the report, with hints and the first broken law where no fault explains answers."""
    smallest = smallest_failure(judgements, diagnosis.explained)
    broken = None
    if smallest is not None and not diagnosis.explained:
        broken = first_broken([smallest], at_joints=True)
    diagnosis = replace(diagnosis, first_broken=broken, hints=hints_of(judgements))
    return TaskReport(task, method, judgements, diagnosis)
