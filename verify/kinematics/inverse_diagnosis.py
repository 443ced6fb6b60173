"""Ends of solves, claims and readings of limits that wrong poses show."""

from collections.abc import Sequence
from dataclasses import replace

from ..cause_search import JudgedAnswers
from ..greeting import Greeting
from ..judgement import Diagnosis, Explanation
from . import claims, early_ends, limits, sweeps
from .faults import sentences_of
from .inverse_kinematics import STOPS, is_sound, judged_trials, split
from .report import with_hints
from .sweeps import PoseTrial, SweepComparison


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return what ends solves early, which claims are false and how limits are read."""
    limited, unlimited = split(judged_answers.exchanges)
    greeting, method = judged_answers.greeting, judged_answers.report.method
    trials, comparison = judged_trials(unlimited, greeting, method)
    diagnosis = _diagnosis(trials, comparison, greeting)
    diagnosis = _with_hints(diagnosis, trials, comparison, greeting)
    judgements = [trial.judgement for trial in trials]
    answers = [
        claims.values_of(trial.case, [trial.pose], trial.outputs, comparison.method, greeting)
        for trial in trials
        if trial.pose.finite
    ]
    diagnosis = claims.with_claims(diagnosis, judgements, answers, judged_answers.is_placed)
    if is_sound(judgements):  # what is wrong without limits is so with them
        _, key = limits.judge(limited, greeting)
        reading = [Explanation((key,), sentences_of("limits")[key], 1.0, 0.0)] if key else []
        diagnosis = replace(diagnosis, explanations=(*diagnosis.explanations, *reading))
    return with_hints(judged_answers.report.judgements, diagnosis)


def _diagnosis(
    trials: Sequence[PoseTrial], comparison: SweepComparison, greeting: Greeting
) -> Diagnosis:
    """Return the test at too early ends of solves, if a test explains all."""
    diagnosis = Diagnosis(behaviour=comparison.damped or comparison.behaviour)
    must = [t for t in trials if t.pose.outputs and t.case.requirement == "must" and t.pose.finite]
    if comparison.damped or any(t.case.name in comparison.wrong for t in must):
        return diagnosis
    wrong = [t for t in must if not t.is_sweep and (t.is_wrong or _ends_elsewhere(t))]
    if not (wrong and comparison.method):
        squares = () if comparison.method or not wrong else early_ends.by_squares(trials)
        return replace(diagnosis, explanations=squares)
    solves = [trial for trial in must if not trial.is_sweep]
    early = early_ends.explanation(solves, wrong, comparison.method, greeting)
    return replace(diagnosis, explanations=(early,) if early else ())


def _with_hints(
    diagnosis: Diagnosis,
    trials: Sequence[PoseTrial],
    comparison: SweepComparison,
    greeting: Greeting,
) -> Diagnosis:
    """Return a diagnosis with what all answers show of an unexplained mistake."""
    if diagnosis.explained:
        return diagnosis
    sweep_trials = [trial for trial in trials if trial.is_sweep and trial.pose.finite]
    first_sweeps = [trial for trial in sweep_trials if trial.case.facts["sweeps"] == 1]
    hints = (
        sweeps.idle(trials) or sweeps.idle(first_sweeps),
        sweeps.other_count(comparison, sweep_trials, greeting),
    )
    return replace(diagnosis, hints=tuple(filter(None, hints)))


def _ends_elsewhere(trial: PoseTrial) -> bool:
    """Return whether a solve goes on within its tolerance, or ends short of the nearest point."""
    laws = (STOPS, "nearest point")
    return any(entry.law in laws and entry.verdict for entry in trial.judgement.findings)
