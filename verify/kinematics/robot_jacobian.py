"""Jacobians of robots' tools, in any usual frame and order."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import Finding, TaskReport, Verdict
from ..laws import digits, judge_case, not_finite, of_joints
from . import rounding
from .report import report
from .robot_models import DIFFERENCES, Inputs, any_pose, mechanism, robots, tool_pose
from .skeletons import suits

TASK = "robot_jacobian"
_SEED = 1972


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each in a random configuration."""
    rng, cases = np.random.default_rng([_SEED, seed]), list[Case]()
    for name, robot in robots(rng).items():
        if suits(robot["parents"], greeting, robot["effector"]):
            for number in range(5 if thorough else 2):
                options = {"q": rng.uniform(robot["lower"], robot["upper"])}
                label = f"{name}, pose {number + 1}"
                cases.append(any_pose(label, TASK, "any configuration", robot, options))
    return cases


def _world(J: FloatArray, x: FloatArray, R: FloatArray) -> FloatArray:
    """Return the Jacobian of the tool's origin along the axes of the world, (6, joint)."""
    return J


def _body(J: FloatArray, x: FloatArray, R: FloatArray) -> FloatArray:
    """Return both parts along the axes of the tool."""
    return np.asarray(np.kron(np.eye(2), R.T) @ J)


def _spatial(J: FloatArray, x: FloatArray, R: FloatArray) -> FloatArray:
    """Return the velocity of the point of the tool's body that is at the world's origin."""
    return np.concatenate([J[:3] - np.cross(J[3:].T, x).T, J[3:]])


# Returns a Jacobian in another frame and order, given the tool's position and rotation.
Convention = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]


def _arranged(convert: Convention, shift: int, *arguments: FloatArray) -> FloatArray:
    """Return a Jacobian with its rows rolled: 3 puts the angular part first."""
    return np.roll(convert(*arguments), shift, axis=0)


# Frames and orders that textbooks use, by name.
CONVENTIONS: Mapping[str, Convention] = {
    f"{frame}, {order} part first": partial(_arranged, convert, shift)
    for order, shift in (("linear", 0), ("angular", 3))
    for frame, convert in (("world", _world), ("tool", _body), ("spatial", _spatial))
}


def right_jacobian(inputs: Inputs, convention: Convention) -> FloatArray:
    """Return the reference's Jacobian in a convention."""
    tool = tool_pose(inputs, inputs["q"])
    J = jacobian(mechanism(inputs), inputs["q"], -1)
    return convention(J, tool.positions, rotation.to_matrix(tool.rotations))


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Compare Jacobians with the reference in the suitable convention; name the faults."""
    name, matches = _best_convention(exchanges, greeting)
    judgements = []
    for exchange in exchanges:
        case = exchange.case
        J = right_jacobian(case.inputs, CONVENTIONS[name])
        reference = partial(jacobian, mechanism(case.inputs), case.inputs["q"], -1)
        allowed = rounding.repeats(greeting.epsilon, case.facts["size"])
        count = digits(_gap(exchange, J), 1.0) if case.name in matches else None
        laws = partial(_findings, case, J, greeting)
        judgements.append(judge_case(exchange, laws, allowed, reference, {"jacobian": J}, count))
    wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    words = sentence("The Jacobian's convention: {convention}.", convention=name)
    return report(TASK, method, judgements, words if matches and not wrong else None)


def _best_convention(
    exchanges: Sequence[Exchange], greeting: Greeting
) -> tuple[str, dict[str, bool]]:
    """Return the suitable convention of most answers, and by case whether an answer agrees."""
    matches: dict[str, dict[str, bool]] = {name: {} for name in CONVENTIONS}
    for exchange in exchanges:
        if isinstance(exchange.answer, Answer) and "jacobian" in exchange.answer.values:
            differences = DIFFERENCES * exchange.case.facts["size"]
            bound = max(_bound(exchange.case, greeting), differences)
            for name, convention in CONVENTIONS.items():
                gap = _gap(exchange, right_jacobian(exchange.case.inputs, convention))
                matches[name][exchange.case.name] = gap <= bound
    name = max(matches, key=lambda name: sum(matches[name].values()))
    return name, matches[name]


def _bound(case: Case, greeting: Greeting) -> float:
    """Return how far rounding moves an entry of a Jacobian."""
    return rounding.positions(greeting.epsilon, len(case.inputs["q"]), case.facts["size"])


def _gap(exchange: Exchange, J: FloatArray) -> float:
    """Return the largest difference of an answer from a Jacobian."""
    assert isinstance(exchange.answer, Answer)
    return float(np.abs(exchange.answer.values["jacobian"] - J).max())


def _findings(
    case: Case, J: FloatArray, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    answer = outputs["jacobian"]
    if not np.isfinite(answer).all():
        yield not_finite("numbers, of a joint", answer.sum(axis=0))
        return
    errors = np.abs(answer - J).max(axis=0)
    is_difference = errors.max() <= DIFFERENCES * case.facts["size"]
    key = "Jacobian, by differences" if is_difference else "Jacobian"
    yield of_joints(key, errors, _bound(case, greeting))
