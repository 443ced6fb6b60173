"""Inverse kinematics: whether poses are honest and reach their targets, and by which sweeps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.inverse_kinematics import solve_ik
from plumbob.reference.skeleton import Skeleton
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Exchange, Failure, FailureKind
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..laws import digits, finding, judge_case
from . import (
    degenerate,
    limits,
    pose_laws,
    problems,
    rounding,
    sweeps,
)
from .pose_laws import AnsweredPose
from .predictions import solve
from .report import report
from .sweeps import PoseTrial, SweepComparison

TASK = "inverse_kinematics"
STOPS, SLOW, ENDED = "sweeps made", "target reached, slow", "target reached, ended"
# The methods of the textbook.
METHODS = ("ccd", "fabrik")
# Sweeps that change the distance by a smaller share of the reach than this have stalled.
STALLED = 1e-9
# The verdict on a solver of its own method with other answers in another world. The origin is
# arbitrary; angles about fixed axes (Euler angles) and dampings with a unit are honest choices.
WORLDS = {
    "shifted": Verdict.WRONG,
    "rotated": Verdict.RIGHT_EXCEPT,
    "in other units": Verdict.RIGHT_EXCEPT,
}
# A solver of its own method with no larger share of missed targets is slow there, not wrong. CCD
# from the root is after 60 sweeps from a straight arm two thirds as far as at the start.
FEW_MISSES = 0.1
WORLDS_IN_WORDS = {
    "shifted": sentence("in a shifted world"),
    "rotated": sentence("in a rotated world"),
    "in other units": sentence("with all lengths in another unit"),
}
# Beyond reach the textbook's solvers need many sweeps: an honest solver may be so many times as far
# from the nearest point as they are.
AS_SLOW = 1.5
# What may come of a division by zero: numbers without a meaning, or an exception.
NO_NUMBER = sentence("the answer is not a number, or too large")
EXCEPTIONS = (FailureKind.RAISED, FailureKind.REFUSED)


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return the problems without limits, then those with limits."""
    arguments = greeting, method, seed, thorough
    return [*problems.cases(*arguments), *limits.cases(*arguments)]


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Judge poses by the laws, and sweeps by the textbook's and by those of honest programs."""
    limited, unlimited = split(exchanges)
    trials, comparison = judged_trials(unlimited, greeting, method)
    judgements = [trial.judgement for trial in trials]
    limited_judgements, _ = limits.judge(limited, greeting)
    behaviour = comparison.damped or comparison.behaviour
    return report(TASK, method, [*judgements, *limited_judgements], behaviour)


def split(exchanges: Sequence[Exchange]) -> tuple[list[Exchange], list[Exchange]]:
    """Return the exchanges with limits, and those without."""
    limited = [exchange for exchange in exchanges if "cones" in exchange.case.inputs]
    return limited, [exchange for exchange in exchanges if exchange not in limited]


def is_sound(judgements: Sequence[CaseJudgement]) -> bool:
    """Return whether no answer is wrong."""
    return all(judgement.verdict <= Verdict.RIGHT_EXCEPT for judgement in judgements)


def judged_trials(
    exchanges: Sequence[Exchange], greeting: Greeting, method: str
) -> tuple[list[PoseTrial], SweepComparison]:
    """Return the answers to requests without limits, judged, and how their sweeps compare."""
    declared = method.lower() if method.lower() in METHODS else ""
    trials = [PoseTrial(exchange) for exchange in exchanges]
    sweep_trials = [trial for trial in trials if trial.is_sweep and trial.pose.finite]
    textbook = declared
    if not method and not sweeps.idle(trials):
        textbook = sweeps.recognise_method(sweep_trials, greeting)
    for trial in trials:
        trial.judgement = _judge(trial, textbook, greeting)
    others_hold = not any(trial.is_wrong for trial in trials)
    comparison = sweeps.compare(sweep_trials, textbook, declared, others_hold, greeting)
    is_slow = comparison.honest or (not textbook and _reaches_most(trials))
    by_name = {trial.case.name: trial for trial in trials}
    for trial in trials:
        trial.add(comparison.findings.get(trial.case.name, ()))
        if is_slow:
            trial.correct(partial(_forgive, trial.case))
        original = by_name.get(trial.case.facts.get("like", ""))
        if original and trial.pose.finite and original.pose.finite:
            trial.add([_equal_worlds(trial, original, comparison, greeting)])
    return trials, comparison


