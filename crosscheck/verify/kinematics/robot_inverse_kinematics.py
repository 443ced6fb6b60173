"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import either
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from . import laws, robot_models, rounding
from .report import report
from .robot_models import ANYWHERE, BEYOND, IDENTITY, judgement_of

TASK = robot_models.TASK
cases = robot_models.cases
# Answers of a faulty solver may stop so many times as far off as its tolerance: it has its own.
LENIENT = 10.0
# Readings that explain whole poses are believed though the position explains so many times more.
CHANCE = 4
POSITION_ONLY = "position only"
Request = Mapping[str, Any]


class Fault(NamedTuple):
    """A wrong reading of a request."""

    sentence: Sentence  # what is wrong, and what it should be
    misread: Callable[[Request], Request] = lambda request: {}  # the inputs understood otherwise
    scale: float = 1.0  # of hinges' coordinates, in radians
    relative: bool = False  # whether coordinates count from the start

    def read(self, request: Request) -> Request:
        """Return the request as the solver understands it."""
        return {**request, **self.misread(request)}

    def meant(self, request: Request, q: FloatArray) -> FloatArray:
        """Return the coordinates that the solver means by its answer q."""
        scaled = np.where(request["slides"], q, self.scale * q)
        return request["start"] + scaled if self.relative else scaled

    def answered(self, request: Request, q: FloatArray) -> FloatArray:
        """Return the solver's answer for coordinates q."""
        scaled = np.where(request["slides"], q, q / self.scale)
        return scaled - request["start"] if self.relative else scaled


FAULTS: Mapping[str, Fault] = {
    "degrees": Fault(
        sentence("Your coordinates are in degrees. Answer in radians: multiply by pi / 180."),
        scale=np.pi / 180.0,
    ),
    "rotation sense": Fault(
        sentence("Your hinges rotate in the wrong sense. A hinge rotates by q about its axis, "
                 "counterclockwise as seen from the axis' tip."),
        scale=-1.0,
    ),
    "relative": Fault(
        sentence("Your coordinates count from the start. Answer start + change."), relative=True
    ),
    "tool ignored": Fault(
        sentence("Your target is reached by the last joint, not by the tool, which is at "
                 "tool_position and tool_rotation in that joint's frame."),
        lambda request: {"tool_position": np.zeros(3), "tool_rotation": IDENTITY},
    ),
    "orientations ignored": Fault(
        sentence("You leave the orientations of the joints' frames aside. A joint's frame is "
                 "rotated in its parent's by orientations[j], before it moves."),
        lambda request: {"orientations": rotation.identity(len(request["parents"]))},
    ),
    "axes of the parent": Fault(
        sentence("You take axes to be in the parent's frame. They are in the joint's own, which "
                 "orientations[j] has rotated."),
        lambda request: {"axes": rotation.rotate(rotation.conjugate(request["orientations"]),
                                                 request["axes"])},
    ),
    "scalar last": Fault(
        sentence("You read the target's quaternion as x, y, z, w. It is w, x, y, z."),
        lambda request: {"target_rotation": np.roll(request["target_rotation"], 1)},
    ),
    POSITION_ONLY: Fault(
        sentence("You bring the tool to its position and leave its rotation aside."),
        lambda request: {"target_rotation": None},
    ),
}  # fmt: skip


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold coordinates against the laws of poses; name the faults."""
    judgements = [
        laws.judged(one, greeting, partial(_findings, one.case, greeting)) for one in asked
    ]
    return report(TASK, method, judgements, _diagnosis(judgements))


def _findings(case: Case, greeting: Greeting, values: Mapping[str, Any]) -> list[Finding]:
    q = values.get("q")
    if q is None:
        return [laws.missing(sentence("The answer has no coordinates q."))]
    if not np.isfinite(q).all():
        return [laws.no_numbers("numbers", q, 0.0)]
    judgement = judgement_of(case.inputs, q)
    limits = _limits(judgement, q, case, greeting)
    return [limits, *_target_laws(judgement, values, case, greeting)]


def _limits(judgement: PoseJudgement, q: FloatArray, case: Case, greeting: Greeting) -> Finding:
    excess = judgement.limit_excess[1:-1]  # without the base and the tool
    joint = int(np.argmax(excess))
    largest = float(np.abs([case.inputs["lower"], case.inputs["upper"]]).max())
    allowed = rounding.ROUNDINGS_A_JOINT * greeting.epsilon * largest
    message = sentence(
        "Joint {joint} is at {value:.6g}, {error:.2g} beyond its limit.", value=float(q[joint])
    )
    return laws.bounded("limits kept", excess[joint], allowed, "rad", message, where=joint)


def _target_laws(
    judgement: PoseJudgement, values: Mapping[str, Any], case: Case, greeting: Greeting
) -> list[Finding]:
    distance, angle = judgement.distance, judgement.angle
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    near = judgement.tolerance + rounding.positions(greeting.epsilon, joints, size)
    straight = judgement.tolerance_rotation + rounding.rotations(greeting.epsilon, joints)
    findings = []
    if case.family != BEYOND:
        findings = _reached(distance, angle, near, straight, case.family)
    return findings + _claims(distance, angle, near, straight, values)


def _reached(
    distance: float, angle: float, near: float, straight: float, family: str
) -> list[Finding]:
    """Return whether the target is reached; from any start a solver may end in another minimum."""
    verdict = Verdict.RIGHT_BUT if family == ANYWHERE else Verdict.WRONG
    missed = sentence("It stays {error:.2g} m off a target that it can reach.")
    rotated = sentence("Its tool is rotated by {error:.2g} rad from a target that it can reach.")
    return [
        laws.bounded("target reached", distance, near, "m", missed, verdict=verdict),
        laws.bounded("rotation reached", angle, straight, "rad", rotated, verdict=verdict),
    ]


def _claims(
    distance: float, angle: float, near: float, straight: float, values: Mapping[str, Any]
) -> list[Finding]:
    reached = distance <= near and angle <= straight
    if values.get("converged") and not reached:
        message = sentence(
            "It claims to have arrived, but the tool is {distance:.2g} m and {angle:.2g} rad off.",
            distance=distance, angle=angle,
        )  # fmt: skip
        return [Finding("claims", Verdict.WRONG, distance, near, "m", message)]
    if "converged" in values and not values["converged"] and reached:
        message = sentence("It has arrived, {error:.2g} m off, and denies it.", error=distance)
        return [Finding("claims", Verdict.RIGHT_BUT, distance, near, "m", message)]
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
    poses = {key: count for key, count in counts.items() if key != POSITION_ONLY}
    if CHANCE * max(poses.values()) >= max(counts.values()):
        counts = poses
    most = max(counts.values())
    if not most:
        return Diagnosis(variant_count=len(FAULTS))
    named = [key for key in counts if counts[key] == most]
    words = either([[FAULTS[key].sentence] for key in named[:3]])
    explanation = Explanation(tuple(named), words, most / len(missed), 0.0)
    return Diagnosis((explanation,), variant_count=len(FAULTS))


def _misses(one: CaseJudgement) -> bool:
    """Return whether an answer is wrong about a target, from a start that leads to it."""
    laws_broken = {f.law for f in one.findings if f.verdict >= Verdict.WRONG}
    return bool(laws_broken & {"target reached", "rotation reached"})


def _explains(fault: Fault, one: CaseJudgement) -> bool:
    assert isinstance(one.answer, Answer)
    request = dict(fault.read(one.case.inputs))
    request |= {name: LENIENT * request[name] for name in ("tolerance", "tolerance_rotation")}
    return judgement_of(request, fault.meant(request, one.answer.values["q"])).reached
