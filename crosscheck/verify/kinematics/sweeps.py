"""Single sweeps held against the textbook's: what method a solver has, and whether it is right.

A sweep tells apart what whole solves do not: six of the wrong CCDs that were found in real
programs still reach 999 of 1,000 targets.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ..case import Case
from ..contestant import Answer, Asked
from ..explain import difference
from ..greeting import Greeting
from ..judgement import Diagnosis, Finding, Verdict
from ..sentence import Sentence, sentence
from . import laws, pose_laws, rounding
from .faults import FAULTS, Fault, Switches, by_key, describe, switches
from .pose_laws import Posed
from .predictions import predict_inverse, solve
from .report import diagnosed
from .textbook import Damping

NAMES = {"ccd": "CCD", "fabrik": "FABRIK"}
# A textbook's sweeps are those of a solver if so many of them are.
MOST = 0.5
# A rotation smaller than this share of CCD's, or angle [rad], is no damped one: it may be rounding.
SMALLEST = 1e-3
# So many faults at once may hide which method it is.
SEEN_FAULTS = 2
LAW = "one sweep"


class Swept(NamedTuple):
    """The answer to a request of one or two sweeps."""

    case: Case
    posed: Posed

    @property
    def asked(self) -> Asked:
        """The answer as variants predict it."""
        answer = Answer(self.posed.comparable, 0.0)
        return Asked(self.case, answer, answer)


class Comparison(NamedTuple):
    """What the sweeps say.

    Attributes:
        method: "ccd", "fabrik" or "", as declared or inferred.
        declared: as declared.
        behaviour: what was inferred, in words.
        off: names of the cases whose sweeps are not the textbook's.
        findings: by the names of cases.
        honest: whether they are another honest solver's, which may be slower.
        damped: how its rotations are made smaller on purpose, if they are.
    """

    method: str
    declared: str
    behaviour: Sentence | None
    off: Sequence[str]
    findings: Mapping[str, Sequence[Finding]]
    honest: bool = False
    damped: Sentence | None = None


def likeness(case: Case, greeting: Greeting) -> float:
    """Return the relative difference that still counts as a variant's answer."""
    joints, known = len(case.inputs["parents"]), case.facts
    amplification = known.get("amplification", 10.0)
    bound = rounding.sweep(greeting.epsilon, joints, known["size"], amplification)
    return max(1e-9, 4.0 * bound / known["size"])


def compare(
    swept: Sequence[Swept], method: str, declared: str, others_hold: bool, greeting: Greeting
) -> Comparison:
    """Return the findings of the sweeps of a method that is declared, or seen."""
    if not method:
        return Comparison("", "", None, (), {})
    errors = {one.case.name: _error(one, method, greeting) for one in swept}
    off = [name for name, (error, bound) in errors.items() if not error <= bound]
    behaviour = None
    if not declared:
        behaviour = sentence(
            "Its sweeps resemble those of {method}, with which it is compared."
            if off
            else "Its sweeps are those of {method}.",
            method=NAMES[method],
        )
    verdict, told, damped = Verdict.RIGHT, laws.HOLDS, None
    if off:
        verdict, told = _verdict(swept, method, others_hold, greeting)
        if method == "ccd" and honest_variant(swept, method, greeting) is None:
            damped = damping_of(swept, greeting)
        if damped is not None:
            verdict, told = Verdict.RIGHT_BUT, damped
    findings = {
        name: [Finding(LAW, verdict if name in off else Verdict.RIGHT, error, bound, "m",
                       told if name in off else laws.HOLDS)]
        for name, (error, bound) in errors.items()
    }  # fmt: skip
    honest = verdict is Verdict.RIGHT_BUT
    return Comparison(method, declared, behaviour, off, findings, honest, damped)


def seen(swept: Sequence[Swept], greeting: Greeting) -> str:
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


def _is_another_solver(greeting: Greeting, one: Swept) -> bool:
    """Return whether a pose keeps all laws and has arrived, whatever was asked for."""
    found = pose_laws.all_of(one.posed, one.case, greeting)
    keeps = all(finding.verdict < Verdict.WRONG for finding in found)
    return keeps and _goes_on(one, greeting)


def _best_fit(swept: Sequence[Swept], method: str, greeting: Greeting) -> tuple[float, int]:
    """Return what share of the sweeps a faulty textbook reproduces, and minus its faults."""
    asked = [one.asked for one in swept]
    found = diagnosed(
        method, asked, asked, lambda case: likeness(case, greeting), most_faults=SEEN_FAULTS
    ).explanations
    if not found:
        return 0.0, 0
    return found[0].share, -len(found[0].faults[0].split(" + "))


