"""The report of a task: its diagnosis, and the smallest failure."""

from collections.abc import Callable, Sequence

from ..case import Case
from ..contestant import Answer, Asked
from ..explain import explain, first_broken, hints_of
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, TaskReport, smallest_failure
from ..sentence import Sentence
from .faults import describe
from .predictions import variants

# So many cases are compared with every variant: the small and wrong ones first.
COMPARED = 12


def diagnosed(
    method: str,
    asked: Sequence[Asked],
    wrong: Sequence[Asked],
    tolerance: Callable[[Case], float],
    behaviour: Sentence | None = None,
    *,
    most_faults: int = 3,
) -> Diagnosis:
    """Return which faults reproduce the answers; nothing where none is wrong."""
    told = [one for one in wrong if isinstance(one.answer, Answer)]
    if not told:
        return Diagnosis(behaviour=behaviour)
    right = [one for one in asked if isinstance(one.answer, Answer) and one not in told]
    compared = (sorted(told, key=_size) + sorted(right, key=_size))[:COMPARED]
    found, tried = explain(
        variants(method, most_faults), compared, tolerance, lambda keys: describe(method, keys)
    )
    named = tuple(one for one in found if one.faults != ("",))
    return Diagnosis(named, behaviour, tried=tried)


def _size(one: Asked) -> int:
    return one.case.size


def report(
    task: str,
    method: str,
    asked: Sequence[Asked],
    judgements: Sequence[CaseJudgement],
    diagnosis: Diagnosis,
    greeting: Greeting,
) -> TaskReport:
    """Return the report, with what a diagnosis without explanations has to say."""
    smallest = smallest_failure(judgements, diagnosis.explained)
    hints = hints_of(judgements)
    broken = None
    if smallest is not None and not diagnosis.explained:
        broken = first_broken([smallest], at_joints=True)
    told = Diagnosis(diagnosis.explanations, diagnosis.behaviour, broken, hints, diagnosis.tried)
    return TaskReport(task, method, judgements, told)
