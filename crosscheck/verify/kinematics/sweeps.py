"""Single sweeps held against the textbook's: what method a solver has, and whether it is right.

A sweep tells apart what whole solves do not: six of the wrong CCDs that were found in real
programs still reach 999 of 1,000 targets.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import difference
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, Verdict
from ..sentence import Sentence, sentence
from . import laws, pose_laws, rounding
from .faults import FAULTS, Switches, by_key, describe, switches
from .predictions import predict_inverse, solve
from .report import diagnosed

NAMES = {"ccd": "CCD", "fabrik": "FABRIK"}
# A textbook's sweeps are those of a solver if so many of them are.
MOST = 0.5
# A rotation smaller than this share of CCD's, or angle [rad], is no damped one: it may be rounding.
SMALLEST = 1e-3
# So many faults at once may hide which method it is.
SEEN_FAULTS = 2
LAW = "one sweep"


class AnsweredCase:
    """A case, its answer as the laws see it, and the judgement, which grows.

    Attributes:
        asked: the case with its answers.
        posed: the pose answered.
        judgement: at first without findings.
    """

    def __init__(self, asked: Exchange) -> None:
        values = asked.answer.values if isinstance(asked.answer, Answer) else {}
        self.asked, self.case = asked, asked.case
        self.posed = pose_laws.understood(values, self.case.inputs, self.case.facts)
        self.judgement = CaseJudgement(asked.case, asked.answer, (), {})

    @property
    def is_sweep(self) -> bool:
        """Whether one or two sweeps were asked for."""
        return "sweeps" in self.case.facts

    @property
    def is_wrong(self) -> bool:
        """Whether a law is broken."""
        return self.judgement.verdict >= Verdict.WRONG

    @property
    def seen(self) -> Exchange:
        """The answer as variants predict it."""
        answer = Answer(self.posed.comparable, 0.0)
        return Exchange(self.case, answer, answer)

    def add(self, findings: Sequence[Finding]) -> None:
        """Add findings to the judgement."""
        self.judgement = replace(self.judgement, findings=(*self.judgement.findings, *findings))

    def correct(self, correction: Callable[[Finding], Finding]) -> None:
        """Let each finding be what a function returns for it."""
        findings = tuple(map(correction, self.judgement.findings))
        self.judgement = replace(self.judgement, findings=findings)


class SweepComparison(NamedTuple):
    """What the sweeps say."""

    method: str  # "ccd", "fabrik" or "", as declared or inferred
    behaviour: Sentence | None = None  # what was inferred, in words
    wrong: Sequence[str] = ()  # names of the cases whose sweeps are not the textbook's
    findings: Mapping[str, Sequence[Finding]] = {}  # by the names of cases
    honest: bool = False  # whether they are another honest solver's, which may be slower
    damped: Sentence | None = None  # how its rotations are made smaller on purpose, if they are


def likeness(greeting: Greeting, case: Case) -> float:
    """Return the relative difference that still counts as a variant's answer."""
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    amplification = case.facts.get("amplification", 10.0)
    bound = rounding.sweep(greeting.epsilon, joints, size, amplification)
    return max(1e-9, 4.0 * bound / size)


def compare(
    swept: Sequence[AnsweredCase], method: str, declared: str, others_hold: bool, greeting: Greeting
) -> SweepComparison:
    """Return the findings of the sweeps of a method that is declared, or seen."""
    if not method:
        return SweepComparison("")
    errors = {one.case.name: _error(one, method, greeting) for one in swept}
    wrong = [name for name, (error, bound) in errors.items() if not error <= bound]
    behaviour = None
    if not declared:
        behaviour = sentence(
            "Its sweeps resemble those of {method}, with which it is compared."
            if wrong
            else "Its sweeps are those of {method}.",
            method=NAMES[method],
        )
    holds = verdict, message = Verdict.RIGHT, laws.HOLDS
    damped = None
    if wrong:
        honest = honest_variant(swept, method, greeting)
        damped = damping_of(swept, greeting) if method == "ccd" and honest is None else None
        choice = honest or damped
        verdict, message = (
            (Verdict.RIGHT_BUT, choice)
            if choice
            else _verdict(swept, method, others_hold, greeting)
        )
    findings = {}
    for name, (error, bound) in errors.items():
        outcome, words = (verdict, message) if name in wrong else holds
        findings[name] = [Finding(LAW, outcome, error, bound, "m", words)]
    is_honest = verdict is Verdict.RIGHT_BUT
    return SweepComparison(method, behaviour, wrong, findings, is_honest, damped)


def seen(swept: Sequence[AnsweredCase], greeting: Greeting) -> str:
    """Return the method whose sweeps most of the answers are, right or with a fault, or ""."""
    for method in NAMES:
        errors = [_error(one, method, greeting) for one in swept]
        hits = sum(error <= bound for error, bound in errors)
        if errors and hits >= MOST * len(errors):
            return method
    if not swept or all(map(partial(_is_another_solver, greeting), swept)):
        return ""
    if honest_variant(swept, "ccd", greeting) is None and damping_of(swept, greeting) is not None:
        return "ccd"
    fits = {method: _best_fit(swept, method, greeting) for method in NAMES}
    best = max(fits, key=lambda method: fits[method])
    return best if fits[best][0] >= MOST else ""


def _is_another_solver(greeting: Greeting, one: AnsweredCase) -> bool:
    """Return whether a pose keeps all laws and has arrived, whatever was asked for."""
    findings = pose_laws.all_of(one.posed, one.case, greeting)
    keeps = all(finding.verdict < Verdict.WRONG for finding in findings)
    return keeps and _goes_on(one, greeting)


