"""Inverse kinematics: whether targets are reached by honest poses, and by which sweeps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import distinct_texts
from plumbob.reference.inverse_kinematics import solve_ik
from plumbob.reference.skeleton import Skeleton

from ..case import Case
from ..contestant import Answer, Asked
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws, pose_laws, problems, rounding, sweeps
from .pose_laws import Posed
from .predictions import solve
from .report import diagnosed, report

TASK = "inverse_kinematics"
cases = problems.cases
STOPS = "sweeps made"
# Methods of the textbook whose sweeps are known.
KNOWN = ("ccd", "fabrik")
# Beyond reach the textbook's solvers come nearer with every sweep for long: an honest one may be so
# many times as far from the nearest point as they are.
AS_SLOW = 1.5


class Told(NamedTuple):
    """A case, its answer as the laws see it, and what they found."""

    asked: Asked
    posed: Posed | None
    judgement: CaseJudgement


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold poses against the laws and sweeps against the textbook's; name the faults."""
    declared = method.lower() if method.lower() in KNOWN else ""
    poses = [understood(one) for one in asked]
    swept = [
        sweeps.Swept(one.case, posed)
        for one, posed in zip(asked, poses, strict=True)
        if "sweeps" in one.case.facts and posed is not None and posed.finite
    ]
    known = declared
    if not method and not declared:
        known = sweeps.seen(swept, greeting)
    told = [_judged(one, posed, known, greeting) for one, posed in zip(asked, poses, strict=True)]
    found = sweeps.compare(swept, known, declared, _others_hold(told), greeting)
    told = [_extended(one, found.findings.get(one.asked.case.name, ())) for one in told]
    if found.honest:
        told = [_slower(one) for one in told]
    judgements = _in_other_worlds(told, "" if found.honest else found.method, greeting)
    diagnosis = _diagnosis(told, judgements, found, greeting)
    if found.honest and sweeps.is_grave(found.method, diagnosis):
        judgements = [_graver(one) for one in judgements]
    return report(TASK, method, asked, judgements, diagnosis, greeting)


def _slower(one: Told) -> Told:
    """Return a judgement in which a target that an honest, slower solver misses is forgiven."""
    case, known = one.asked.case, one.judgement
    gained = case.facts["before"] - case.facts["least"]
    findings = [
        replace(
            finding,
            verdict=Verdict.RIGHT_BUT,
            sentence=sentence(
                "It is slow: {error:.2g} m are left after the iterations allowed.",
                error=finding.error,
            ),
        )
        if finding.law in ("target reached", "nearest point")
        and finding.verdict is Verdict.WRONG and finding.error < gained
        else finding
        for finding in known.findings
    ]  # fmt: skip
    return one._replace(judgement=replace(known, findings=tuple(findings)))


def _graver(one: CaseJudgement) -> CaseJudgement:
    """Return a judgement in which a sweep known to be a fault's is wrong."""
    findings = [
        replace(finding, verdict=Verdict.WRONG)
        if finding.law == sweeps.LAW and finding.verdict is Verdict.RIGHT_BUT
        else finding
        for finding in one.findings
    ]
    return replace(one, findings=tuple(findings))


def understood(one: Asked) -> Posed | None:
    """Return an answer as the laws see it, or None if there is none."""
    if not isinstance(one.answer, Answer):
        return None
    if not {"local_rotations", "positions"} & one.answer.values.keys():
        return None
    return pose_laws.understood(one.answer.values, one.case.inputs, one.case.facts)


