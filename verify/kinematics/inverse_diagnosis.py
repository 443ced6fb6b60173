"""Name the faults of wrong inverse kinematics, or of its sweeps."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from ..cause_search import JudgedAnswers
from ..greeting import Greeting
from ..judgement import Diagnosis, Explanation, Verdict
from . import (
    claims,
    early_ends,
    jacobian_steps,
    limits,
    sweeps,
)
from .fault_search import diagnosis_of
from .faults import SwitchFault, sentences_of
from .inverse_kinematics import STOPS, is_sound, judged_trials, split
from .report import with_hints
from .sweep_diagnosis import explained, suspected_method
from .sweeps import PoseTrial, SweepComparison

MAX_FAULTS = 3
# So many sweeps that keep all laws have to differ from the textbook's before a mistake is named:
# fewer are met by several mistakes by chance.
MIN_DIFFERENT = 3


LIMITS = sentences_of("limits")


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the poses, or the sweeps of poses that are right."""
    limited, unlimited = split(judged_answers.exchanges)
    greeting, method = judged_answers.greeting, judged_answers.report.method
    trials, comparison = judged_trials(unlimited, greeting, method)
    base = judged_answers.base or ()
    if not method and not comparison.method and not sweeps.idle(trials):
        comparison = _suspicion(trials, greeting, base)
    diagnosis = _diagnosis(trials, comparison, greeting, base)
    diagnosis = _with_hints(diagnosis, trials, comparison, greeting)
    judgements = [trial.judgement for trial in trials]
    answers = [
        claims.values_of(trial.case, [trial.pose], trial.outputs, comparison.method, greeting)
        for trial in trials
        if trial.pose.finite
    ]
    diagnosis = claims.with_claims(diagnosis, judgements, answers, not base)
    if is_sound(judgements):  # what is wrong without limits is so with them
        _, key = limits.judge(limited, greeting, True)
        reading = [Explanation((key,), LIMITS[key], 1.0, 0.0)] if key else []
        diagnosis = replace(diagnosis, explanations=(*diagnosis.explanations, *reading))
    return with_hints(judged_answers.report.judgements, diagnosis)


def _suspicion(
    trials: Sequence[PoseTrial], greeting: Greeting, base: Sequence[SwitchFault]
) -> SweepComparison:
    """Return how sweeps compare with those of the method that they resemble with a fault."""
    sweep_trials = [trial for trial in trials if trial.is_sweep and trial.pose.finite]
    method = suspected_method(sweep_trials, greeting, base)
    others_hold = not any(trial.is_wrong for trial in trials)
    return sweeps.compare(sweep_trials, method, "", others_hold, greeting)


def _with_hints(
    diagnosis: Diagnosis,
    trials: Sequence[PoseTrial],
    comparison: SweepComparison,
    greeting: Greeting,
) -> Diagnosis:
    """Return a diagnosis with what all answers show; sweeps that move nothing explain no fault."""
    idle, points, lengths = sweeps.idle(trials), None, None
    sweep_trials = [trial for trial in trials if trial.is_sweep and trial.pose.finite]
    if all(explanation.share < 1.0 for explanation in diagnosis.explanations):
        idle = idle or sweeps.idle([t for t in sweep_trials if t.case.facts["sweeps"] == 1])
        diagnosis = replace(diagnosis, explanations=()) if idle else diagnosis
    if not diagnosis.explained:
        points = sweeps.right_points(comparison, sweep_trials, greeting)
        lengths = sweeps.lengths(trials)
    return replace(diagnosis, hints=tuple(filter(None, [idle, points, lengths])))


def _ends_elsewhere(trial: PoseTrial) -> bool:
    """Return whether a solve goes on within its tolerance, or ends short of the nearest point."""
    laws = (STOPS, "nearest point")
    return any(entry.law in laws and entry.verdict for entry in trial.judgement.findings)


def _diagnosis(
    trials: Sequence[PoseTrial],
    comparison: SweepComparison,
    greeting: Greeting,
    base: Sequence[SwitchFault],
) -> Diagnosis:
    """Return the faults that reproduce the answers, of the method or of a Jacobian's steps."""
    posed_trials = [trial for trial in trials if trial.pose.outputs]
    sweep_trials = [trial for trial in posed_trials if trial.is_sweep]
    names = comparison.wrong
    # what repeats its start is explained by chance by several faults at once
    max_faults = 1 if sweeps.idle(trials) else MAX_FAULTS
    wrong = [trial for trial in sweep_trials if trial.is_wrong or trial.case.name in names]
    if not any(trial.is_wrong for trial in trials):
        wrong = [trial for trial in wrong if not trial.has_ended]
        wrong = wrong if len(wrong) >= MIN_DIFFERENT else []
    must = [t for t in posed_trials if t.case.requirement == "must" and t.pose.finite]
    diagnosis = Diagnosis(behaviour=comparison.behaviour)
    if any(trial.case.facts["sweeps"] == 1 for trial in wrong) or (wrong and comparison.damped):
        diagnosis = explained(comparison, sweep_trials, wrong, greeting, max_faults, base)
    elif comparison.method:
        wrong = [t for t in wrong if t in must]
        wrong += [t for t in must if not t.is_sweep and (t.is_wrong or _ends_elsewhere(t))]
        bound = partial(sweeps.prediction_bound, greeting)
        exchanges = {trial.case.name: trial.comparable for trial in must}
        diagnosis = diagnosis_of(
            comparison.method, list(exchanges.values()), [exchanges[t.case.name] for t in wrong],
            bound, comparison.behaviour, base=base,
        )  # fmt: skip
    is_certain = any(explanation.share == 1.0 for explanation in diagnosis.explanations)
    if wrong and comparison.method and not is_certain:
        solves = [trial for trial in must if trial in wrong or not trial.is_sweep]
        failures = [trial for trial in wrong if trial in must]
        early = early_ends.explanation(solves, failures, comparison.method, greeting)
        return replace(diagnosis, explanations=(early,)) if early else diagnosis
    is_right = all(trial.judgement.verdict is Verdict.RIGHT for trial in trials)
    if not (comparison.method or diagnosis.explained):
        steps = jacobian_steps.explanations(trials, greeting, base, is_right)
        steps = steps if steps or is_right else early_ends.by_squares(trials)
        return replace(diagnosis, explanations=steps or diagnosis.explanations)
    return diagnosis
