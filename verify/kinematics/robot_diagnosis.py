"""Hints at why answers about robots are wrong."""

from ..cause_search import JudgedAnswers
from ..judgement import Diagnosis
from .report import with_hints
from .robot_models import feature_of


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return what all robots with wrong answers have, and no robot without."""
    report = judged_answers.report
    hints = feature_of(report.judgements)
    behaviour = report.diagnosis.behaviour
    return with_hints(report.judgements, Diagnosis(behaviour=behaviour, hints=hints))
