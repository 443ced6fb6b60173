"""Jacobians of robots' tools, in any usual frame and order."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import LEAST_SHARE, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import digits, judge_case, not_finite, of_joints
from . import robot_models, rounding
from .formulas import evaluate
from .report import report, with_hints
from .robot_faults import FAULTS as POSE_FAULTS
from .robot_faults import JACOBIAN_FAULTS, RobotFault
from .robot_models import mechanism, tool_pose
from .robot_textbook import Inputs
from .skeletons import suits

TASK = "robot_jacobian"
_SEED = 1972
# A fault is compared with all answers only if it explains one of the first.
TRIAL = 2
# A fault explains an answer if it leaves this share of the answer's error: rounding is larger in
# differences.
REMAINDER = 1e-4


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, each in a random configuration."""
    rng = np.random.default_rng([_SEED, seed])
    return [
        _case(f"{name}, pose {number + 1}", robot, rng)
        for name, robot in robot_models.robots(rng).items()
        if suits(robot["parents"], greeting, robot["effector"])
        for number in range(5 if thorough else 2)
    ]


def _case(name: str, robot: Mapping[str, Any], rng: np.random.Generator) -> Case:
    q = rng.uniform(robot["lower"], robot["upper"])
    inputs = {**robot, "q": q, "urdf": robot_models.urdf(robot)}
    about = sentence("A robot of {joints} joints.", joints=len(q))
    facts = {"size": max(robot_models.size_of(robot), 1.0)}
    return Case(name, TASK, inputs, "any configuration", about, facts=facts)


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
# What programs with a fault answer.
FAULTS: Mapping[str, RobotFault] = {
    key: fault
    for key, fault in (JACOBIAN_FAULTS | POSE_FAULTS).items()
    if not (fault.relative or fault.is_of_target)
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
    """Compare Jacobians with the reference in the convention that suits them; name the faults."""
    name, matches = _convention(exchanges, greeting)
    judgements = []
    for exchange in exchanges:
        J = right_jacobian(exchange.case.inputs, CONVENTIONS[name])
        laws = partial(_findings, exchange.case, J, greeting)
        inputs = exchange.case.inputs
        reference = partial(jacobian, mechanism(inputs), inputs["q"], -1)
        allowed = rounding.repeats(greeting.epsilon, exchange.case.facts["size"])
        count = digits(_gap(exchange, J), 1.0) if exchange.case.name in matches else None
        judgements.append(judge_case(exchange, laws, allowed, reference, {"jacobian": J}, count))
    wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    words = sentence("The Jacobian's convention: {convention}.", convention=name)
    return report(TASK, method, judgements, words if matches and not wrong else None)


def diagnose(judged: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the Jacobians, if some are wrong."""
    judgements, diagnosis = judged.report.judgements, Diagnosis()
    if any(judgement.verdict >= Verdict.WRONG for judgement in judgements):
        _, matches = _convention(judged.exchanges, judged.greeting)
        wrong, right = (
            [exchange for exchange in judged.exchanges if matches.get(exchange.case.name) is value]
            for value in (False, True)
        )
        diagnosis = _diagnosis(wrong, right, judged.greeting)
    return with_hints(judgements, diagnosis)


def _convention(exchanges: Sequence[Exchange], greeting: Greeting) -> tuple[str, dict[str, bool]]:
    """Return the convention that suits most answers, and by case whether it suits."""
    answered = [
        exchange
        for exchange in exchanges
        if isinstance(exchange.answer, Answer) and "jacobian" in exchange.answer.values
    ]
    matches = {
        name: {
            exchange.case.name: _matches(
                exchange, greeting, right_jacobian(exchange.case.inputs, convention)
            )
            for exchange in answered
        }
        for name, convention in CONVENTIONS.items()
    }
    name = max(matches, key=lambda name: sum(matches[name].values()))
    return name, matches[name]


def _bound(case: Case, greeting: Greeting) -> float:
    """Return how far rounding moves an entry of a Jacobian."""
    return rounding.positions(greeting.epsilon, len(case.inputs["q"]), case.facts["size"])


def _matches(exchange: Exchange, greeting: Greeting, J: FloatArray) -> bool:
    """Return whether an answer is a Jacobian."""
    return _gap(exchange, J) <= _bound(exchange.case, greeting)


def _gap(exchange: Exchange, J: FloatArray) -> float:
    assert isinstance(exchange.answer, Answer)
    return float(np.abs(exchange.answer.values["jacobian"] - J).max())


def _share(fault: RobotFault, exchanges: Sequence[Exchange], greeting: Greeting) -> float:
    """Return the share of the answers that a fault explains in one of the conventions.

    Right answers that the fault does not change are not counted; those that it would are.
    """
    conventions = CONVENTIONS.values()
    is_right, is_explained = np.zeros((2, len(exchanges), len(conventions)), dtype=bool)
    for i, exchange in enumerate(exchanges):
        if i == TRIAL and not is_explained.any():
            return 0.0
        inputs = exchange.case.inputs
        frames = fault.frames(inputs, inputs["q"])
        answer = fault.rules.get("answer", "J")
        columns = fault._replace(rules={**fault.rules, "answer": "J"})
        jacobians = list(columns.jacobians(inputs, inputs["q"]))
        for k, convention in enumerate(conventions):
            predictions = (
                evaluate(answer, {"J": convention(J, frames.position, frames.rotation)})
                for J in jacobians
            )
            bound, error = (
                _bound(exchange.case, greeting),
                _gap(exchange, right_jacobian(inputs, convention)),
            )
            is_right[i, k] = error <= bound
            gap = min(_gap(exchange, J) for J in predictions)
            is_explained[i, k] = gap <= max(bound, REMAINDER * error)
    explained, counted = is_explained & ~is_right, ~(is_explained & is_right)
    return float((explained.sum(axis=0) / np.maximum(counted.sum(axis=0), 1)).max())


def _findings(
    case: Case, J: FloatArray, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    answer = outputs["jacobian"]
    if not np.isfinite(answer).all():
        yield not_finite("numbers, of a joint", answer.sum(axis=0))
        return
    errors = np.abs(answer - J).max(axis=0)
    yield of_joints("Jacobian", errors, _bound(case, greeting))


# Groups of which only one may be wrong, and the parts of columns that they have: by whether a part
# is angular, of a slide, of the joint that carries the tool and of one at the base.
GROUPS: Sequence[tuple[Sentence, Callable[..., BoolArray]]] = (
    (sentence("the linear parts of hinges"), lambda part, slide, last, first: ~part & ~slide),
    (sentence("the angular parts of hinges"), lambda part, slide, last, first: part & ~slide),
    (sentence("the columns of slides"), lambda part, slide, last, first: slide),
    (sentence("the last columns"), lambda part, slide, last, first: last),
    (sentence("the first columns"), lambda part, slide, last, first: first),
    (sentence("the columns of hinges"), lambda part, slide, last, first: ~slide),
)  # fmt: skip


def _relation(exchanges: Sequence[Exchange], greeting: Greeting) -> tuple[Sentence, ...]:
    """Return the factors, or else the only parts, by which all answers differ from a convention."""
    best, share = tuple[Sentence, ...](), 0.0
    for name, convention in CONVENTIONS.items():
        columns = [_columns(exchange, name, convention, greeting) for exchange in exchanges]
        answer, right, bound, *flags = (np.concatenate(x) for x in zip(*columns, strict=True))
        is_right = np.abs(answer - right).max(axis=-1) <= bound
        groups = [(words, has_parts(*np.array(flags, dtype=bool))) for words, has_parts in GROUPS]
        factors = [(answer * right)[group].sum() / max((right[group] ** 2).sum(), 1e-300)
                   for _, group in groups[:3]]  # fmt: skip
        scale = sum(f * group for f, (_, group) in zip(factors, groups, strict=False))
        if (np.abs(answer - scale[:, None] * right).max(axis=-1) <= bound).all():
            words = sentence(
                "Your numbers are the right ones times a factor: {linear:.6g} in the linear parts "
                "of hinges, {angular:.6g} in their angular parts, {slide:.6g} in slides.",
                linear=factors[0], angular=factors[1], slide=factors[2],
            )  # fmt: skip
            return (words,) if np.ptp(factors) > REMAINDER else ()  # else laws.py says it
        only = [words for words, group in groups if is_right[~group].all()]
        if only and is_right.mean() > share:
            words = sentence("Only {what} of your Jacobians are wrong: all else is right.",
                             what=only[0])  # fmt: skip
            best, share = (words,), float(is_right.mean())
    return best


def _columns(
    exchange: Exchange, name: str, convention: Convention, greeting: Greeting
) -> Sequence[FloatArray]:
    """Return the answer's and the right parts of columns, (part, 3), bounds, and flags of each."""
    assert isinstance(exchange.answer, Answer)
    inputs = exchange.case.inputs
    shift = 3 if "angular part first" in name else 0
    pair = exchange.answer.values["jacobian"], right_jacobian(inputs, convention)
    parts = [np.roll(J, shift, axis=0).reshape(2, 3, -1).swapaxes(1, 2) for J in pair]
    joints = np.arange(len(inputs["q"]))
    flags = (inputs["slides"], joints == inputs["effector"], inputs["parents"] < 0)
    bounds = np.full(2 * len(joints), _bound(exchange.case, greeting))
    return (
        *(part.reshape(-1, 3) for part in parts),
        bounds,
        np.repeat([0, 1], len(joints)),
        *(np.tile(x, 2) for x in flags),
    )


def _diagnosis(
    wrong: Sequence[Exchange], right: Sequence[Exchange], greeting: Greeting
) -> Diagnosis:
    """Return the fault that explains most Jacobians, wrong ones with many joints first."""
    if not wrong:
        return Diagnosis()
    exchanges = [*sorted(wrong, key=lambda exchange: -len(exchange.case.inputs["q"])), *right]
    shares = {
        key: min(_share(fault, exchanges, greeting), _share(fault, wrong, greeting))
        for key, fault in FAULTS.items()
    }
    key = max(shares, key=shares.__getitem__, default="")
    if not key or shares[key] < LEAST_SHARE:
        return Diagnosis(hints=_relation(exchanges, greeting), variant_count=len(FAULTS))
    explanation = Explanation((key,), FAULTS[key].sentence, shares[key], 0.0)
    return Diagnosis((explanation,), variant_count=len(FAULTS))
