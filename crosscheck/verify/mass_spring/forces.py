"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.mass_spring import forces as reference_forces

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import Variant, either, explain, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws
from .cases import task_cases
from .faults import FORCE_FAULTS, Option, apply, combined
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
from .rounding import correct_digits

TASK = "mass_spring_forces"
# Rounding of a length by the coordinates' epsilon, times the stiffness, and of some ten terms.
ROUNDINGS = 8.0


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold the forces against the formula and the balance of momentum, and name the faults."""
    judgements = [_judge_case(one, asked, greeting) for one in asked]
    return TaskReport(TASK, "", judgements, _diagnose(asked, judgements, greeting))


def tolerance(p: SpringProblem, epsilon: float) -> float:
    """Return how far rounding may take a force [N]."""
    size = float(np.abs(p.positions).max() + p.rest_lengths.max(initial=0.0))
    speed = float(np.abs(p.velocities).max())
    springs = np.abs(p.incidence).T @ (p.stiffnesses * size + p.dampings * speed)
    weights = p.masses * float(np.linalg.norm(p.gravity))
    return ROUNDINGS * epsilon * float((springs + weights).max())


def _judge_case(one: Exchange, asked: Sequence[Exchange], greeting: Greeting) -> CaseJudgement:
    p = problem_of(one.case.inputs)
    system, state = system_of(p), state_of(p)
    forces, seconds = timed(lambda: reference_forces(system, state))
    expected = {"forces": forces}
    if not isinstance(one.answer, Answer):
        return CaseJudgement(one.case, one.answer, (), expected, None, seconds)
    given, allowed = one.answer.values["forces"], tolerance(p, greeting.epsilon)
    findings = tuple(_findings(one, one.answer, asked, p, forces, allowed))
    size, gap = float(np.abs(forces).max()), float(np.abs(given - forces).max())
    digits = correct_digits(gap, size) if size > allowed and np.isfinite(gap) else None
    return CaseJudgement(one.case, one.answer, findings, expected, digits, seconds)


def _findings(
    one: Exchange,
    answer: Answer,
    asked: Sequence[Exchange],
    p: SpringProblem,
    expected: Any,
    allowed: float,
) -> list[Finding]:
    given = answer.values["forces"]
    if not np.isfinite(given).all():
        return [laws.no_numbers(sentence("Forces hold NaN or infinity."))]
    limits = {"forces": 2.0 * allowed}
    symmetry = laws.symmetry(one, asked, limits)
    return [
        _formula(p, given, expected, allowed),
        _balance(p, given, allowed),
        *([symmetry] if symmetry else []),
        laws.equal_requests(one, limits),
        *laws.remarks(answer),
    ]


def _formula(p: SpringProblem, given: Any, expected: Any, allowed: float) -> Finding:
    gap = np.abs(given - expected).max(axis=1)
    where, worst = int(gap.argmax()), float(gap.max())
    said = sentence(
        "The force on particle {where} is {gap:.2g} N off {term}.",
        where=where,
        gap=worst,
        term=_term(p, given - expected),
    )
    return laws.bounded("force formula", worst, allowed, "N", said, where)


def _term(p: SpringProblem, error: Any) -> Sentence:
    """Return which term's force looks most like the error."""
    x, v = p.positions, p.velocities
    terms = (
        (p.constant, sentence("(an error like the force of gravity)")),
        (spring_forces(p, x), sentence("(an error like the force of the springs)")),
        (damper_forces(p, x, v), sentence("(an error like the force of the dampers)")),
    )
    size = np.linalg.norm(error)
    likeness = [
        abs(float((force * error).sum())) / max(float(np.linalg.norm(force) * size), 1e-300)
        for force, _ in terms
    ]
    best = int(np.argmax(likeness))
    return terms[best][1] if likeness[best] > 0.7 else sentence("(an error like no single term)")


def _balance(p: SpringProblem, given: Any, allowed: float) -> Finding:
    """Springs and dampers pull both ends alike: the sum of forces is the weight."""
    gap = float(np.abs(given.sum(0) - p.constant.sum(0)).max())
    said = sentence("The sum of all forces is {gap:.2g} N off the weight.", gap=gap)
    return laws.bounded("momentum balance", gap, allowed * np.sqrt(p.count) * 2.0, "N", said)


def _predict(faults: tuple[Option, ...], case: Case) -> Mapping[str, Any]:
    return {"forces": all_forces(apply(faults, problem_of(case.inputs), StepModel())[0])}


def variants() -> Iterator[Variant]:
    """Yield the right formula's faults, up to three of different aspects."""
    for faults in combined(FORCE_FAULTS):
        yield Variant(tuple(one.key for one in faults), partial(_predict, faults))


_BY_KEY = {one.key: one.sentence for one in FORCE_FAULTS}


def describe(keys: Sequence[str]) -> Sentence:
    """Return the sentences of faults, given the keys of a class that no answer tells apart."""
    return either([[_BY_KEY[one] for one in key.split(" + ")] for key in keys])


def _diagnose(
    asked: Sequence[Exchange], judgements: Sequence[CaseJudgement], greeting: Greeting
) -> Diagnosis:
    wrong = [one.verdict >= Verdict.WRONG for one in judgements]
    if not any(wrong):
        return Diagnosis()
    order = sorted(zip(asked, wrong, strict=True), key=lambda pair: not pair[1])
    explanations, tried = explain(
        variants(), [one for one, _ in order], partial(_relative, greeting.epsilon), describe
    )
    first = None if explanations else first_broken(judgements)
    return Diagnosis(explanations, None, first, (), tried)


def _relative(epsilon: float, case: Case) -> float:
    p = problem_of(case.inputs)
    return tolerance(p, epsilon) / max(float(np.abs(all_forces(p)).max()), 1e-3)
