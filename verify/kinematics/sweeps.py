"""Compare single sweeps with the textbook's: the method of a solver, and whether it is right.

Sweeps reveal faults behind whole solves: six wrong CCDs of real programs still reach 999 of 1,000
targets.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..gaps import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, Verdict
from ..laws import LAWS, finding
from . import pose_laws, rounding
from .honest import AFTER_EACH_JOINT, HONEST, ROOT_FIRST
from .predictions import predict_inverse, solve
from .textbook import Choices

NAMES = {"ccd": "CCD", "fabrik": "FABRIK"}
# The share of the sweeps that must be a textbook's to recognise its method.
MIN_SHARE = 0.5
# A rotation smaller than this share of CCD's, or angle [rad], may be rounding and not damping.
SMALLEST = 1e-3
LAW = "one sweep"
# The largest number of sweeps of answers in place of the requested sweeps.
MOST_SWEEPS = 30
# Quaternions whose numbers differ by less are alike, in single precision too.
ROUNDED = 1e-6


class PoseTrial:
    """A case, its answered pose, and the judgement, to which laws add findings."""

    def __init__(self, exchange: Exchange) -> None:
        self.outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
        self.exchange, self.case = exchange, exchange.case
        self.pose = pose_laws.read_pose(self.outputs, self.case.inputs, self.case.facts)
        self.judgement = CaseJudgement(exchange.case, exchange.answer, (), {})
        self.is_sweep = "sweeps" in self.case.facts  # whether one or two sweeps were requested

    @property
    def is_wrong(self) -> bool:
        """Whether there is no pose, or a pose against a law."""
        findings = self.judgement.findings
        is_law = any(f.verdict >= Verdict.WRONG and f.law != "claims" for f in findings)
        return is_law or self.judgement.verdict is Verdict.BROKEN

    @property
    def has_ended(self) -> bool:
        """Whether the pose is within its tolerance, where an honest sweep may end early."""
        tolerance = self.case.inputs["tolerance"]
        return bool(tolerance > 0.0 and self.pose.distance <= tolerance)

    @property
    def comparable(self) -> Exchange:
        """The exchange with the outputs that variants predict."""
        answer = Answer(self.pose.outputs, 0.0)
        return Exchange(self.case, answer, answer)

    def add(self, findings: Sequence[Finding]) -> None:
        """Add findings to the judgement."""
        self.judgement = replace(self.judgement, findings=(*self.judgement.findings, *findings))

    def correct(self, correction: Callable[[Finding], Finding]) -> None:
        """Apply a correction to each finding."""
        findings = tuple(map(correction, self.judgement.findings))
        self.judgement = replace(self.judgement, findings=findings)


class SweepComparison(NamedTuple):
    """The result of comparing sweeps."""

    method: str  # "ccd", "fabrik" or "", as declared or inferred
    behaviour: Sentence | None = None  # the inferred method, in words
    wrong: Sequence[str] = ()  # names of the cases whose sweeps are not the textbook's
    findings: Mapping[str, Sequence[Finding]] = {}  # by the names of cases
    honest: bool = False  # whether they are another honest solver's, which may be slower
    damped: Sentence | None = None  # how its rotations are made smaller on purpose


def prediction_bound(greeting: Greeting, case: Case) -> float:
    """Return the relative difference from a variant's answer that rounding explains."""
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    amplification = case.facts.get("amplification", 10.0)
    bound = rounding.sweep(greeting.epsilon, joints, size, amplification)
    return max(1e-9, 4.0 * bound / size)


def compare(
    trials: Sequence[PoseTrial], method: str, declared: str, others_hold: bool, greeting: Greeting
) -> SweepComparison:
    """Compare sweeps with those of a method; `others_hold` says whether other laws are kept."""
    if not method:
        return SweepComparison("")
    errors = {trial.case.name: _error(trial, method, greeting) for trial in trials}
    wrong = [name for name, (error, bound) in errors.items() if not error <= bound]
    behaviour = sentence(
        "Its sweeps resemble those of {method}, with which it is compared."
        if wrong
        else 'Its sweeps are those of {method}. Declare it with "methods": ["{key}"].',
        method=NAMES[method],
        key=method,
    )
    key, damped, choice = LAW, None, None
    if wrong:
        honest = honest_variant(trials, method, greeting)
        damped = damping_of(trials, greeting) if method == "ccd" and honest is None else None
        choice = honest or damped
        key = f"{LAW}, honest" if choice else _reason(trials, method, others_hold, greeting)
    findings = {
        name: [finding(key, error, bound, method=NAMES[method], choice=choice)]
        for name, (error, bound) in errors.items()
    }
    is_honest = LAWS[key].get("verdict") == "RIGHT_EXCEPT"
    return SweepComparison(
        method, None if declared else behaviour, wrong, findings, is_honest, damped
    )


