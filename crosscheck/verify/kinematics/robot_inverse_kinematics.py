"""Robots with limits: whether tools reach their targets, limits are kept and claims are true."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import Outcome, rotation, solve_ik
from plumbob.reference.arguments import FloatArray
from plumbob.reference.formats import urdf
from plumbob.reference.judging import PoseJudgement

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import either
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from ..sentence import Sentence, with_code
from . import robot_models, rounding
from .faults import TABLE
from .report import report
from .robot_models import ANYWHERE, BEYOND, IDENTITY, judgement_of, mechanism, target_of

TASK = robot_models.TASK
cases = robot_models.cases
# Answers of a faulty solver may stop so many times as far off as its tolerance: it has its own.
LENIENT = 10.0
# Misreadings that explain whole poses are preferred to `POSITION_ONLY` though the latter explains
# up to so many times as many answers.
CHANCE = 4
POSITION_ONLY = "position only"
Inputs = Mapping[str, Any]


class Misreading(NamedTuple):
    """A wrong interpretation of a request."""

    sentence: Sentence  # the mistake, and its correction
    misread: Callable[[Inputs], Inputs] = dict  # returns the inputs with another meaning
    scale: float = 1.0  # of the coordinates of hinges, in radians
    relative: bool = False  # whether coordinates count from the start
    reversed: bool = False  # whether the last joint comes first

    def read(self, inputs: Inputs) -> Inputs:
        """Return the inputs as the solver understands them."""
        return {**inputs, **self.misread(inputs)}

    def coordinates(self, inputs: Inputs, q: FloatArray) -> FloatArray:
        """Return the coordinates that an answer q stands for."""
        q = q[..., ::-1] if self.reversed else q
        scaled = np.where(inputs["slides"], q, self.scale * q)
        return inputs["start"] + scaled if self.relative else scaled

    def answer(self, inputs: Inputs, q: FloatArray) -> FloatArray:
        """Return the answer that stands for coordinates q."""
        scaled = np.where(inputs["slides"], q, q / self.scale)
        answer = scaled - inputs["start"] if self.relative else scaled
        return answer[::-1] if self.reversed else answer


# The inputs that a fault reads otherwise.
MISREAD: Mapping[str, Callable[[Inputs], Inputs]] = {
    "tool ignored": lambda inputs: {"tool_position": np.zeros(3), "tool_rotation": IDENTITY},
    "orientations ignored": lambda inputs: {
        "orientations": rotation.identity(len(inputs["parents"]))
    },
    "axes of the parent": lambda inputs: {
        "axes": rotation.rotate(rotation.conjugate(inputs["orientations"]), inputs["axes"])
    },
    "scalar last": lambda inputs: {
        "target_rotation": np.roll(inputs["target_rotation"], 1, axis=-1)
    },
    POSITION_ONLY: lambda inputs: {"target_rotation": None},
}
FAULTS = {
    key: Misreading(
        with_code(entry["code"], Sentence(entry["sentence"], {})), MISREAD.get(key, dict),
        entry.get("scale", 1.0), entry.get("relative", False), entry.get("reversed", False),
    )
    for key, entry in TABLE["robots"].items()
}  # fmt: skip


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Judge coordinates by the laws of poses; name the faults."""
    judgements = [
        judge_case(
            exchange, partial(_findings, exchange.case, greeting),
            rounding.repeats(greeting.epsilon, exchange.case.facts["size"]),
        )
        for exchange in exchanges
    ]  # fmt: skip
    return report(TASK, method, judgements, _diagnosis(judgements))


def _findings(case: Case, greeting: Greeting, outputs: Mapping[str, Any]) -> list[Finding]:
    q = outputs.get("q")
    if q is None:
        return [finding("numbers, no coordinates")]
    if not np.isfinite(q).all():
        return [not_finite("numbers, of a joint", q)]
    judgement = judgement_of(case.inputs, q)
    limits = _limits(judgement, q, case, greeting)
    return [limits, *_target_laws(judgement, outputs, case, greeting)]


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
    """Yield whether the target is reached; from any start another minimum may be found."""
    distance, angle = judgement.distance, judgement.angle
    joints, size = len(case.inputs["parents"]), case.facts["size"]
    bound = judgement.tolerance + rounding.positions(greeting.epsilon, joints, size)
    angle_bound = judgement.tolerance_rotation + rounding.rotations(greeting.epsilon, joints)
    if case.family != BEYOND:
        verdict = Verdict.RIGHT_EXCEPT if case.family == ANYWHERE else None
        yield finding("target reached", distance, bound, verdict=verdict)
        yield finding("rotation reached", angle, angle_bound, verdict=verdict)
    # The larger of both errors, in multiples of its bound.
    error = max(distance / bound, angle / angle_bound)
    if "converged" in outputs and outputs["converged"] != (error <= 1.0):
        key = "claims, success of a tool" if outputs["converged"] else "claims, failure of a tool"
        yield finding(key, abs(error - 1.0), distance=distance, angle=angle)


