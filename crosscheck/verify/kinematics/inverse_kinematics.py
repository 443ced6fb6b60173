"""Inverse kinematics: whether targets are reached by honest poses, and by which sweeps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import distinct_texts
from plumbob.reference.inverse_kinematics import solve_ik
from plumbob.reference.skeleton import Skeleton

from ..case import Case
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from . import laws, pose_laws, problems, rounding, sweeps
from .pose_laws import AnsweredPose
from .predictions import solve
from .report import diagnosed, report
from .sweeps import AnsweredCase, SweepComparison

TASK = "inverse_kinematics"
cases = problems.cases
STOPS = "sweeps made"
# Methods of the textbook whose sweeps are known.
KNOWN = ("ccd", "fabrik")
# Beyond reach the textbook's solvers come nearer with every sweep for long: an honest one may be so
# many times as far from the nearest point as they are.
AS_SLOW = 1.5


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold poses against the laws and sweeps against the textbook's; name the faults."""
    declared = method.lower() if method.lower() in KNOWN else ""
    trials = [AnsweredCase(one) for one in asked]
    swept = [trial for trial in trials if trial.is_sweep and trial.posed.finite]
    known = declared if method else sweeps.seen(swept, greeting)
    for trial in trials:
        trial.judgement = _judged(trial, known, greeting)
    others_hold = all(trial.judgement.verdict < Verdict.WRONG for trial in trials)
    comparison = sweeps.compare(swept, known, declared, others_hold, greeting)
    by_name = {trial.case.name: trial for trial in trials}
    for trial in trials:
        trial.add(comparison.findings.get(trial.case.name, ()))
        if comparison.honest:
            trial.correct(partial(_forgiven, trial.case))
        if base := by_name.get(trial.case.facts.get("like", "")):
            trial.add(_alike(trial, base, "" if comparison.honest else comparison.method, greeting))
    diagnosis = _diagnosis(trials, comparison, greeting)
    if comparison.honest and sweeps.is_grave(comparison.method, diagnosis):
        for trial in trials:
            trial.correct(_graver)
    return report(TASK, method, [trial.judgement for trial in trials], diagnosis)


def _forgiven(case: Case, finding: Finding) -> Finding:
    """Return the finding of a target that an honest, slower solver misses as a reservation."""
    gained = case.facts["before"] - case.facts["least"]
    is_missed = finding.law in ("target reached", "nearest point")
    if not is_missed or finding.verdict is not Verdict.WRONG or finding.error >= gained:
        return finding
    return replace(finding, verdict=Verdict.RIGHT_BUT, sentence=_slow(finding.error))


def _slow(error: float) -> Sentence:
    return sentence("It is slow: {error:.2g} m are left after the iterations allowed.", error=error)


def _graver(finding: Finding) -> Finding:
    """Return the finding of a sweep that is known to be a fault's as a wrong one."""
    is_forgiven = finding.law == sweeps.LAW and finding.verdict is Verdict.RIGHT_BUT
    return replace(finding, verdict=Verdict.WRONG) if is_forgiven else finding


def _judged(trial: AnsweredCase, method: str, greeting: Greeting) -> CaseJudgement:
    case, posed, inputs = trial.case, trial.posed, trial.case.inputs

    def findings(values: Mapping[str, Any]) -> list[Finding]:
        findings = pose_laws.all_of(posed, case, greeting)
        if any(finding.verdict is Verdict.BROKEN for finding in findings):
            return findings
        return findings + target_laws(posed, values, case, method, greeting)

    reference = partial(
        solve_ik, Skeleton(inputs["parents"], inputs["offsets"]), inputs["local_rotations"],
        inputs["target"], method or "fabrik",
        **{name: inputs[name] for name in ("effector", "tolerance", "max_iterations")},
    )  # fmt: skip
    expected, digits = _expected(trial, method)
    return laws.judged(trial.asked, greeting, findings, reference, expected, digits)