def _best_fit(swept: Sequence[AnsweredCase], method: str, greeting: Greeting) -> tuple[float, int]:
    """Return what share of the sweeps a faulty textbook reproduces, and minus its faults."""
    asked = [one.seen for one in swept]
    alike = partial(likeness, greeting)
    explanations = diagnosed(method, asked, asked, alike, most_faults=SEEN_FAULTS).explanations
    return (
        (explanations[0].share, -len(explanations[0].faults[0].split(" + ")))
        if explanations
        else (0.0, 0)
    )


def _error(one: AnsweredCase, method: str, greeting: Greeting) -> tuple[float, float]:
    """Return how far the path's joints are from the textbook's, and what rounding allows [m]."""
    _, x, _ = solve(method, one.case.inputs)
    size, amplification = one.case.facts["size"], one.case.facts["amplification"]
    return one.posed.distance_to(x), rounding.sweep(greeting.epsilon, len(x), size, amplification)


def _verdict(
    swept: Sequence[AnsweredCase], method: str, others_hold: bool, greeting: Greeting
) -> tuple[Verdict, Sentence]:
    """Return what follows from sweeps that are not the textbook's."""
    if others_hold and all(_goes_on(one, greeting) for one in swept):
        return Verdict.RIGHT_BUT, sentence(
            "It goes on to the target although one sweep was asked for (max_iterations 1, "
            "tolerance 0), so that its sweeps cannot be told."
        )
    if others_hold and (method == "fabrik" or all(map(_ends_well, swept))):
        return Verdict.RIGHT_BUT, sentence(
            "Its sweep is not the textbook's {method}, though it keeps every law of one.",
            method=NAMES[method],
        )
    return Verdict.WRONG, sentence(
        "Its sweep is not that of {method}, from the effector's parent to the root, each joint "
        "rotated to bring the effector nearest."
        if method == "ccd"
        else "Its sweep is not that of {method}: backward from the target to the root, then "
        "forward from the root's place, every link at its length.",
        method=NAMES[method],
    )


def _goes_on(one: AnsweredCase, greeting: Greeting) -> bool:
    """Return whether the effector has arrived, or as near as helpers let it."""
    stall = rounding.STALL[greeting.precision] * max(one.case.facts["reach"], 1e-300)
    return one.posed.distance <= stall


def _ends_well(one: AnsweredCase) -> bool:
    """Return whether the last joint of a sweep has brought the effector onto its line."""
    x, target = one.posed.positions, one.case.inputs["target"]
    return any(
        _angle(x[one.posed.path[-1]] - x[j], target - x[j]) < 1e-3
        for j in (one.posed.path[0], one.posed.path[-2])
    )


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def honest_variant(
    swept: Sequence[AnsweredCase], method: str, greeting: Greeting
) -> Sentence | None:
    """Return what an honest solver does otherwise than the textbook, if it explains all sweeps."""
    for fault in (one for one in FAULTS[method] if one.honest and one.key != "tolerance squared"):
        if _explains(swept, method, greeting, switches([fault])):
            return describe(method, [fault.key])
    return None


def damping_of(swept: Sequence[AnsweredCase], greeting: Greeting) -> Sentence | None:
    """Return by how much a CCD scales or caps its rotations, if that explains all sweeps."""
    for switched in (Switches(), switches([by_key("ccd")["root to tip"]])):
        gain, most = _damping(swept, switched)
        scaled, capped = switched._replace(gain=gain), switched._replace(most=most)
        if SMALLEST < gain < 0.999 and _explains(swept, "ccd", greeting, scaled):
            return sentence(
                "It is CCD with each rotation scaled by {gain:.4g}, which is slower.", gain=gain
            )
        if most > SMALLEST and _explains(swept, "ccd", greeting, capped):
            return sentence(
                "It is CCD with each rotation capped at {angle:.4g} rad, which is slower.",
                angle=most,
            )
    return None


def _damping(swept: Sequence[AnsweredCase], switched: Switches) -> tuple[float, float]:
    """Return by what share the first joint of a sweep was rotated, and the largest angle."""
    gain, most = 1.0, 0.0
    for one in swept:
        if one.posed.local is None or one.case.facts["sweeps"] != 1:
            continue
        start = one.case.inputs["local_rotations"]
        local, _, _ = solve("ccd", one.case.inputs, switched)
        path = one.posed.path
        first = path[0] if switched.order == 1 else path[-2]
        theirs = laws.angles(one.posed.local, start)
        gain = float(theirs[first] / laws.angles(local, start)[first])
        most = max(most, float(theirs[path].max()))
    return gain, most


def _explains(
    swept: Sequence[AnsweredCase], method: str, greeting: Greeting, switched: Switches
) -> bool:
    return all(
        difference(predict_inverse(method, switched, one.case), one.posed.comparable)
        <= likeness(greeting, one.case)
        for one in swept
    )


def explained(
    comparison: SweepComparison,
    all_sweeps: Sequence[AnsweredCase],
    wrong: Sequence[AnsweredCase],
    greeting: Greeting,
) -> Diagnosis:
    """Return the faults that reproduce the sweeps."""
    if not comparison.method:
        return Diagnosis()
    if comparison.damped is not None:
        return Diagnosis(behaviour=comparison.damped)
    alike = partial(likeness, greeting)
    seen = {one.case.name: one.seen for one in all_sweeps}
    trials_seen = [seen[one.case.name] for one in wrong]
    return diagnosed(
        comparison.method, list(seen.values()), trials_seen, alike, comparison.behaviour
    )


def is_grave(method: str, diagnosis: Diagnosis) -> bool:
    """Return whether a fault that nobody makes on purpose reproduces every sweep."""
    faults = by_key(method)
    return any(
        one.share == 1.0
        and not any(faults[key].honest for name in one.faults for key in name.split(" + "))
        for one in diagnosis.explanations
    )