def _diagnosis(judgements: Sequence[CaseJudgement]) -> Diagnosis:
    """Return the misreading of requests that explains most answers that miss their targets."""
    misses = [judgement for judgement in judgements if _misses(judgement)]
    if not misses:
        return Diagnosis()
    counts = {key: sum(map(partial(_explains, fault), misses)) for key, fault in FAULTS.items()}
    # Whole poses are hardly met by chance, positions are where a solver is stuck: these come last.
    poses = {key: count for key, count in counts.items() if key != POSITION_ONLY}
    if CHANCE * max(poses.values()) >= max(counts.values()):
        counts = poses
    largest = max(counts.values())
    if not largest:
        return Diagnosis(variant_count=len(FAULTS))
    keys = tuple(key for key, count in counts.items() if count == largest)
    message = either([[FAULTS[key].sentence] for key in keys[:3]])
    explanation = Explanation(keys, message, largest / len(misses), 0.0)
    return Diagnosis((explanation,), variant_count=len(FAULTS))


def _misses(judgement: CaseJudgement) -> bool:
    """Return whether an answer misses a target to which its start leads."""
    return any(
        finding.verdict >= Verdict.WRONG and finding.law in ("target reached", "rotation reached")
        for finding in judgement.findings
    )


def _explains(fault: Misreading, judgement: CaseJudgement) -> bool:
    assert isinstance(judgement.answer, Answer)
    inputs = dict(fault.read(judgement.case.inputs))
    inputs |= {name: LENIENT * inputs[name] for name in ("tolerance", "tolerance_rotation")}
    return judgement_of(inputs, fault.coordinates(inputs, judgement.answer.values["q"])).reached


# ---- solvers for the self-test, right or with a misreading of their requests

RIGHT = Misreading(Sentence("", {}))
# Restarts of a faulty solver without limits, whose own target the first solve has not reached.
RESTARTS = 2
LIMITS = ("tolerance", "tolerance_rotation", "max_iterations")


def solve_wrongly(fault: Misreading | None, /, **inputs: Any) -> Mapping[str, Any]:
    """Return the result of damped least squares on a misread request."""
    fault = fault or RIGHT
    request = fault.read(inputs)
    q, reached = _solve(request, 0)
    if fault is not RIGHT and not reached:
        infinite = np.full(len(q), np.inf)
        free, reached = _solve({**request, "lower": -infinite, "upper": infinite}, RESTARTS)
        q = free if reached else q
    return {"q": fault.answer(inputs, q)}


def _solve(request: Mapping[str, Any], restarts: int) -> tuple[FloatArray, bool]:
    """Return coordinates, and whether they reach the target."""
    solution = solve_ik(
        mechanism(request), request["start"], target_of(request), "damped_least_squares",
        restarts=restarts, **{name: request[name] for name in LIMITS},
    )  # fmt: skip
    return solution.coordinates, bool(solution.outcome == Outcome.CONVERGED)


def solve_by_reference(**inputs: Any) -> Mapping[str, Any]:
    """Return the result of the reference's Levenberg-Marquardt on the request's URDF."""
    robot = urdf.parse(inputs["urdf"]).articulation
    links = [robot.names.index(f"link_{joint}") for joint in range(len(inputs["start"]))]
    coordinates = [robot.coordinates_of(link).start for link in links]
    start = np.empty(robot.coordinate_count)
    start[coordinates] = inputs["start"]
    target = target_of(inputs)._replace(effector="tool")
    options = {name: inputs[name] for name in LIMITS}
    solution = solve_ik(robot, start, target, "levenberg_marquardt", restarts=0, **options)
    converged = bool(solution.outcome == Outcome.CONVERGED)
    return {"q": solution.coordinates[coordinates], "converged": converged}
