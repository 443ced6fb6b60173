"""Claims of wrong motions along curves."""

from ..cause_search import JudgedAnswers
from ..judgement import Diagnosis
from . import claims
from .report import with_hints
from .track import frames_of


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return which claims of the motions are false."""
    report, greeting = judged_answers.report, judged_answers.greeting
    motions = [(e.case, frames_of(e)) for e in judged_answers.exchanges]
    answers = [
        claims.values_of(case, [frame.pose for frame in frames], {}, report.method, greeting)
        for case, frames in motions
        if frames
    ]
    diagnosis = claims.with_claims(
        Diagnosis(), report.judgements, answers, judged_answers.is_placed
    )
    return with_hints(report.judgements, diagnosis)
