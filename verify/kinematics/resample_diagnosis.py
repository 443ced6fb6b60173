"""Hints on wrongly resampled curves; changed lines of right programs tell the cause."""

from ..cause_search import JudgedAnswers
from ..judgement import Diagnosis
from .report import with_hints


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the hints of the judgements, and what is known of strokes."""
    report = judged_answers.report
    return with_hints(report.judgements, Diagnosis(behaviour=report.diagnosis.behaviour))