def _expected(trial: AnsweredCase, method: str) -> tuple[Mapping[str, Any], float | None]:
    """Return the textbook's answer to a sweep, and how many digits agree with it."""
    if not method or not trial.is_sweep or not isinstance(trial.asked.answer, Answer):
        return {}, None
    local, x, _ = solve(method, trial.case.inputs)
    digits = None
    if trial.posed.finite:
        digits = laws.digits(trial.posed.distance_to(x), trial.case.facts["size"])
    return {"local_rotations": local, "positions": x}, digits


def target_laws(
    posed: AnsweredPose, values: Mapping[str, Any], case: Case, method: str, greeting: Greeting
) -> list[Finding]:
    """Return whether the target is reached, or the nearest point, and whether claims are true."""
    distance, size = posed.distance, case.facts["size"]
    slack = rounding.positions(greeting.epsilon, len(posed.positions), size, posed.drift)
    findings = []
    if "sweeps" not in case.facts:
        findings.append(reached(distance, slack, case, method, greeting))
        if method and case.inputs["tolerance"] == problems.LOOSE:
            findings += in_time(posed, case, method, greeting)
    elif method:
        findings.append(not_farther(distance, slack, case))
    return findings + claims(distance, slack, values, case)


def reached(distance: float, slack: float, case: Case, method: str, greeting: Greeting) -> Finding:
    """Return how the effector's distance stands to the least one, the tolerance allowed."""
    least = case.facts["least"]
    tolerance = case.inputs["tolerance"] + slack
    excess = distance - least
    if method and least > 0.0:
        _, x, _ = solve(method, case.inputs)
        closest = float(np.linalg.norm(x[case.inputs["effector"]] - case.inputs["target"]))
        tolerance += AS_SLOW * max(0.0, closest - least)
    law = "target reached" if least == 0.0 else "nearest point"
    if excess <= tolerance:
        return laws.bounded(law, excess, tolerance, "m", laws.HOLDS)
    verdict, message = _missed(excess, case, method, greeting)
    return Finding(law, verdict, excess, tolerance, "m", message)


def _missed(excess: float, case: Case, method: str, greeting: Greeting) -> tuple[Verdict, Sentence]:
    """Return what follows from a target that is missed by an excess [m]."""
    least, reach, before = (case.facts[name] for name in ("least", "reach", "before"))
    is_degenerate, is_beyond = case.family in problems.DEGENERATE, least > 0.0
    is_nearer = excess < 0.5 * (before - least)
    if is_degenerate and excess + least <= before + 1e-6 * reach:
        return Verdict.RIGHT_BUT, sentence(
            "It is stuck {error:.2g} m off: nothing here says which direction to bend in. Bend "
            "the chain a little before the first sweep.",
            error=excess,
        )
    if excess <= rounding.STALL[greeting.precision] * reach:
        return Verdict.RIGHT_BUT, sentence(
            "It stalls {error:.2g} m off: small rotations are lost. Does the helper that rotates "
            "one direction into another return the identity for small angles?",
            error=excess,
        )
    if is_beyond and is_nearer:
        return Verdict.RIGHT_BUT, sentence(
            "The target cannot be reached; it comes within {error:.2g} m of the nearest point.",
            error=excess,
        )
    if is_nearer and (not method or is_degenerate):
        return Verdict.RIGHT_BUT, _slow(excess)
    return Verdict.WRONG, sentence(
        "It stays {error:.2g} m farther from its target than it could be."
        if is_beyond
        else "It stays {error:.2g} m off a target that it can reach.",
        error=excess,
    )


def in_time(posed: AnsweredPose, case: Case, method: str, greeting: Greeting) -> list[Finding]:
    """Return whether a solve made more sweeps than its tolerance asks for, where that shows."""
    bound = case.facts["size"] * (1e-7 if greeting.precision == "double" else 1e-3)
    _, x, sweeps_made = solve(method, case.inputs)
    if posed.distance_to(x) <= bound:
        return [Finding(STOPS, Verdict.RIGHT, 0.0, 0.0, "", laws.HOLDS)]
    for count in range(sweeps_made + 1, case.inputs["max_iterations"] + 1):
        inputs = {**case.inputs, "tolerance": 0.0, "max_iterations": count}
        if posed.distance_to(solve(method, inputs)[1]) <= bound:
            message = sentence(
                "It makes {more} sweeps more than its tolerance asks for.", more=count - sweeps_made
            )
            return [Finding(STOPS, Verdict.RIGHT_BUT, count - sweeps_made, 0.0, "", message)]
    return []


