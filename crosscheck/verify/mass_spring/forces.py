"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import forces as reference_forces

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import Variant, either, explain, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..laws import digits, finding, hints_of, judge_case
from ..sentence import Sentence, sentence
from .cases import task_cases
from .faults import FORCE_FAULTS, Option, apply, combined
from .formulas import evaluate
from .laws import symmetry
from .model import StepModel
from .problem import (
    SpringProblem,
    all_forces,
    damper_forces,
    problem_of,
    spring_forces,
    state_of,
    system_of,
)

TASK = "mass_spring_forces"
# Rounding of a length by the coordinates' epsilon, times the stiffness, and of some ten terms.
ROUNDINGS = 8.0
# An error is like a force if the cosine of the angle between them is larger.
ALIKE = 0.7
_SENTENCES = {fault.key: fault.sentence for fault in FORCE_FAULTS}


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold the forces against the formula and the balance of momentum, and name the faults."""
    judgements = [_judge_case(exchange, exchanges, greeting) for exchange in exchanges]
    return TaskReport(TASK, "", judgements, _diagnose(judgements, exchanges, greeting))


def tolerance(p: SpringProblem, epsilon: float) -> float:
    """Return how far rounding may take a force [N]."""
    size = float(np.abs(p.positions).max() + p.rest_lengths.max(initial=0.0))
    speed = float(np.abs(p.velocities).max())
    springs = np.abs(p.incidence).T @ (p.stiffnesses * size + p.dampings * speed)
    weights = p.masses * float(np.linalg.norm(p.gravity))
    return ROUNDINGS * epsilon * float((springs + weights).max())


def _judge_case(
    exchange: Exchange, exchanges: Sequence[Exchange], greeting: Greeting
) -> CaseJudgement:
    case, answer = exchange.case, exchange.answer
    p = problem_of(case.inputs)
    reference = partial(reference_forces, system_of(p), state_of(p))
    forces, allowed, correct_digits = reference(), tolerance(p, greeting.epsilon), None

    def findings(outputs: Mapping[str, Any]) -> Iterator[Finding]:
        output = outputs["forces"]
        if not np.isfinite(output).all():
            yield finding("finite numbers", name="forces")
            return
        yield _formula(p, output, forces, allowed)
        yield _balance(p, output, allowed)
        yield from filter(None, [symmetry(exchange, exchanges, {"forces": 2.0 * allowed})])

    size = float(np.abs(forces).max())
    if isinstance(answer, Answer) and size > allowed:
        correct_digits = digits(float(np.abs(answer.values["forces"] - forces).max()), size)
    expected = {"forces": forces}
    return judge_case(exchange, findings, 2.0 * allowed, reference, expected, correct_digits)


def _formula(p: SpringProblem, output: FloatArray, expected: FloatArray, allowed: float) -> Finding:
    gap, term = np.abs(output - expected).max(axis=1), _likeness(p, output - expected)
    return finding("force formula", gap.max(), allowed, index=int(gap.argmax()), term=term)


def _likeness(p: SpringProblem, error: FloatArray) -> Sentence:
    """Return which term's force looks most like the error."""
    x, v = p.positions, p.velocities
    terms = (
        (p.constant, sentence("(the error resembles gravity)")),
        (spring_forces(p, x), sentence("(the error resembles the spring forces)")),
        (damper_forces(p, x, v), sentence("(the error resembles the damper forces)")),
    )
    size = np.linalg.norm(error)
    cosines = [
        abs(float((force * error).sum())) / max(float(np.linalg.norm(force) * size), 1e-300)
        for force, _ in terms
    ]
    best = int(np.argmax(cosines))
    return (
        terms[best][1]
        if cosines[best] > ALIKE
        else sentence("(the error resembles no single term)")
    )


def _balance(p: SpringProblem, output: FloatArray, allowed: float) -> Finding:
    """Springs and dampers pull both ends alike: the sum of forces is the weight."""
    gap = np.abs(output.sum(0) - p.constant.sum(0)).max()
    return finding("momentum balance", gap, allowed * np.sqrt(p.count) * 2.0)


def _pulls(p: SpringProblem) -> FloatArray:
    """Return the force of each spring and its damper on its first end [N], (spring, 3)."""
    single = p.changed(
        masses=np.ones(2 * len(p.springs)),
        springs=np.arange(2 * len(p.springs)).reshape(-1, 2),
        positions=p.positions[p.springs.ravel()],
        velocities=p.velocities[p.springs.ravel()],
    )
    x, v = single.positions, single.velocities
    return (spring_forces(single, x) + damper_forces(single, x, v))[::2]


