"""Name the faults of wrong forward kinematics."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import Diagnosis, Verdict
from . import rounding
from .fault_search import diagnosis_of
from .report import with_hints


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the poses, if some are wrong."""
    pairs = zip(judged_answers.exchanges, judged_answers.report.judgements, strict=True)
    wrong = [exchange for exchange, j in pairs if j.verdict > Verdict.RIGHT_EXCEPT]
    diagnosis = _diagnosis(judged_answers.exchanges, wrong, judged_answers.greeting)
    return with_hints(judged_answers.report.judgements, diagnosis)


def _diagnosis(
    exchanges: Sequence[Exchange], wrong: Sequence[Exchange], greeting: Greeting
) -> Diagnosis:
    """Return the faults that reproduce the answers, or else their positions alone."""
    bound = partial(_prediction_bound, greeting)
    diagnosis = diagnosis_of("forward", exchanges, wrong, bound)
    if wrong and not diagnosis.explained:  # matrices that are no rotations become any quaternion
        alone = {id(exchange): _positions_alone(exchange) for exchange in exchanges}
        of_wrong = [alone[id(exchange)] for exchange in wrong]
        diagnosis = diagnosis_of("forward", list(alone.values()), of_wrong, bound)
    return diagnosis


def _positions_alone(exchange: Exchange) -> Exchange:
    outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
    if "positions" not in outputs:
        return exchange
    return replace(exchange, answer=Answer({"positions": outputs["positions"]}, 0.0))


def _prediction_bound(greeting: Greeting, case: Case) -> float:
    """Return the relative difference from a variant's answer that rounding explains."""
    joints = len(case.inputs["parents"])
    return max(1e-9, 4.0 * rounding.positions(greeting.epsilon, joints, 1.0))