def idle(trials: Sequence[PoseTrial]) -> Sentence | None:
    """Return how local rotations are always the identity or those of the start, None if not so."""
    poses = [(t.pose.raw, t.case.inputs["local_rotations"]) for t in trials]
    answers = [(local, start) for local, start in poses if local is not None]
    if not answers:
        return None
    if all((np.abs(local[:, 0]) > 1.0 - ROUNDED).all() for local, _ in answers):
        return sentence(
            "All local rotations of its answers are the identity: is the result written into them?"
        )
    signs = [np.sign(np.sum(local * start, axis=-1, keepdims=True)) for local, start in answers]
    pairs = zip(answers, signs, strict=True)
    if all((np.abs(sign * local - start) < ROUNDED).all() for (local, start), sign in pairs):
        return sentence(
            "Its sweeps repeat the local rotations of the start: is the result written into them? "
            "If rotations are made from new points, keep these apart from the positions of the "
            "joints, as copies."
        )
    return None


def recognise_method(trials: Sequence[PoseTrial], greeting: Greeting) -> str:
    """Return the method of most of the sweeps, or the one of an honest program, or ""."""
    for method in NAMES:
        errors = [_error(trial, method, greeting) for trial in trials]
        hits = sum(error <= bound for error, bound in errors)
        if errors and hits >= MIN_SHARE * len(errors):
            return method
    if not trials or all(is_other_solver(trial, greeting) for trial in trials):
        return ""
    for method in NAMES:
        if honest_variant(trials, method, greeting) is not None:
            return method
    return "ccd" if damping_of(trials, greeting) is not None else ""


def is_other_solver(trial: PoseTrial, greeting: Greeting) -> bool:
    """Return whether a pose keeps all laws and has arrived, however few sweeps were requested."""
    findings = pose_laws.all_of(trial.pose, trial.case, greeting)
    keeps = all(finding.verdict < Verdict.WRONG for finding in findings)
    return keeps and _has_arrived(trial, greeting)


def _error(trial: PoseTrial, method: str, greeting: Greeting) -> tuple[float, float]:
    """Return the distance of the path's joints from the textbook's, and its bound [m]."""
    _, x, _ = solve(method, trial.case.inputs)
    size, amplification = trial.case.facts["size"], trial.case.facts["amplification"]
    bound = rounding.sweep(greeting.epsilon, len(x), size, amplification)
    return trial.pose.distance_to(x), bound


def _reason(trials: Sequence[PoseTrial], method: str, others_hold: bool, greeting: Greeting) -> str:
    """Return what there is to say of sweeps that are not the textbook's, a key of `laws.toml`."""
    if others_hold and all(_has_arrived(trial, greeting) for trial in trials):
        return f"{LAW}, goes on"
    if others_hold and (method == "fabrik" or all(map(_ends_well, trials))):
        return f"{LAW}, another"
    return f"{LAW}, no {NAMES[method]}"


def _has_arrived(trial: PoseTrial, greeting: Greeting) -> bool:
    """Return whether the effector has reached the target, as nearly as stalls allow."""
    stall = rounding.STALL[greeting.precision] * max(trial.case.facts["reach"], 1e-300)
    return trial.pose.distance <= stall


def _ends_well(trial: PoseTrial) -> bool:
    """Return whether the last joint of a sweep has brought the effector onto its line."""
    x, target, path = trial.pose.positions, trial.case.inputs["target"], trial.pose.path
    for j in (path[0], path[-2]):
        a, b = x[path[-1]] - x[j], target - x[j]
        if np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b) < 1e-3:
            return True
    return False