def _shortened(vectors: FloatArray, limit: float) -> FloatArray:
    """Return vectors that are no longer than a limit."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, limit / np.maximum(lengths, 1e-300))


# What faults make of all forces in the end, by their keys, and with a number that answers show.
OUTPUTS: Mapping[str, Callable[[SpringProblem, float], FloatArray]] = {
    "components of forces clipped": lambda p, limit: np.clip(all_forces(p), -limit, limit),
    "components of springs' forces clipped": lambda p, limit: (
        p.constant + p.incidence.T @ np.clip(_pulls(p), -limit, limit)
    ),
    "springs' forces clipped": lambda p, limit: (
        p.constant + p.incidence.T @ _shortened(_pulls(p), limit)
    ),
    "drag": lambda p, factor: all_forces(p) - factor * p.velocities,
}


def _numbers(
    exchanges: Sequence[Exchange], problems: Mapping[str, SpringProblem]
) -> dict[str, float]:
    """Return the limits and factors that faults of outputs have, if a solver has these faults."""
    answers = [
        (problems[exchange.case.name], exchange.answer.values["forces"])
        for exchange in exchanges
        if isinstance(exchange.answer, Answer)
    ]
    errors = [(all_forces(p) - f, p.velocities) for p, f in answers]
    squares = [float((v * v).sum()) for _, v in errors]
    rates = [float((e * v).sum()) / s for (e, v), s in zip(errors, squares, strict=True) if s]
    return {
        "components of forces clipped": max((np.abs(f).max() for _, f in answers), default=0.0),
        "drag": float(np.median(rates)) if rates else 0.0,
    }


def _predict(
    faults: tuple[Option, ...],
    problems: Mapping[str, SpringProblem],
    numbers: Mapping[str, float],
    case: Case,
) -> Mapping[str, Any]:
    return {"forces": forces_with(faults, problems[case.name], numbers)}


def forces_with(
    faults: Sequence[Option], p: SpringProblem, numbers: Mapping[str, float]
) -> FloatArray:
    """Return the forces of a solver with faults; numbers are those that `OUTPUTS` take."""
    p = apply(faults, p, StepModel())[0]
    fault = next((fault for fault in faults if fault.output), None)
    if fault is None:
        return all_forces(p)
    if isinstance(fault.output, str):
        return np.asarray(evaluate(fault.output, p))
    name, _, number = fault.key.partition(" at ")
    return OUTPUTS[name](p, float(number or numbers.get(name, 0.0)))


def variants(exchanges: Sequence[Exchange]) -> Iterator[Variant]:
    """Yield the right formula's faults, up to three of different aspects."""
    problems = {exchange.case.name: problem_of(exchange.case.inputs) for exchange in exchanges}
    numbers = _numbers(exchanges, problems)
    for faults in combined(FORCE_FAULTS):
        keys = tuple(fault.key for fault in faults)
        yield Variant(keys, partial(_predict, faults, problems, numbers))


def describe(keys: Sequence[str]) -> Sentence:
    """Return the sentences of faults, given the keys of a class that no answer tells apart."""
    return either([[_SENTENCES[fault] for fault in key.split(" + ")] for key in keys])


def _diagnose(
    judgements: Sequence[CaseJudgement], exchanges: Sequence[Exchange], greeting: Greeting
) -> Diagnosis:
    wrong = [judgement.verdict >= Verdict.WRONG for judgement in judgements]
    if not any(wrong):
        return Diagnosis()
    if unequal := first_broken(judgements, "equal answers"):
        return Diagnosis((), None, unequal, hints_of(judgements))

    def relative_tolerance(case: Case) -> float:
        p = problem_of(case.inputs)
        return tolerance(p, greeting.epsilon) / max(float(np.abs(all_forces(p)).max()), 1e-3)

    # Wrong answers come first, for they tell variants apart.
    order = sorted(range(len(wrong)), key=lambda i: not wrong[i])
    telling = [exchanges[i] for i in order]
    explanations, count = explain(variants(telling), telling, relative_tolerance, describe)
    first = None if explanations else first_broken(judgements)
    return Diagnosis(explanations, None, first, hints_of(judgements), count)
