"""Speeds of robots' joints that give the tool a velocity, of least length or not, damped or not."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from plumbob.reference import Articulation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Exchange, Failure
from ..greeting import Greeting
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import rounding
from .report import report
from .robot_models import DIFFERENCES, Inputs, any_pose, mechanism, robots
from .skeletons import suits

TASK = "robot_velocity"
_SEED = 1969
# Singular values below this share of the largest are zero.
RANK = 1e-6
# The largest ratio of singular values in poses that are not singular, and how many are drawn.
CONDITION, DRAWS = 60.0, 400
# Damping that takes more than this share of the velocity away, far from singularities, is a fault.
LARGEST_LOSS = 0.25
# Speeds beyond so many times those of least length come from a division by almost zero.
FACTOR = 1e3
SINGULAR = "a singular pose"
# A Jacobian, and the velocity of the speeds by this Jacobian.
Equation = tuple[FloatArray, FloatArray]


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, in random poses and in a singular pose."""
    rng = np.random.default_rng([_SEED, seed])
    return [
        case
        for name, robot in robots(rng).items()
        if suits(robot["parents"], greeting, robot["effector"])
        for case in _cases_of(name, robot, rng, 4 if thorough else 2)
    ]


def _cases_of(name: str, robot: Inputs, rng: np.random.Generator, count: int) -> Iterator[Case]:
    draws = rng.uniform(robot["lower"], robot["upper"], (DRAWS, len(robot["lower"])))
    rank = len(singular_values(robot, draws[0]))
    regular = (q for q in draws if _is_regular(singular_values(robot, q), rank))
    for number, q in enumerate(islice(regular, count)):
        yield _case(f"{name}, pose {number + 1}", robot, q, rng, "any pose")
    zero = np.zeros(len(robot["lower"]))
    if len(singular_values(robot, zero)) < rank:
        case = _case(f"{name}, {SINGULAR}", robot, zero, rng, SINGULAR)
        yield replace(case, requirement="may")


def _case(name: str, robot: Inputs, q: FloatArray, rng: np.random.Generator, family: str) -> Case:
    """Return a request for a velocity that the tool can have."""
    J = jacobian(mechanism(robot), q, -1)
    twist = J @ (rng.choice([-1.0, 1.0], len(q)) * rng.uniform(0.5, 1.5, len(q)))
    velocities = {"linear_velocity": twist[:3], "angular_velocity": twist[3:]}
    return any_pose(name, TASK, family, robot, {"q": q, **velocities})


def singular_values(robot: Inputs, q: FloatArray) -> FloatArray:
    """Return the singular values of the Jacobian other than zero, the largest first."""
    values = np.linalg.svd(jacobian(mechanism(robot), q, -1), compute_uv=False)
    return np.array(values[values > RANK * values[0]])


def _is_regular(values: FloatArray, rank: int) -> bool:
    return len(values) == rank and bool(values[0] <= CONDITION * values[-1])


def right_equation(inputs: Inputs) -> Equation:
    """Return the equation that right speeds solve."""
    twist = np.concatenate([inputs["linear_velocity"], inputs["angular_velocity"]])
    return jacobian(mechanism(inputs), inputs["q"], -1), twist


def shortest_speeds(equation: Equation) -> FloatArray:
    """Return the speeds of least length that solve an equation."""
    J, twist = equation
    return np.asarray(np.linalg.pinv(J, RANK) @ twist)