def not_farther(distance: float, slack: float, case: Case) -> Finding:
    """Return whether sweeps have not taken the effector farther away, which none ever does."""
    growth = distance - case.facts["before"]
    message = sentence(
        "A sweep takes the effector {error:.2g} m farther from its target. Every rotation of CCD "
        "and every pass of FABRIK brings it nearer, or leaves it."
    )
    return laws.bounded("distance does not grow", growth, slack, "m", message)


def claims(distance: float, slack: float, values: Mapping[str, Any], case: Case) -> list[Finding]:
    """Return whether what the solver says of its answer is true."""
    findings = []
    tolerance = case.inputs["tolerance"] + slack
    if values.get("converged"):
        message = sentence("It claims to have arrived, but the effector is {error:.2g} m off.")
        findings.append(laws.bounded("claims", distance, tolerance, "m", message))
    elif "converged" in values and distance <= case.inputs["tolerance"] - slack:
        message = sentence("It has arrived, {error:.2g} m off, and denies it.", error=distance)
        findings.append(Finding("claims", Verdict.RIGHT_BUT, distance, tolerance, "m", message))
    if "residual" in values and np.isfinite(values["residual"]):
        error = abs(values["residual"] - distance)
        claimed, actual = distinct_texts(values["residual"], distance, 3)
        message = sentence(
            "It reports a residual of {claimed} m; the effector is {distance} m off.",
            claimed=claimed,
            distance=actual,
        )
        findings.append(laws.bounded("claims", error, slack + 1e-3 * distance, "m", message))
    return findings


def _alike(
    trial: AnsweredCase, base: AnsweredCase, method: str, greeting: Greeting
) -> list[Finding]:
    """Return whether an answer in another world is the one that it is like, brought there."""
    if not (trial.posed.finite and base.posed.finite):
        return []
    Q, scale, shift = trial.case.facts["world"]
    moved, path = base.posed.positions.copy(), base.posed.path
    moved[path] = scale * rotation.rotate(Q, moved[path]) + shift
    error = trial.posed.distance_to(moved)
    size, amplification = trial.case.facts["size"], trial.case.facts["amplification"]
    tolerance = 2.0 * rounding.sweep(greeting.epsilon, len(moved), size, amplification)
    message = sentence(
        "In another world, rotated, shifted or in other units, the same request has an answer "
        "{error:.2g} m away: something depends on the origin or on an axis."
    )
    verdict = Verdict.WRONG if method else Verdict.RIGHT_BUT
    return [laws.bounded("equal worlds", error, tolerance, "m", message, verdict=verdict)]


def _diagnosis(
    trials: Sequence[AnsweredCase], comparison: SweepComparison, greeting: Greeting
) -> Diagnosis:
    """Return the faults that reproduce the answers, of the method declared or inferred."""
    posed = [one for one in trials if one.posed.comparable]
    all_sweeps = [one for one in posed if one.is_sweep]
    wrong_sweeps = [one for one in all_sweeps if one.is_wrong or one.case.name in comparison.wrong]
    solves = [
        one.seen
        for one in posed
        if not one.is_sweep
        and one.case.family not in problems.DEGENERATE
        and (one.is_wrong or _is_late(one))
    ]
    if wrong_sweeps:
        return sweeps.explained(comparison, all_sweeps, wrong_sweeps, greeting)
    if solves and comparison.method:
        likeness = partial(sweeps.likeness, greeting)
        return diagnosed(comparison.method, solves, solves, likeness, comparison.behaviour)
    return Diagnosis(behaviour=comparison.behaviour)


def _is_late(one: AnsweredCase) -> bool:
    return any(finding.law == STOPS and finding.verdict for finding in one.judgement.findings)