def _reaches_most(trials: Sequence[PoseTrial]) -> bool:
    """Return whether a solver of its own method misses few reachable targets."""
    solves = [t for t in trials if not t.is_sweep and t.case.facts["least"] == 0.0]
    missed = [t for t in solves if any(map(_is_miss, t.judgement.findings))]
    return len(missed) <= FEW_MISSES * len(solves)


def _is_miss(entry: Finding) -> bool:
    return entry.verdict is Verdict.WRONG and entry.law in ("target reached", "nearest point")


def _forgive(case: Case, broken: Finding) -> Finding:
    """Return a reservation where a right but slower solver misses an approached target."""
    gained = case.facts["before"] - case.facts["least"]
    if not _is_miss(broken) or broken.error >= gained:
        return broken
    reach = case.facts["reach"]
    return finding(SLOW, broken.error, broken.tolerance, law=broken.law, reach=reach)


def _judge(trial: PoseTrial, method: str, greeting: Greeting) -> CaseJudgement:
    case, pose, inputs = trial.case, trial.pose, trial.case.inputs

    def findings(outputs: Mapping[str, Any]) -> list[Finding]:
        findings = pose_laws.all_of(pose, case, greeting)
        worst = max(findings, key=lambda finding: finding.verdict)
        if case.requirement != "must" and worst.verdict >= Verdict.WRONG:
            is_number = worst.verdict is Verdict.WRONG and not pose.is_huge(case.facts["size"])
            failure = worst.sentence if is_number else NO_NUMBER
            return [degenerate.forgiven(case, method, failure, is_law=is_number)]
        if worst.verdict is Verdict.BROKEN:
            return findings
        return findings + target_laws(pose, outputs, case, method, greeting)

    reference = partial(
        solve_ik, Skeleton(inputs["parents"], inputs["offsets"]), inputs["local_rotations"],
        inputs["target"], method or "fabrik",
        **{name: inputs[name] for name in ("effector", "tolerance", "max_iterations")},
    )  # fmt: skip
    expected, correct_digits = {}, None
    if method and trial.is_sweep and isinstance(trial.exchange.answer, Answer):
        local, x, _ = solve(method, inputs)
        expected = {"local_rotations": local, "positions": x}
        if pose.finite:
            correct_digits = digits(pose.distance_to(x), case.facts["size"])
    allowed = rounding.repeats(greeting.epsilon, case.facts["size"])
    judged = judge_case(trial.exchange, findings, allowed, reference, expected, correct_digits)
    failure = trial.exchange.answer
    if isinstance(failure, Failure) and case.requirement != "must" and failure.kind in EXCEPTIONS:
        return replace(judged, findings=(degenerate.forgiven(case, method, failure.sentence),))
    return judged


def target_laws(
    pose: AnsweredPose, outputs: Mapping[str, Any], case: Case, method: str, greeting: Greeting
) -> list[Finding]:
    """Return whether the target or the nearest point is reached, and whether claims are true."""
    distance, size = pose.distance, case.facts["size"]
    slack = rounding.positions(greeting.epsilon, len(pose.positions), size, pose.drift)
    findings = []
    if "sweeps" not in case.facts:
        findings.append(reached(distance, slack, case, method, greeting, outputs))
        is_loose = case.inputs["tolerance"] == problems.LOOSE
        if method and is_loose and greeting.fixed.tolerance != 0.0:
            findings += in_time(pose, case, method, greeting)
    elif method:
        findings.append(not_farther(distance, slack, case))
    return [*findings, *pose_laws.claims(distance, slack, outputs, case)]


