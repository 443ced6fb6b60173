"""Inverse kinematics: whether targets are reached by honest poses, and by which sweeps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
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

    @property
    def case(self) -> Case:
        """The case."""
        return self.asked.case

    def with_findings(self, findings: Sequence[Finding]) -> "Told":
        """Return the same with other findings."""
        return self._replace(judgement=replace(self.judgement, findings=tuple(findings)))

    def corrected(self, correct: Callable[[Finding], Finding]) -> "Told":
        """Return the same with each finding as a function returns it."""
        return self.with_findings(list(map(correct, self.judgement.findings)))


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold poses against the laws and sweeps against the textbook's; name the faults."""
    declared = method.lower() if method.lower() in KNOWN else ""
    poses = [understood(one) for one in asked]
    swept = [
        sweeps.Swept(one.case, posed)
        for one, posed in zip(asked, poses, strict=True)
        if "sweeps" in one.case.facts and posed is not None and posed.finite
    ]
    known = declared if method else sweeps.seen(swept, greeting)
    told = [_judged(one, posed, known, greeting) for one, posed in zip(asked, poses, strict=True)]
    others_hold = all(one.judgement.verdict < Verdict.WRONG for one in told)
    found = sweeps.compare(swept, known, declared, others_hold, greeting)
    told = [
        one.with_findings([*one.judgement.findings, *found.findings.get(one.case.name, ())])
        for one in told
    ]
    if found.honest:
        told = [_slower(one) for one in told]
    told = _in_other_worlds(told, "" if found.honest else found.method, greeting)
    diagnosis = _diagnosis(told, found, greeting)
    if found.honest and sweeps.is_grave(found.method, diagnosis):
        told = [one.corrected(_graver) for one in told]
    return report(TASK, method, [one.judgement for one in told], diagnosis)


def _slower(one: Told) -> Told:
    """Return a judgement in which a target that an honest, slower solver misses is forgiven."""
    gained = one.case.facts["before"] - one.case.facts["least"]

    def forgiven(finding: Finding) -> Finding:
        is_missed = finding.law in ("target reached", "nearest point")
        if not is_missed or finding.verdict is not Verdict.WRONG or finding.error >= gained:
            return finding
        return replace(finding, verdict=Verdict.RIGHT_BUT, sentence=_slow(finding.error))

    return one.corrected(forgiven)


def _slow(error: float) -> Sentence:
    return sentence("It is slow: {error:.2g} m are left after the iterations allowed.", error=error)


def _graver(finding: Finding) -> Finding:
    """Return the finding of a sweep that is known to be a fault's as a wrong one."""
    is_forgiven = finding.law == sweeps.LAW and finding.verdict is Verdict.RIGHT_BUT
    return replace(finding, verdict=Verdict.WRONG) if is_forgiven else finding


def understood(one: Asked) -> Posed | None:
    """Return an answer as the laws see it, or None if there is none."""
    if not isinstance(one.answer, Answer):
        return None
    return pose_laws.understood(one.answer.values, one.case.inputs, one.case.facts)


def _judged(one: Asked, posed: Posed | None, method: str, greeting: Greeting) -> Told:
    case = one.case

    def findings(values: Mapping[str, Any]) -> list[Finding]:
        if posed is None:
            return [laws.missing(pose_laws.NEITHER)]
        kept = pose_laws.all_of(posed, case, greeting)
        if any(finding.verdict is Verdict.BROKEN for finding in kept):
            return kept
        return kept + target_laws(posed, values, case, method, greeting)

    skeleton, inputs = Skeleton(case.inputs["parents"], case.inputs["offsets"]), case.inputs
    names = ("effector", "tolerance", "max_iterations")
    options = {name: inputs[name] for name in names}
    judgement = laws.judged(
        one, greeting, findings,
        lambda: solve_ik(skeleton, inputs["local_rotations"], inputs["target"], method or "fabrik",
                         **options),
        *(_expected(posed, case, method) if isinstance(one.answer, Answer) else ()),
    )  # fmt: skip
    return Told(one, posed, judgement)