def solving(equation: Equation, speeds: FloatArray) -> tuple[FloatArray, float]:
    """Return the solutions of an equation, the speeds nearest to an answer, and their damping d.

    Along a singular vector damped least squares give s b / (s^2 + d^2) for the velocity b (Wampler
    1986). This is less than b / s by the share d^2 / (s^2 + d^2); speeds in the null space are
    free. The damping explains the speed along the vector on which it tells most.
    """
    J, twist = equation
    U, s, V = np.linalg.svd(J, full_matrices=False)
    rank = max(int(np.sum(s > RANK * s[0])), 1)
    s, b, V = s[:rank], (twist @ U)[:rank], V[:rank]
    c, square = V @ speeds, 0.0
    i = int(np.argmax(np.abs(b) / np.maximum(s, 1e-300)))
    if c[i]:
        square = max(float(s[i] * b[i] / c[i] - s[i] ** 2), 0.0)
    parts = s * b / np.maximum(s**2 + square, 1e-300)
    return speeds + (parts - c) @ V, float(np.sqrt(square))


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge speeds by the tool's velocity."""
    judgements = [_judgement(exchange, greeting) for exchange in exchanges]
    is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    return report(TASK, method, judgements, None if is_wrong else _behaviour(judgements, greeting))


def _judgement(exchange: Exchange, greeting: Greeting) -> CaseJudgement:
    case = exchange.case
    equation = right_equation(case.inputs)
    laws = partial(_findings, case, equation, greeting)
    shortest = shortest_speeds(equation)
    rank = len(singular_values(case.inputs, case.inputs["q"]))
    expected = {"velocities": shortest} if rank == len(shortest) else {}
    allowed = _rounded_velocity(case, greeting, shortest)
    reference = partial(_speeds, mechanism(case.inputs), case.inputs["q"], equation[1])
    judgement = judge_case(exchange, laws, allowed, reference, expected)
    if case.family == SINGULAR and isinstance(exchange.answer, Failure):
        failure = exchange.answer.sentence
        judgement = replace(judgement, findings=(finding("speeds, failure", failure=failure),))
    return judgement


def _speeds(robot: Articulation, q: FloatArray, twist: FloatArray) -> FloatArray:
    """Return the speeds of least length from the robot itself: what is timed."""
    return shortest_speeds((jacobian(robot, q, -1), twist))


def _rounded_velocity(case: Case, greeting: Greeting, speeds: FloatArray) -> float:
    """Return how far rounding moves speeds, and what they do to the tool."""
    joints = len(case.inputs["q"])
    rounded = CONDITION * rounding.positions(greeting.epsilon, joints, case.facts["size"])
    return rounded * max(1.0, float(np.abs(speeds).max()))


def _findings(
    case: Case, equation: Equation, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    speeds, is_singular = outputs["velocities"], case.family == SINGULAR
    if not np.isfinite(speeds).all():
        yield not_finite("speeds, no number" if is_singular else "numbers, of a joint", speeds)
        return
    if is_singular:
        yield finding(
            "speeds", np.abs(speeds).max() / np.abs(shortest_speeds(equation)).max(), FACTOR
        )
    J, twist = equation
    bound = _rounded_velocity(case, greeting, speeds)
    nearest, damping = solving(equation, speeds)
    loss = float(np.linalg.norm(J @ speeds - twist) / np.linalg.norm(twist))
    is_damped = np.abs(nearest - speeds).max() <= bound and (is_singular or loss <= LARGEST_LOSS)
    error = float(np.abs(J @ speeds - twist).max())
    differences = DIFFERENCES * case.facts["size"] * max(1.0, float(np.abs(speeds).max()))
    key = "velocity of the tool"
    if is_damped or error <= differences:
        key += ", damped" if is_damped else ", by differences"
    verdict = Verdict.RIGHT_EXCEPT if is_singular else None
    yield finding(key, error, bound, verdict=verdict, damping=damping, loss=loss)


def _behaviour(judgements: Sequence[CaseJudgement], greeting: Greeting) -> Sentence:
    """Return whether the speeds of robots with joints to spare are of least length."""
    for judgement in judgements:
        J, _ = right_equation(judgement.case.inputs)
        if isinstance(judgement.answer, Answer) and judgement.case.family != SINGULAR:
            speeds = judgement.answer.values["velocities"]
            excess = np.abs(speeds - shortest_speeds((J, J @ speeds))).max()
            if excess > _rounded_velocity(judgement.case, greeting, speeds):
                return sentence("Joints also move where that does not move the tool.")
    return sentence("Among the speeds that solve a request it gives those of least length.")