def reached(
    distance: float,
    slack: float,
    case: Case,
    method: str,
    greeting: Greeting,
    outputs: Mapping[str, Any],
) -> Finding:
    """Return whether the effector is as near as possible, within the tolerance."""
    nearest, inputs = case.facts["least"], case.inputs
    tolerance, excess = inputs["tolerance"] + slack, distance - nearest
    if method and (nearest > 0.0 or greeting.fixed.max_iterations is not None):
        _, x, _ = solve(method, inputs)
        closest = float(np.linalg.norm(x[inputs["effector"]] - inputs["target"]))
        tolerance += AS_SLOW * max(0.0, closest - nearest)
    law = "target reached" if nearest == 0.0 else "nearest point"
    key, limit = _miss(excess, case, method, greeting), inputs["max_iterations"]
    count = outputs.get("iterations", limit)
    key = ENDED if key == SLOW and count < limit else key
    return finding(
        key, excess, tolerance, law=law, count=count, limit=limit, reach=case.facts["reach"]
    )


def _miss(excess: float, case: Case, method: str, greeting: Greeting) -> str:
    """Return the law that an excess [m] of the distance breaks."""
    nearest, reach, before = (case.facts[name] for name in ("least", "reach", "before"))
    is_degenerate, is_beyond = case.requirement != "must", nearest > 0.0
    is_nearer = excess < 0.5 * (before - nearest)
    if excess <= rounding.STALL[greeting.precision] * reach:
        return "target reached, stalled" if method else SLOW
    if is_beyond and is_nearer:
        return "nearest point, approached"
    if is_nearer and method and is_degenerate and _stalls(excess + nearest, case, method):
        return "target reached, undetermined"
    if is_nearer and (not method or is_degenerate):
        return SLOW
    if is_degenerate and excess + nearest <= before + 1e-6 * reach:
        return "target reached, undetermined"
    return "nearest point" if is_beyond else "target reached"


def _stalls(distance: float, case: Case, method: str) -> bool:
    """Return whether the textbook's sweeps end at a distance [m] too, and as many more do."""
    inputs, limit = case.inputs, case.inputs["max_iterations"]
    distances = [
        np.linalg.norm(x[inputs["effector"]] - inputs["target"])
        for x in (solve(method, {**inputs, "max_iterations": k * limit})[1] for k in (1, 2))
    ]
    return bool(np.abs(np.subtract(distances, distance)).max() <= STALLED * case.facts["reach"])


def in_time(pose: AnsweredPose, case: Case, method: str, greeting: Greeting) -> list[Finding]:
    """Return whether a solve ends at its tolerance, if a number of sweeps explains its pose."""
    bound = case.facts["size"] * (1e-7 if greeting.precision == "double" else 1e-3)
    _, x, needed = solve(method, case.inputs)
    if pose.distance_to(x) <= bound:
        return [finding(STOPS, 0.0)]
    for count in range(needed + 1, case.inputs["max_iterations"] + 1):
        inputs = {**case.inputs, "tolerance": 0.0, "max_iterations": count}
        if pose.distance_to(solve(method, inputs)[1]) <= bound:
            return [finding(STOPS, count - needed, more=count - needed)]
    return []


def not_farther(distance: float, slack: float, case: Case) -> Finding:
    """Return whether sweeps have not taken the effector farther away, which none ever does."""
    return finding("distance does not grow", distance - case.facts["before"], slack)


def _equal_worlds(
    trial: PoseTrial, base: PoseTrial, comparison: SweepComparison, greeting: Greeting
) -> Finding:
    """Return whether an answer is the base's, transformed into another world.

    A constant number of iterations enlarges rounding: a difference is a reservation.
    """
    Q, scale, shift = trial.case.facts["world"]
    x, path = base.pose.positions.copy(), base.pose.path
    x[path] = scale * rotation.rotate(Q, x[path]) + shift
    size, amplification = trial.case.facts["size"], trial.case.facts["amplification"]
    tolerance = 2.0 * rounding.sweep(greeting.epsilon, len(x), size, amplification)
    error, verdict = trial.pose.distance_to(x), Verdict.WRONG
    how = WORLDS_IN_WORDS[trial.case.facts["how"]]
    if not comparison.method or comparison.honest:
        is_small = error <= rounding.STALL[greeting.precision] * trial.case.facts["reach"]
        verdict = Verdict.RIGHT_EXCEPT if is_small else WORLDS[trial.case.facts["how"]]
        if greeting.fixed.max_iterations is not None:
            return finding("equal worlds, constant", error, tolerance, how=how)
    return finding("equal worlds", error, tolerance, verdict=verdict, how=how)