def honest_variant(trials: Sequence[PoseTrial], method: str, greeting: Greeting) -> Sentence | None:
    """Return the difference between an honest solver and the textbook if it explains all sweeps."""
    for choice in HONEST[method]:
        if _explains(trials, method, greeting, choice.choices):
            return choice.sentence
    is_early = method == "ccd" and any(trial.has_ended for trial in trials)
    if is_early and all(_ends_after_a_joint(trial, greeting) for trial in trials):
        return AFTER_EACH_JOINT.sentence
    return None


def _ends_after_a_joint(trial: PoseTrial, greeting: Greeting) -> bool:
    """Return whether a pose is that of sweeps which test the distance after each joint."""
    inputs, links = trial.case.inputs, len(trial.case.facts["path"]) - 1
    rotations = links * inputs["max_iterations"]
    case = replace(trial.case, inputs={**inputs, "max_iterations": rotations})
    prediction = predict_inverse("ccd", AFTER_EACH_JOINT.choices, case)
    return difference(prediction, trial.pose.outputs) <= prediction_bound(greeting, trial.case)


def damping_of(trials: Sequence[PoseTrial], greeting: Greeting) -> Sentence | None:
    """Return the scale or the cap of a CCD's rotations, if it explains all sweeps."""
    for choices in (Choices(), ROOT_FIRST):
        gain, cap = _damping(trials, choices)
        scaled, capped = choices._replace(gain=gain), choices._replace(cap=cap)
        is_degrees = abs(np.degrees(gain) - 1.0) < SMALLEST  # radians taken for degrees, a mistake
        if (
            SMALLEST < gain < 0.999
            and not is_degrees
            and _explains(trials, "ccd", greeting, scaled)
        ):
            return sentence(
                "It is CCD with each rotation scaled by {gain:.4g}, which is slower.", gain=gain
            )
        if cap > SMALLEST and _explains(trials, "ccd", greeting, capped):
            return sentence(
                "It is CCD with each rotation capped at {angle:.4g} rad, which is slower.",
                angle=cap,
            )
    return None


def _damping(trials: Sequence[PoseTrial], choices: Choices) -> tuple[float, float]:
    """Return the scale of the first rotation of a sweep, and the largest angle [rad]."""
    gain, largest = 1.0, 0.0
    for trial in trials:
        if trial.pose.local is None or trial.case.facts["sweeps"] != 1:
            continue
        links = trial.pose.path[:-1]
        start = trial.case.inputs["local_rotations"][links]
        local, _, _ = solve("ccd", trial.case.inputs, choices)
        first = 0 if choices.root_first else -1
        angles = rotation.angle(trial.pose.local[links], start)
        gain = float(angles[first] / rotation.angle(local[links], start)[first])
        largest = max(largest, float(angles.max()))
    return gain, largest


def _explains(
    trials: Sequence[PoseTrial], method: str, greeting: Greeting, choices: Choices
) -> bool:
    return all(
        difference(predict_inverse(method, choices, trial.case), trial.pose.outputs)
        <= prediction_bound(greeting, trial.case)
        for trial in trials
    )


def other_count(
    comparison: SweepComparison, trials: Sequence[PoseTrial], greeting: Greeting
) -> Sentence | None:
    """Return the sentence on wrong answers of another number of sweeps, else None."""
    if not comparison.wrong or not comparison.method:
        return None
    for count in range(1, MOST_SWEEPS + 1):
        if all(_is_after(count, trial, comparison.method, greeting) for trial in trials):
            return sentence(
                "Each answer is that after sweep {count} of {method}, whatever number is asked "
                "for.",
                count=count,
                method=NAMES[comparison.method],
            )
    return None


def _is_after(count: int, trial: PoseTrial, method: str, greeting: Greeting) -> bool:
    """Return whether a pose is that after so many of the textbook's sweeps."""
    inputs, facts = trial.case.inputs, trial.case.facts
    _, x, _ = solve(method, {**inputs, "tolerance": 0.0, "max_iterations": count})
    bound = rounding.sweep(greeting.epsilon, len(x), facts["size"], facts["amplification"])
    return trial.pose.distance_to(x) <= bound
