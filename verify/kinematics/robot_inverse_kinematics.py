"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Outcome, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf
from plumbob.reference.judging import PoseJudgement
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import robot_targets, rounding
from .report import report
from .robot_models import FARTHEST, REDUNDANT, judgement_of, target_of
from .robot_targets import ANYWHERE, AT, AT_A_LIMIT, CLOSE, UNREACHED
from .trajectories import Trajectory, is_falling_at, limit_laws, trajectories

TASK = robot_targets.TASK
# Coordinates that differ by less are the same answer [rad, m].
SAME = 1e-9
cases = robot_targets.cases


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge coordinates by the laws of poses."""
    fails_at_zero = _fails_at_zero(exchanges)
    motions = trajectories(exchanges, trajectory_of)
    judgements = [
        judge_case(
            exchange,
            partial(_findings, exchange.case, motions, greeting, fails_at_zero),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
            robot_targets.timed_solve(exchange.case.inputs),
        )
        for exchange in exchanges
    ]  # fmt: skip
    words = sentence("Its answers do not depend on start.")
    return report(TASK, method, judgements, words if _ignores_start(motions.values()) else None)


def _fails_at_zero(exchanges: Sequence[Exchange]) -> bool:
    """Return whether failure is reported where the start is at the target, and not near it."""
    claims: dict[str, list[bool]] = {}
    for exchange in exchanges:
        if isinstance(exchange.answer, Answer) and "converged" in exchange.answer.values:
            is_claimed = bool(exchange.answer.values["converged"])
            claims.setdefault(exchange.case.family, []).append(is_claimed)
    return not all(claims.get(AT, [True])) and all(claims.get(CLOSE, [False]))


def _ignores_start(motions: Iterable[Trajectory]) -> bool:
    """Return whether robots with joints to spare have the same answer from different starts."""
    answers: dict[bytes, list[FloatArray]] = {}
    for motion in motions:
        inputs = motion.inputs
        is_redundant = len(inputs["start"]) >= REDUNDANT and inputs["effector"] >= REDUNDANT - 1
        if is_redundant and motion.case.family in (AT, CLOSE, ANYWHERE):
            answers.setdefault(inputs["target_position"].tobytes(), []).append(motion.q[0])
    groups = [q for q in answers.values() if len(q) > 1]
    return bool(groups) and all(np.ptp(q, axis=0).max() <= SAME for q in groups)


def trajectory_of(case: Case, outputs: Mapping[str, Any]) -> Trajectory:
    """Return an answer as a motion of one frame."""
    q = np.clip(outputs["q"], -FARTHEST, FARTHEST)[None]
    is_claimed = outputs.get("converged")
    return Trajectory(case, q, None if is_claimed is None else bool(is_claimed))


def _findings(
    case: Case,
    motions: Mapping[str, Trajectory],
    greeting: Greeting,
    fails_at_zero: bool,
    outputs: Mapping[str, Any],
) -> list[Finding]:
    q = outputs.get("q")
    if q is None:
        return [finding("numbers, no coordinates")]
    if case.name not in motions:
        return [not_finite("numbers, of a joint", q)]
    judgement = judgement_of(case.inputs, q)
    limits = _limits(judgement, q, case, greeting)
    stays = any(law.verdict for motion in motions.values()
                for law in limit_laws(motion, motions.values()))  # fmt: skip
    laws = [limits, *_target_laws(judgement, outputs, case, greeting, fails_at_zero, stays)]
    if case.family == AT_A_LIMIT:
        laws.append(finding("limits in the solve", motions[case.name].is_clamped[0]))
    return [*laws, *limit_laws(motions[case.name], motions.values())]


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


def _target_laws(
    judgement: PoseJudgement, outputs: Mapping[str, Any], case: Case, greeting: Greeting,
    fails_at_zero: bool, stays: bool,
) -> Iterator[Finding]:  # fmt: skip
    """Yield whether the target is reached; from any start another minimum may be found.

    A single iteration need not reach it, nor a solver of which joints stay at limits.
    """
    distance, angle = judgement.distance, judgement.angle
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    bound = judgement.tolerance + rounding.positions(greeting.epsilon, joints, size)
    angle_bound = judgement.tolerance_rotation + rounding.rotations(greeting.epsilon, joints)
    # The larger of both errors, in multiples of its bound.
    error = max(distance / bound, angle / angle_bound)
    if case.family not in UNREACHED:
        is_hard = case.family in (ANYWHERE, AT_A_LIMIT)
        verdict = Verdict.RIGHT_EXCEPT if is_hard else None
        is_falling = (
            is_hard and error > 1.0 and not stays and is_falling_at(trajectory_of(case, outputs))
        )
        key = "target reached, still falling" if is_falling else "target reached"
        yield finding(key, distance, bound, verdict=verdict)
        yield finding("rotation reached", angle, angle_bound, verdict=verdict)
    if "converged" in outputs and outputs["converged"] != (error <= 1.0):
        key = "claims, success of a tool" if outputs["converged"] else "claims, failure of a tool"
        if outputs["converged"] and distance <= bound:
            key = "claims, success of a position"
        if fails_at_zero and case.family == AT:
            key = "claims, failure without error"
        yield finding(key, abs(error - 1.0), distance=distance, angle=angle)


def solve_by_reference(solver: str, /, **inputs: Any) -> Mapping[str, Any]:
    """Return the result of a solver of the reference on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    links = [robot.names.index(f"link_{joint}") for joint in range(len(inputs["start"]))]
    coordinates = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[coordinates] = inputs["start"]
    target = target_of(inputs)._replace(effector="tool")
    options = {name: inputs[name] for name in ("tolerance", "tolerance_rotation", "max_iterations")}
    solution = solve_ik(robot, start, target, solver, restarts=0, **options)
    converged = bool(solution.outcome == Outcome.CONVERGED)
    return {"q": solution.coordinates[coordinates], "converged": converged}
