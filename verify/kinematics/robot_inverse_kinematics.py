"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import robot_targets, rounding
from .report import report
from .robot_models import judgement_of
from .robot_targets import ANYWHERE, AT, AT_A_LIMIT, CLOSE, UNREACHED
from .trajectories import Trajectory, is_falling_at, limit_laws, trajectories

TASK = robot_targets.TASK
cases = robot_targets.cases


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge coordinates by the laws of poses."""
    motions = trajectories(exchanges)
    pose_laws = PoseLaws(motions, greeting, _fails_at_zero(exchanges))
    judgements = [
        judge_case(
            exchange,
            partial(pose_laws.findings, exchange.case),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
            robot_targets.timed_solve(exchange.case.inputs),
        )
        for exchange in exchanges
    ]
    return report(TASK, method, judgements)


def _fails_at_zero(exchanges: Sequence[Exchange]) -> bool:
    """Return whether failure is reported where the start is at the target, and not near it."""
    claims: dict[str, list[bool]] = {}
    for exchange in exchanges:
        if isinstance(exchange.answer, Answer) and "converged" in exchange.answer.values:
            is_claimed = bool(exchange.answer.values["converged"])
            claims.setdefault(exchange.case.family, []).append(is_claimed)
    return not all(claims.get(AT, [True])) and all(claims.get(CLOSE, [False]))


class PoseLaws:
    """The laws of poses, given all answers."""

    def __init__(
        self, motions: Mapping[str, Trajectory], greeting: Greeting, fails_at_zero: bool
    ) -> None:
        self._motions, self._greeting, self._fails_at_zero = motions, greeting, fails_at_zero
        self._at_limits = {
            name: list(limit_laws(motion, motions.values())) for name, motion in motions.items()
        }
        self._stays = any(law.verdict for laws in self._at_limits.values() for law in laws)

    def findings(self, case: Case, outputs: Mapping[str, Any]) -> list[Finding]:
        """Return which laws an answer keeps."""
        q = outputs.get("q")
        if q is None:
            return [finding("numbers, no coordinates")]
        if case.name not in self._motions:
            return [not_finite("numbers, of a joint", q)]
        judgement = judgement_of(case.inputs, q)
        laws = [_limits(judgement, q, case, self._greeting)]
        laws += self._target_laws(judgement, outputs, case)
        if case.family == AT_A_LIMIT:
            laws.append(finding("limits in the solve", self._motions[case.name].is_clamped[0]))
        return [*laws, *self._at_limits[case.name]]

    def _target_laws(
        self, judgement: PoseJudgement, outputs: Mapping[str, Any], case: Case
    ) -> Iterator[Finding]:
        """Yield whether the target is reached; from any start another minimum may be found.

        A single iteration need not reach it, nor a solver of which joints stay at limits.
        """
        distance, angle = judgement.distance, judgement.angle
        joints, epsilon = len(case.inputs["parents"]), self._greeting.epsilon
        bound = judgement.tolerance + rounding.positions(epsilon, joints, case.facts["size"])
        angle_bound = judgement.tolerance_rotation + rounding.rotations(epsilon, joints)
        # The larger of both errors, in multiples of its bound.
        error = max(distance / bound, angle / angle_bound)
        if case.family not in UNREACHED:
            is_hard = case.family in (ANYWHERE, AT_A_LIMIT)
            verdict = Verdict.RIGHT_EXCEPT if is_hard else None
            may_fall = is_hard and error > 1.0 and not self._stays
            is_falling = may_fall and is_falling_at(self._motions[case.name])
            key = "target reached, still falling" if is_falling else "target reached"
            yield finding(key, distance, bound, verdict=verdict)
            yield finding("rotation reached", angle, angle_bound, verdict=verdict)
        claim = outputs.get("converged")
        if claim is None or claim == (error <= 1.0):
            return
        key = "claims, success of a tool" if claim else "claims, failure of a tool"
        if claim and distance <= bound:
            key = "claims, success of a position"
        if self._fails_at_zero and case.family == AT:
            key = "claims, failure without error"
        yield finding(key, abs(error - 1.0), distance=distance, angle=angle)


def _limits(judgement: PoseJudgement, q: FloatArray, case: Case, greeting: Greeting) -> Finding:
    excess = judgement.limit_excess[1:-1]  # without the base and the tool
    joint = int(np.argmax(excess))
    largest = float(np.abs([case.inputs["lower"], case.inputs["upper"]]).max())
    bound = rounding.ROUNDINGS_A_JOINT * greeting.epsilon * largest
    lower, upper = case.inputs["lower"][joint], case.inputs["upper"][joint]
    turns = round(float(q[joint] - 0.5 * (lower + upper)) / (2.0 * np.pi))
    angle = float(q[joint]) - turns * 2.0 * np.pi
    is_wrappable = not case.inputs["slides"][joint] and lower - bound <= angle <= upper + bound
    key = "limits kept, not wrapped" if is_wrappable else "limits kept"
    return finding(key, excess[joint], bound, index=joint, value=float(q[joint]), angle=angle)
