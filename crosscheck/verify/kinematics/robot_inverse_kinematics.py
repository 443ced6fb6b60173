"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import Outcome, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import motion_faults, robot_models, rounding
from .report import report
from .robot_models import ANYWHERE, AT_A_LIMIT, BEYOND, FARTHEST, STEP, judgement_of, target_of
from .trajectories import Trajectory

TASK = robot_models.TASK
cases = robot_models.cases


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Judge coordinates by the laws of poses; name the faults."""
    judgements = [
        judge_case(
            exchange, partial(_findings, exchange.case, greeting),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
        )
        for exchange in exchanges
    ]  # fmt: skip
    motions = {
        exchange.case.name: trajectory_of(exchange.case, exchange.answer.values)
        for exchange in exchanges
        if isinstance(exchange.answer, Answer)
        and np.isfinite(exchange.answer.values.get("q", np.nan)).all()
    }
    return report(TASK, method, judgements, motion_faults.diagnosis_of(judgements, motions))


def trajectory_of(case: Case, outputs: Mapping[str, Any]) -> Trajectory:
    """Return an answer as a motion of one frame."""
    q = np.clip(outputs["q"], -FARTHEST, FARTHEST)[None]
    return Trajectory(case, q, bool(outputs.get("converged", False)))


def _findings(case: Case, greeting: Greeting, outputs: Mapping[str, Any]) -> list[Finding]:
    q = outputs.get("q")
    if q is None:
        return [finding("numbers, no coordinates")]
    if not np.isfinite(q).all():
        return [not_finite("numbers, of a joint", q)]
    judgement = judgement_of(case.inputs, q)
    limits = _limits(judgement, q, case, greeting)
    laws = [limits, *_target_laws(judgement, outputs, case, greeting)]
    if case.family == AT_A_LIMIT:
        laws.append(finding("limits in the solve", trajectory_of(case, outputs).is_clamped[0]))
    return laws


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
    judgement: PoseJudgement, outputs: Mapping[str, Any], case: Case, greeting: Greeting
) -> Iterator[Finding]:
    """Yield whether the target is reached; from any start another minimum may be found.

    A single iteration need not reach it.
    """
    distance, angle = judgement.distance, judgement.angle
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    bound = judgement.tolerance + rounding.positions(greeting.epsilon, joints, size)
    angle_bound = judgement.tolerance_rotation + rounding.rotations(greeting.epsilon, joints)
    if case.family not in (BEYOND, STEP):
        is_hard = case.family in (ANYWHERE, AT_A_LIMIT)
        verdict = Verdict.RIGHT_EXCEPT if is_hard else None
        yield finding("target reached", distance, bound, verdict=verdict)
        yield finding("rotation reached", angle, angle_bound, verdict=verdict)
    # The larger of both errors, in multiples of its bound.
    error = max(distance / bound, angle / angle_bound)
    if "converged" in outputs and outputs["converged"] != (error <= 1.0):
        key = "claims, success of a tool" if outputs["converged"] else "claims, failure of a tool"
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