def _judged(one: Asked, posed: Posed | None, method: str, greeting: Greeting) -> Told:
    case, answer = one.case, one.answer
    skeleton = Skeleton(case.inputs["parents"], case.inputs["offsets"])
    _, seconds = timed(lambda: _reference(skeleton, case.inputs, method or "fabrik"))
    if not isinstance(answer, Answer):
        return Told(one, None, CaseJudgement(case, answer, (), {}, None, seconds))
    findings = laws.Findings(greeting)
    if posed is None:
        told = sentence("The answer has neither rotations nor positions.")
        findings.add(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    else:
        findings.extend(pose_laws.all_of(posed, case, greeting))
        if not findings.broken:
            findings.extend(target_laws(posed, answer.values, case, method, greeting))
    findings.extend(laws.repeated(one, case.facts["size"], greeting))
    findings.extend(laws.remarks(answer))
    expected, digits = _expected(posed, case, method)
    return Told(one, posed, CaseJudgement(case, answer, findings.all, expected, digits, seconds))


def _expected(
    posed: Posed | None, case: Case, method: str
) -> tuple[Mapping[str, Any], float | None]:
    """Return the textbook's answer to a sweep, and how many digits agree with it."""
    if not method or "sweeps" not in case.facts:
        return {}, None
    local, x, _ = solve(method, case.inputs)
    path, digits = case.facts["path"], None
    if posed is not None and posed.finite:
        error = float(np.abs(posed.positions[path] - x[path]).max())
        digits = laws.digits(error, case.facts["size"])
    return {"local_rotations": local, "positions": x}, digits


def _reference(skeleton: Skeleton, inputs: Mapping[str, Any], method: str) -> Any:
    return solve_ik(
        skeleton,
        inputs["local_rotations"],
        inputs["target"],
        method,
        effector=inputs["effector"],
        tolerance=inputs["tolerance"],
        max_iterations=inputs["max_iterations"],
    )


def target_laws(
    posed: Posed, values: Mapping[str, Any], case: Case, method: str, greeting: Greeting
) -> list[Finding]:
    """Return whether the target is reached, or the nearest point, and whether claims are true."""
    distance = posed.distance(case)
    slack = rounding.positions(greeting.epsilon, len(posed.start), case.facts["size"], posed.drift)
    found = []
    if "sweeps" not in case.facts:
        found.append(reached(distance, slack, case, method, greeting))
        if method and case.inputs["tolerance"] == problems.LOOSE:
            found += in_time(posed, case, method, greeting)
    elif method:
        found.append(not_farther(distance, slack, case))
    return found + claims(distance, slack, values, case)


def reached(distance: float, slack: float, case: Case, method: str, greeting: Greeting) -> Finding:
    """Return how the effector's distance stands to the least one, the tolerance allowed."""
    least, reach, before = case.facts["least"], case.facts["reach"], case.facts["before"]
    tolerance = case.inputs["tolerance"] + slack
    excess = distance - least
    if method and least > 0.0:
        tolerance += AS_SLOW * max(0.0, _textbook_distance(method, case) - least)
    law = "target reached" if least == 0.0 else "nearest point"
    if excess <= tolerance:
        return laws.bounded(law, excess, tolerance, "m", laws.HOLDS)
    verdict, told = _missed(excess, least, reach, before, case, method, greeting)
    return Finding(law, verdict, excess, tolerance, "m", told)


def _textbook_distance(method: str, case: Case) -> float:
    _, x, _ = solve(method, case.inputs)
    return float(np.linalg.norm(x[case.inputs["effector"]] - case.inputs["target"]))


def _missed(
    excess: float,
    least: float,
    reach: float,
    before: float,
    case: Case,
    method: str,
    greeting: Greeting,
) -> tuple[Verdict, Sentence]:
    """Return what follows from a target that is missed by an excess [m]."""
    if case.family in problems.DEGENERATE and excess + least <= before + 1e-6 * reach:
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
    slow = excess < 0.5 * (before - least)
    if least > 0.0 and slow:
        return Verdict.RIGHT_BUT, sentence(
            "The target cannot be reached; it comes within {error:.2g} m of the nearest point.",
            error=excess,
        )
    if slow and (not method or case.family in problems.DEGENERATE):
        return Verdict.RIGHT_BUT, sentence(
            "It is slow: {error:.2g} m are left after the iterations allowed.", error=excess
        )
    if least > 0.0:
        return Verdict.WRONG, sentence(
            "It stays {error:.2g} m farther from its target than it could be.", error=excess
        )
    return Verdict.WRONG, sentence(
        "It stays {error:.2g} m off a target that it can reach.", error=excess
    )


def in_time(posed: Posed, case: Case, method: str, greeting: Greeting) -> list[Finding]:
    """Return whether a solve made more sweeps than its tolerance asks for, where that shows."""
    path, size = case.facts["path"], case.facts["size"]
    bound = size * (1e-7 if greeting.precision == "double" else 1e-3)
    _, x, made = solve(method, case.inputs)
    if np.abs(posed.positions[path] - x[path]).max() <= bound:
        return [Finding(STOPS, Verdict.RIGHT, 0.0, 0.0, "", laws.HOLDS)]
    for count in range(made + 1, case.inputs["max_iterations"] + 1):
        inputs = {**case.inputs, "tolerance": 0.0, "max_iterations": count}
        _, x, _ = solve(method, inputs)
        if np.abs(posed.positions[path] - x[path]).max() <= bound:
            told = sentence(
                "It makes {more} sweeps more than its tolerance asks for.", more=count - made
            )
            return [Finding(STOPS, Verdict.RIGHT_BUT, count - made, 0.0, "", told)]
    return []


def not_farther(distance: float, slack: float, case: Case) -> Finding:
    """Return whether sweeps have not taken the effector farther away, which none ever does."""
    growth = distance - case.facts["before"]
    told = sentence(
        "A sweep takes the effector {error:.2g} m farther from its target. Every rotation of CCD "
        "and every pass of FABRIK brings it nearer, or leaves it.",
        error=growth,
    )
    return laws.bounded("distance does not grow", growth, slack, "m", told)


def claims(distance: float, slack: float, values: Mapping[str, Any], case: Case) -> list[Finding]:
    """Return whether what the solver says of its answer is true."""
    found = []
    tolerance = case.inputs["tolerance"] + slack
    if values.get("converged"):
        told = sentence(
            "It claims to have arrived, but the effector is {error:.2g} m off.", error=distance
        )
        found.append(laws.bounded("claims", distance, tolerance, "m", told))
    elif "converged" in values and distance <= case.inputs["tolerance"] - slack:
        told = sentence("It has arrived, {error:.2g} m off, and denies it.", error=distance)
        found.append(Finding("claims", Verdict.RIGHT_BUT, distance, tolerance, "m", told))
    if "residual" in values and np.isfinite(values["residual"]):
        error = abs(values["residual"] - distance)
        claimed, actual = distinct_texts(values["residual"], distance, 3)
        told = sentence(
            "It reports a residual of {claimed} m; the effector is {distance} m off.",
            claimed=claimed,
            distance=actual,
        )
        found.append(laws.bounded("claims", error, slack + 1e-3 * distance, "m", told))
    return found


def _others_hold(told: Sequence[Told]) -> bool:
    """Return whether all laws but those of sweeps hold."""
    return all(one.judgement.verdict < Verdict.WRONG for one in told)


def _extended(one: Told, findings: Sequence[Finding]) -> Told:
    if not findings:
        return one
    known = one.judgement
    more = replace(known, findings=(*known.findings, *findings))
    return one._replace(judgement=more)


def _in_other_worlds(told: Sequence[Told], method: str, greeting: Greeting) -> list[CaseJudgement]:
    """Return the judgements, each case of another world compared with what it is like."""
    by_name = {one.asked.case.name: one for one in told}
    found = []
    for one in told:
        case = one.asked.case
        base = by_name.get(case.facts.get("like", ""))
        if base is not None and one.posed is not None and base.posed is not None:
            one = _extended(one, _alike(one, base, method, greeting))
        found.append(one.judgement)
    return found


def _alike(one: Told, base: Told, method: str, greeting: Greeting) -> list[Finding]:
    case = one.asked.case
    assert one.posed is not None
    assert base.posed is not None
    error = pose_laws.apart_in_worlds(one.posed, base.posed, case.facts["world"])
    if not np.isfinite(error):
        return []
    tolerance = 2.0 * rounding.sweep(
        greeting.epsilon,
        len(one.posed.start),
        case.facts["size"],
        case.facts["amplification"],
    )
    told = sentence(
        "In another world, rotated, shifted or in other units, the same request has an answer "
        "{error:.2g} m away: something depends on the origin or on an axis.",
        error=error,
    )
    verdict = Verdict.WRONG if method else Verdict.RIGHT_BUT
    return [laws.bounded("equal worlds", error, tolerance, "m", told, verdict=verdict)]


def _diagnosis(
    told: Sequence[Told],
    judgements: Sequence[CaseJudgement],
    found: sweeps.Comparison,
    greeting: Greeting,
) -> Diagnosis:
    """Return the faults that reproduce the answers, of the method declared or inferred."""
    pairs = list(zip(told, judgements, strict=True))
    all_sweeps = [_seen(one) for one in told if one.posed is not None and _is_sweep(one)]
    off = [
        _seen(one)
        for one, judgement in pairs
        if _is_sweep(one) and one.posed is not None
        and (judgement.verdict >= Verdict.WRONG or one.asked.case.name in found.off)
    ]  # fmt: skip
    whole = [
        _seen(one)
        for one, judgement in pairs
        if (judgement.verdict >= Verdict.WRONG or _is_late(judgement))
        and one.posed is not None and not _is_sweep(one)
        and one.asked.case.family not in problems.DEGENERATE
    ]  # fmt: skip
    if off:
        return sweeps.explained(found, all_sweeps, off, greeting)
    if whole and found.method:
        return diagnosed(
            found.method, whole, whole, lambda case: sweeps.likeness(case, greeting),
            found.behaviour,
        )  # fmt: skip
    return Diagnosis(behaviour=found.behaviour)


def _is_late(one: CaseJudgement) -> bool:
    return any(finding.law == STOPS and finding.verdict for finding in one.findings)


def _is_sweep(one: Told) -> bool:
    return "sweeps" in one.asked.case.facts


def _seen(one: Told) -> Asked:
    """Return the answer as variants predict it."""
    assert one.posed is not None
    assert isinstance(one.asked.answer, Answer)
    seen = replace(one.asked.answer, values=one.posed.comparable)
    return Asked(one.asked.case, seen, seen)
