"""The report of a task: its diagnosis, and the smallest failure."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import explain, first_broken, hints_of
from ..judgement import CaseJudgement, Diagnosis, Explanation, TaskReport, smallest_failure
from ..sentence import Sentence
from .faults import describe
from .predictions import variants

# So many cases are compared with every variant: the small and wrong ones first.
COMPARED = 12


def diagnosed(
    method: str,
    asked: Sequence[Exchange],
    wrong: Sequence[Exchange],
    tolerance: Callable[[Case], float],
    behaviour: Sentence | None = None,
    *,
    most_faults: int = 3,
) -> Diagnosis:
    """Return which faults of a method reproduce the answers; nothing where none is wrong."""
    answered = [one for one in wrong if isinstance(one.answer, Answer)]
    right = [one for one in asked if isinstance(one.answer, Answer) and one not in answered]
    compared = (sorted(answered, key=_size) + sorted(right, key=_size))[:COMPARED]
    named: tuple[Explanation, ...] = ()
    tried = 0
    if answered:
        words = partial(describe, method)
        explanations, tried = explain(variants(method, most_faults), compared, tolerance, words)
        named = tuple(one for one in explanations if one.faults != ("",))
    return Diagnosis(named, behaviour, variant_count=tried)


def _size(one: Exchange) -> int:
    return one.case.size


def report(
    task: str, method: str, judgements: Sequence[CaseJudgement], diagnosis: Diagnosis
) -> TaskReport:
    """Return the report, with what a diagnosis without explanations has to say."""
    smallest = smallest_failure(judgements, diagnosis.explained)
    broken = None
    if smallest is not None and not diagnosis.explained:
        broken = first_broken([smallest], at_joints=True)
    hints = hints_of(judgements)
    return TaskReport(
        task, method, judgements, replace(diagnosis, first_broken=broken, hints=hints)
    )
