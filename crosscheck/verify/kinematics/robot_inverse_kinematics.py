"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..case import Case
from ..contestant import Answer, Asked
from ..explain import either
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from . import laws, robot_models, rounding
from .report import report
from .robot_models import ANYWHERE, BEYOND, Reading, apart, tool_pose

TASK = robot_models.TASK
cases = robot_models.cases
# Answers of a faulty solver may stop so many times as far off as its tolerance: it has its own.
LENIENT = 10.0
# Readings that explain whole poses are believed though the position explains so many times more.
CHANCE = 4


class Fault(NamedTuple):
    """A wrong reading of a request.

    Attributes:
        sentence: what is wrong, and what it should be.
        reading: the kinematics that it has.
        order: of the target's quaternion, None if its rotation is left aside.
    """

    sentence: Sentence
    reading: Reading = robot_models.RIGHT
    order: tuple[int, int, int, int] | None = (0, 1, 2, 3)


FAULTS: Mapping[str, Fault] = {
    "degrees": Fault(
        sentence("Your coordinates are in degrees. Answer in radians: multiply by pi / 180."),
        Reading(scale=np.pi / 180.0),
    ),
    "rotation sense": Fault(
        sentence("Your hinges rotate in the wrong sense. A hinge rotates by q about its axis, "
                 "counterclockwise as seen from the axis' tip."),
        Reading(scale=-1.0),
    ),
    "relative": Fault(
        sentence("Your coordinates count from the start. Answer start + change."),
        Reading(relative=True),
    ),
    "tool ignored": Fault(
        sentence("Your target is reached by the last joint, not by the tool, which is at "
                 "tool_position and tool_rotation in that joint's frame."),
        Reading(tool=False),
    ),
    "orientations ignored": Fault(
        sentence("You leave the orientations of the joints' frames aside. A joint's frame is "
                 "rotated in its parent's by orientations[j], before it moves."),
        Reading(orientations=False),
    ),
    "axes of the parent": Fault(
        sentence("You take axes to be in the parent's frame. They are in the joint's own, which "
                 "orientations[j] has rotated."),
        Reading(own_axes=False),
    ),
    "scalar last": Fault(
        sentence("You read the target's quaternion as x, y, z, w. It is w, x, y, z."),
        order=(3, 0, 1, 2),
    ),
    "position only": Fault(
        sentence("You bring the tool to its position and leave its rotation aside."),
        order=None,
    ),
}  # fmt: skip


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold coordinates against the laws by kinematics of their own; name the faults."""
    judgements = [_judged(one, greeting) for one in asked]
    diagnosis = _diagnosis(judgements)
    return report(TASK, method, asked, judgements, diagnosis, greeting)


def _judged(one: Asked, greeting: Greeting) -> CaseJudgement:
    case, answer = one.case, one.answer
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {})
    findings, q = laws.Findings(greeting), answer.values.get("q")
    if q is None:
        told = sentence("The answer has no coordinates q.")
        findings.add(Finding("numbers", Verdict.BROKEN, np.inf, 0.0, "", told))
    elif not np.isfinite(q).all():
        findings.add(laws.no_numbers("numbers", q, 0.0))
    else:
        findings.add(_limits(q, case, greeting))
        findings.extend(_target_laws(q, answer.values, case, greeting))
    findings.extend(laws.repeated(one, case.facts["size"], greeting))
    findings.extend(laws.remarks(answer))
    return CaseJudgement(case, answer, findings.all, {})


def _limits(q: FloatArray, case: Case, greeting: Greeting) -> Finding:
    lower, upper = case.inputs["lower"], case.inputs["upper"]
    beyond = np.maximum(lower - q, q - upper)
    joint = int(np.argmax(beyond))
    allowed = rounding.ROUNDINGS_A_JOINT * greeting.epsilon * float(np.abs([lower, upper]).max())
    told = sentence(
        "Joint {joint} is at {value:.6g}, {error:.2g} beyond its limit.",
        joint=joint, value=float(q[joint]), error=float(beyond[joint]),
    )  # fmt: skip
    error = max(float(beyond[joint]), 0.0)
    return laws.bounded("limits kept", error, allowed, "rad", told, where=joint)


def _target_laws(
    q: FloatArray, values: Mapping[str, Any], case: Case, greeting: Greeting
) -> list[Finding]:
    distance, angle = apart(tool_pose(case.inputs, q), case.inputs)
    joints, size = len(q), case.facts["size"]
    near = case.inputs["tolerance"] + rounding.positions(greeting.epsilon, joints, size)
    straight = case.inputs["tolerance_rotation"] + rounding.rotations(greeting.epsilon, joints)
    found = []
    if case.family != BEYOND:
        found = _reached(distance, angle, near, straight, case.family)
    return found + _claims(distance, angle, near, straight, values)


def _reached(
    distance: float, angle: float, near: float, straight: float, family: str
) -> list[Finding]:
    """Return whether the target is reached; from any start a solver may end in another minimum."""
    stuck = family == ANYWHERE
    verdict = Verdict.RIGHT_BUT if stuck else Verdict.WRONG
    off = (
        sentence("It stays {error:.2g} m off a target that it can reach.", error=distance),
        sentence("Its tool is rotated by {error:.2g} rad from a target that it can reach.",
                 error=angle),
    )  # fmt: skip
    return [
        laws.bounded("target reached", distance, near, "m", off[0], verdict=verdict),
        laws.bounded("rotation reached", angle, straight, "rad", off[1], verdict=verdict),
    ]


def _claims(
    distance: float, angle: float, near: float, straight: float, values: Mapping[str, Any]
) -> list[Finding]:
    reached = distance <= near and angle <= straight
    if values.get("converged") and not reached:
        told = sentence(
            "It claims to have arrived, but the tool is {distance:.2g} m and {angle:.2g} rad off.",
            distance=distance, angle=angle,
        )  # fmt: skip
        return [Finding("claims", Verdict.WRONG, distance, near, "m", told)]
    if "converged" in values and not values["converged"] and reached:
        told = sentence("It has arrived, {error:.2g} m off, and denies it.", error=distance)
        return [Finding("claims", Verdict.RIGHT_BUT, distance, near, "m", told)]
    return []


def _diagnosis(judgements: Sequence[CaseJudgement]) -> Diagnosis:
    """Return which reading of the requests explains the most answers that miss their targets.

    Where a faulty solver's own target is out of its reach its answers tell nothing; hardly one
    reaches by chance what another fault would.
    """
    missed = [one for one in judgements if _misses(one)]
    if not missed:
        return Diagnosis()
    counts = {key: sum(_explains(fault, one) for one in missed) for key, fault in FAULTS.items()}
    # Whole poses are hardly met by chance, positions are where a solver is stuck: these come last.
    poses = {key: count for key, count in counts.items() if FAULTS[key].order is not None}
    if CHANCE * max(poses.values()) >= max(counts.values()):
        counts = poses
    most = max(counts.values())
    if not most:
        return Diagnosis(tried=len(FAULTS))
    named = [key for key in counts if counts[key] == most]
    words = either([[FAULTS[key].sentence] for key in named[:3]])
    told = Explanation(tuple(named), words, most / len(missed), 0.0)
    return Diagnosis((told,), tried=len(FAULTS))


def _misses(one: CaseJudgement) -> bool:
    """Return whether an answer is wrong about a target, from a start that leads to it."""
    laws_broken = {f.law for f in one.findings if f.verdict >= Verdict.WRONG}
    return bool(laws_broken & {"target reached", "rotation reached"})


def _explains(fault: Fault, one: CaseJudgement) -> bool:
    inputs = dict(one.case.inputs)
    assert isinstance(one.answer, Answer)
    pose = tool_pose(inputs, one.answer.values["q"], fault.reading)
    if fault.order is not None:
        inputs["target_rotation"] = inputs["target_rotation"][list(fault.order)]
    distance, angle = apart(pose, inputs)
    straight = fault.order is None or angle <= LENIENT * inputs["tolerance_rotation"]
    return distance <= LENIENT * inputs["tolerance"] and straight
