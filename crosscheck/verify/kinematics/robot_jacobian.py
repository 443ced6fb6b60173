"""Jacobians of robots' tools, in any usual frame and order."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian

from ..case import Case
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import LEAST_SHARE, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import judge_case, not_finite, of_joints
from ..sentence import Sentence, sentence, with_code
from . import robot_models, rounding
from .faults import TABLE
from .report import report
from .robot_models import mechanism, tool_pose
from .skeletons import suits

Inputs = Mapping[str, Any]
TASK = "robot_jacobian"
_SEED = 1972


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each in a random configuration."""
    rng = np.random.default_rng([_SEED, seed])
    return [
        _case(f"{name}, pose {number + 1}", robot, rng)
        for name, robot in robot_models.robots(rng).items()
        if suits(robot["parents"], greeting)
        for number in range(5 if thorough else 2)
    ]


def _case(name: str, robot: Mapping[str, Any], rng: np.random.Generator) -> Case:
    q = rng.uniform(robot["lower"], robot["upper"])
    inputs = {**robot, "q": q, "urdf": robot_models.urdf(robot)}
    reach = float(sum(np.linalg.norm(x) for x in (*robot["origins"], robot["tool_position"])))
    about = sentence("A robot of {joints} joints.", joints=len(q))
    return Case(name, TASK, inputs, "any configuration", about, facts={"size": max(reach, 1.0)})


def _world(inputs: Inputs) -> FloatArray:
    """Return the Jacobian of the tool's origin along the axes of the world, (6, joint)."""
    return jacobian(mechanism(inputs), inputs["q"], -1)


def _body(inputs: Inputs) -> FloatArray:
    """Return both parts along the axes of the tool."""
    R = rotation.to_matrix(tool_pose(inputs, inputs["q"]).rotations)
    return np.kron(np.eye(2), R.T) @ _world(inputs)


def _spatial(inputs: Inputs) -> FloatArray:
    """Return the velocity of the point of the tool's body that is at the world's origin."""
    J, x = _world(inputs), tool_pose(inputs, inputs["q"]).positions
    return np.concatenate([J[:3] - np.cross(J[3:].T, x).T, J[3:]])


def _arranged(convert: Callable[[Inputs], FloatArray], shift: int, inputs: Inputs) -> FloatArray:
    """Return a Jacobian with its rows rolled: 3 puts the angular part first."""
    return np.roll(convert(inputs), shift, axis=0)


# Frames and orders that textbooks use, by name.
CONVENTIONS: Mapping[str, Callable[[Inputs], FloatArray]] = {
    f"{frame}, {order} part first": partial(_arranged, convert, shift)
    for order, shift in (("linear", 0), ("angular", 3))
    for frame, convert in (("world", _world), ("tool", _body), ("spatial", _spatial))
}


def _with_arms(inputs: Inputs, arms: FloatArray) -> FloatArray:
    """Return the Jacobian with other arms from the joints to the tool, (joint, 3)."""
    J = _world(inputs)
    linear = np.where(inputs["slides"], J[:3], np.cross(J[3:].T, arms).T)
    return np.concatenate([linear, J[3:]])


def _slides_as_hinges(inputs: Inputs) -> FloatArray:
    J, x = _world(inputs), forward_kinematics(mechanism(inputs), inputs["q"]).positions
    columns = np.concatenate([np.cross(J[:3].T, x[-1] - x[1:-1]).T, J[:3]])
    return np.where(inputs["slides"], columns, J)


# What a program with a fault answers.
FAULTS: Mapping[str, Callable[[Inputs], FloatArray]] = {
    "lever arms missing": lambda inputs: _with_arms(inputs, np.zeros((len(inputs["q"]), 3))),
    "lever arms from the origin": lambda inputs: _with_arms(
        inputs, np.tile(tool_pose(inputs, inputs["q"]).positions, (len(inputs["q"]), 1))
    ),
    "slides as hinges": _slides_as_hinges,
    "columns negated": lambda inputs: -_world(inputs),
    "frames mixed": lambda inputs: np.concatenate([_world(inputs)[:3], _body(inputs)[3:]]),
}


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Compare Jacobians with the reference in the convention that suits them; name the faults."""
    answered = [
        exchange
        for exchange in exchanges
        if isinstance(exchange.answer, Answer) and "jacobian" in exchange.answer.values
    ]
    convention = max(CONVENTIONS, key=lambda name: _share(CONVENTIONS[name], answered, greeting))
    judgements = []
    for exchange in exchanges:
        J = CONVENTIONS[convention](exchange.case.inputs)
        laws = partial(_findings, exchange.case, J, greeting)
        allowed = rounding.repeats(greeting.epsilon, exchange.case.facts["size"])
        judgements.append(judge_case(exchange, laws, allowed, None, {"jacobian": J}))
    wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    diagnosis = _diagnosis(answered, greeting) if wrong else Diagnosis()
    if not wrong and answered:
        words = sentence("The Jacobian's convention: {convention}.", convention=convention)
        diagnosis = Diagnosis(behaviour=words)
    return report(TASK, method, judgements, diagnosis)


def _bound(case: Case, greeting: Greeting) -> float:
    """Return how far rounding moves an entry of a Jacobian."""
    return rounding.positions(greeting.epsilon, len(case.inputs["q"]), case.facts["size"])


def _share(
    predict: Callable[[Inputs], FloatArray], exchanges: Sequence[Exchange], greeting: Greeting
) -> float:
    """Return the share of the Jacobians that a prediction explains."""
    matches = []
    for exchange in exchanges:
        assert isinstance(exchange.answer, Answer)
        gap = np.abs(exchange.answer.values["jacobian"] - predict(exchange.case.inputs)).max()
        matches.append(bool(gap <= _bound(exchange.case, greeting)))
    return float(np.mean(matches)) if matches else 0.0


def _findings(
    case: Case, J: FloatArray, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    answer = outputs["jacobian"]
    if not np.isfinite(answer).all():
        yield not_finite("numbers, of a joint", answer.sum(axis=0))
        return
    errors = np.abs(answer - J).max(axis=0)
    yield of_joints("Jacobian", errors, _bound(case, greeting))


def _diagnosis(exchanges: Sequence[Exchange], greeting: Greeting) -> Diagnosis:
    """Return the fault that explains most Jacobians."""
    shares = {key: _share(predict, exchanges, greeting) for key, predict in FAULTS.items()}
    key = max(shares, key=shares.__getitem__)
    if shares[key] < LEAST_SHARE:
        return Diagnosis(variant_count=len(FAULTS))
    entry = TABLE["robot_jacobian"][key]
    words = with_code(entry["code"], Sentence(entry["sentence"], {}))
    return Diagnosis((Explanation((key,), words, shares[key], 0.0),), variant_count=len(FAULTS))