def _expected(
    posed: Posed | None, case: Case, method: str
) -> tuple[Mapping[str, Any], float | None]:
    """Return the textbook's answer to a sweep, and how many digits agree with it."""
    if not method or "sweeps" not in case.facts:
        return {}, None
    local, x, _ = solve(method, case.inputs)
    digits = None
    if posed is not None and posed.finite:
        digits = laws.digits(_error(posed, x), case.facts["size"])
    return {"local_rotations": local, "positions": x}, digits


def _error(posed: Posed, x: Any) -> float:
    """Return how far the joints of the path are from other positions [m]."""
    return float(np.abs(posed.positions[posed.path] - x[posed.path]).max())


def target_laws(
    posed: Posed, values: Mapping[str, Any], case: Case, method: str, greeting: Greeting
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
    verdict, told = _missed(excess, case, method, greeting)
    return Finding(law, verdict, excess, tolerance, "m", told)


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


def in_time(posed: Posed, case: Case, method: str, greeting: Greeting) -> list[Finding]:
    """Return whether a solve made more sweeps than its tolerance asks for, where that shows."""
    bound = case.facts["size"] * (1e-7 if greeting.precision == "double" else 1e-3)
    _, x, made = solve(method, case.inputs)
    if _error(posed, x) <= bound:
        return [Finding(STOPS, Verdict.RIGHT, 0.0, 0.0, "", laws.HOLDS)]
    for count in range(made + 1, case.inputs["max_iterations"] + 1):
        inputs = {**case.inputs, "tolerance": 0.0, "max_iterations": count}
        if _error(posed, solve(method, inputs)[1]) <= bound:
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


def _in_other_worlds(told: Sequence[Told], method: str, greeting: Greeting) -> list[Told]:
    """Return the judgements, each case of another world compared with what it is like."""
    by_name = {one.case.name: one for one in told}
    compared = []
    for one in told:
        base = by_name.get(one.case.facts.get("like", ""))
        if base is not None and one.posed is not None and base.posed is not None:
            alike = _alike(one.posed, base.posed, one.case, method, greeting)
            one = one.with_findings([*one.judgement.findings, *alike])
        compared.append(one)
    return compared


def _alike(posed: Posed, base: Posed, case: Case, method: str, greeting: Greeting) -> list[Finding]:
    error = pose_laws.distance_between(posed, base, case.facts["world"])
    if not np.isfinite(error):
        return []
    size, amplification = case.facts["size"], case.facts["amplification"]
    joints = len(posed.positions)
    tolerance = 2.0 * rounding.sweep(greeting.epsilon, joints, size, amplification)
    told = sentence(
        "In another world, rotated, shifted or in other units, the same request has an answer "
        "{error:.2g} m away: something depends on the origin or on an axis.",
        error=error,
    )
    verdict = Verdict.WRONG if method else Verdict.RIGHT_BUT
    return [laws.bounded("equal worlds", error, tolerance, "m", told, verdict=verdict)]


def _diagnosis(told: Sequence[Told], found: sweeps.Comparison, greeting: Greeting) -> Diagnosis:
    """Return the faults that reproduce the answers, of the method declared or inferred."""
    posed = [one for one in told if one.posed is not None]
    all_sweeps = [one for one in posed if "sweeps" in one.case.facts]
    wrong_sweeps = [one for one in all_sweeps if _is_wrong(one) or one.case.name in found.off]
    wrong_solves = [
        one
        for one in posed
        if "sweeps" not in one.case.facts
        and one.case.family not in problems.DEGENERATE
        and (_is_wrong(one) or _is_late(one))
    ]
    if wrong_sweeps:
        seen = list(map(_seen, all_sweeps)), list(map(_seen, wrong_sweeps))
        return sweeps.explained(found, *seen, greeting)
    if wrong_solves and found.method:
        whole = list(map(_seen, wrong_solves))
        likeness = partial(sweeps.likeness, greeting)
        return diagnosed(found.method, whole, whole, likeness, found.behaviour)
    return Diagnosis(behaviour=found.behaviour)


def _is_wrong(one: Told) -> bool:
    return one.judgement.verdict >= Verdict.WRONG


def _is_late(one: Told) -> bool:
    return any(finding.law == STOPS and finding.verdict for finding in one.judgement.findings)


def _seen(one: Told) -> Asked:
    """Return the answer as variants predict it."""
    assert one.posed is not None
    return sweeps.Swept(one.case, one.posed).asked
