"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Iterator, Mapping, Sequence
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
from ..sentence import Sentence, sentence
from ..timing import time_call
from . import laws
from .cases import task_cases
from .faults import FORCE_FAULTS, Option, apply, combined
from .laws import correct_digits
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
    system, state = system_of(p), state_of(p)
    forces, seconds = time_call(lambda: reference_forces(system, state))
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {"forces": forces}, None, seconds)
    output, allowed, digits = answer.values["forces"], tolerance(p, greeting.epsilon), None
    if np.isfinite(output).all():
        symmetry = laws.symmetry(exchange, exchanges, {"forces": 2.0 * allowed})
        findings = [
            _formula(p, output, forces, allowed),
            _balance(p, output, allowed),
            *([symmetry] if symmetry else []),
            laws.equal_requests(exchange, {"forces": 2.0 * allowed}),
            *laws.remarks(answer),
        ]
        size = float(np.abs(forces).max())
        if size > allowed:
            digits = correct_digits(float(np.abs(output - forces).max()), size)
    else:
        findings = [laws.not_finite(sentence("Forces hold NaN or infinity."))]
    return CaseJudgement(case, answer, tuple(findings), {"forces": forces}, digits, seconds)


def _formula(p: SpringProblem, output: FloatArray, expected: FloatArray, allowed: float) -> Finding:
    gap = np.abs(output - expected).max(axis=1)
    index, worst = int(gap.argmax()), float(gap.max())
    message = sentence(
        "The force on particle {where} is wrong by {gap:.2g} N {term}.",
        where=index,
        gap=worst,
        term=_likeness(p, output - expected),
    )
    return laws.bounded("force formula", worst, allowed, "N", message, index)


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
    gap = float(np.abs(output.sum(0) - p.constant.sum(0)).max())
    message = sentence("The sum of all forces differs by {gap:.2g} N from the weight.", gap=gap)
    limit = allowed * np.sqrt(p.count) * 2.0
    return laws.bounded("momentum balance", gap, limit, "N", message)


def _predict(faults: tuple[Option, ...], case: Case) -> Mapping[str, Any]:
    return {"forces": all_forces(apply(faults, problem_of(case.inputs), StepModel())[0])}


def variants() -> Iterator[Variant]:
    """Yield the right formula's faults, up to three of different aspects."""
    for faults in combined(FORCE_FAULTS):
        yield Variant(tuple(fault.key for fault in faults), partial(_predict, faults))


def describe(keys: Sequence[str]) -> Sentence:
    """Return the sentences of faults, given the keys of a class that no answer tells apart."""
    return either([[_SENTENCES[fault] for fault in key.split(" + ")] for key in keys])


def _diagnose(
    judgements: Sequence[CaseJudgement], exchanges: Sequence[Exchange], greeting: Greeting
) -> Diagnosis:
    wrong = [judgement.verdict >= Verdict.WRONG for judgement in judgements]
    if not any(wrong):
        return Diagnosis()

    def relative_tolerance(case: Case) -> float:
        p = problem_of(case.inputs)
        return tolerance(p, greeting.epsilon) / max(float(np.abs(all_forces(p)).max()), 1e-3)

    # Wrong answers come first, for they tell variants apart.
    order = sorted(range(len(wrong)), key=lambda i: not wrong[i])
    telling = [exchanges[i] for i in order]
    explanations, count = explain(variants(), telling, relative_tolerance, describe)
    first = None if explanations else first_broken(judgements)
    return Diagnosis(explanations, None, first, (), count)