def _error(one: Swept, method: str, greeting: Greeting) -> tuple[float, float]:
    """Return how far the path's joints are from the textbook's, and what rounding allows [m]."""
    _, x, _ = solve(method, one.case.inputs)
    path, known = one.posed.path, one.case.facts
    error = float(np.abs(one.posed.positions[path] - x[path]).max())
    joints, size = len(one.posed.start), known["size"]
    return error, rounding.sweep(greeting.epsilon, joints, size, known["amplification"])


def _verdict(
    swept: Sequence[Swept], method: str, others_hold: bool, greeting: Greeting
) -> tuple[Verdict, Sentence]:
    """Return what follows from sweeps that are not the textbook's."""
    honest = honest_variant(swept, method, greeting)
    if honest is not None:
        return Verdict.RIGHT_BUT, honest
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


def _goes_on(one: Swept, greeting: Greeting) -> bool:
    return one.posed.distance(one.case) <= rounding.STALL[greeting.precision] * max(
        one.case.facts["reach"], 1e-300
    )


def _ends_well(one: Swept) -> bool:
    """Return whether the last joint of a sweep has brought the effector onto its line."""
    x, target = one.posed.positions, one.case.inputs["target"]
    return any(
        _angle(x[one.posed.path[-1]] - x[j], target - x[j]) < 1e-3
        for j in (one.posed.path[0], one.posed.path[-2])
    )


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def honest_variant(swept: Sequence[Swept], method: str, greeting: Greeting) -> Sentence | None:
    """Return what an honest solver does otherwise than the textbook, if it explains all sweeps."""
    for fault in (one for one in FAULTS[method] if one.honest and one.key != "tolerance squared"):
        if _explains(swept, method, greeting, (fault,), Damping()):
            return describe(method, [fault.key])
    return None


def damping_of(swept: Sequence[Swept], greeting: Greeting) -> Sentence | None:
    """Return by how much a CCD scales or caps its rotations, if that explains all sweeps."""
    for faults in ((), *(((one,)) for one in FAULTS["ccd"] if one.key == "root to tip")):
        gain, most = _damping(swept, switches(faults))
        scaled, capped = Damping(gain=gain), Damping(most=most)
        if SMALLEST < gain < 0.999 and _explains(swept, "ccd", greeting, faults, scaled):
            return sentence(
                "It is CCD with each rotation scaled by {gain:.4g}, which is slower.", gain=gain
            )
        if most > SMALLEST and _explains(swept, "ccd", greeting, faults, capped):
            return sentence(
                "It is CCD with each rotation capped at {angle:.4g} rad, which is slower.",
                angle=most,
            )
    return None


def _damping(swept: Sequence[Swept], switched: Switches) -> tuple[float, float]:
    """Return by what share the first joint of a sweep was rotated, and the largest angle."""
    gain, most = 1.0, 0.0
    for one in swept:
        if one.posed.local is None or one.case.facts["sweeps"] != 1:
            continue
        start = one.case.inputs["local_rotations"]
        local, _, _ = solve("ccd", one.case.inputs, switched)
        path = one.posed.path
        first = path[0] if switched.ccd.order == 1 else path[-2]
        theirs = laws.angles(one.posed.local, start)
        ours = laws.angles(local, start)
        gain = float(theirs[first] / ours[first])
        most = max(most, float(theirs[path].max()))
    return gain, most


def _explains(
    swept: Sequence[Swept],
    method: str,
    greeting: Greeting,
    faults: Sequence[Fault],
    damping: Damping,
) -> bool:
    return all(
        difference(
            predict_inverse(method, switches(faults), one.case, damping), one.posed.comparable
        )
        <= likeness(one.case, greeting)
        for one in swept
    )


def explained(
    found: Comparison, all_sweeps: Sequence[Asked], off: Sequence[Asked], greeting: Greeting
) -> Diagnosis:
    """Return the faults that reproduce the sweeps."""
    if not found.method:
        return Diagnosis()
    if found.damped is not None:
        return Diagnosis(behaviour=found.damped)
    return diagnosed(
        found.method, all_sweeps, off, lambda case: likeness(case, greeting), found.behaviour
    )


def is_grave(method: str, diagnosis: Diagnosis) -> bool:
    """Return whether a fault that nobody makes on purpose reproduces every sweep."""
    by_keys = by_key(method)
    return any(
        one.share == 1.0
        and not any(by_keys[key].honest for name in one.faults for key in name.split(" + "))
        for one in diagnosis.explanations
    )
