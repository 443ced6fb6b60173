"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from plumbob.reference.mass_spring import forces as reference_forces

from ..case import Case
from ..contestant import Answer, Asked
from ..explain import Variant, either, explain, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws
from .cases import task_cases
from .faults import FORCE_FAULTS, Option
from .problem import (
    Problem,
    all_forces,
    damper_forces,
    problem_of,
    spring_forces,
    state_of,
    system_of,
)

TASK = "mass_spring_forces"
MOST_FAULTS = 3
# Rounding of a length by the coordinates' epsilon, times the stiffness, and of some ten terms.
ROUNDINGS = 8.0


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(asked: Sequence[Asked], greeting: Greeting, method: str) -> TaskReport:
    """Hold the forces against the formula and the balance of momentum, and name the faults."""
    judgements = [_judge_case(one, asked, greeting) for one in asked]
    return TaskReport(TASK, "", judgements, _diagnose(asked, judgements, greeting))


def tolerance(p: Problem, epsilon: float) -> float:
    """Return how far rounding may take a force [N]."""
    size = float(np.abs(p.positions).max() + p.rest_lengths.max(initial=0.0))
    speed = float(np.abs(p.velocities).max())
    springs = np.abs(p.incidence).T @ (p.stiffnesses * size + p.dampings * speed)
    weights = p.masses * float(np.linalg.norm(p.gravity))
    return ROUNDINGS * epsilon * float((springs + weights).max())


def _judge_case(one: Asked, asked: Sequence[Asked], greeting: Greeting) -> CaseJudgement:
    p = problem_of(one.case.inputs)
    system, state = system_of(p), state_of(p)
    expected, seconds = timed(lambda: reference_forces(system, state))
    if not isinstance(one.answer, Answer):
        return CaseJudgement(one.case, one.answer, (), {"forces": expected}, None, seconds)
    given, allowed = one.answer.values["forces"], tolerance(p, greeting.epsilon)
    findings = _findings(one, asked, p, expected, allowed)
    size, gap = float(np.abs(expected).max()), float(np.abs(given - expected).max())
    digits = None
    if size > allowed and np.isfinite(gap):
        digits = float(min(16.0, max(0.0, -np.log10(max(gap / size, 1e-16)))))
    return CaseJudgement(
        one.case, one.answer, tuple(findings), {"forces": expected}, digits, seconds
    )


def _findings(
    one: Asked, asked: Sequence[Asked], p: Problem, expected: Any, allowed: float
) -> list[Finding]:
    assert isinstance(one.answer, Answer)
    given = one.answer.values["forces"]
    if not np.isfinite(given).all():
        said = sentence("Forces hold NaN or infinity.")
        return [Finding("finite numbers", Verdict.BROKEN, np.inf, 0.0, "", said)]
    found = [_formula(p, given, expected, allowed), _balance(p, given, allowed)]
    limits = {"forces": 2.0 * allowed}
    bases = [other.answer for other in asked if other.case.name == one.case.facts.get("of")]
    if bases and isinstance(bases[0], Answer):
        found.append(laws.symmetry(one, bases[0], limits))
    found.append(laws.equal_requests(one, ("forces",), limits))
    found += [Finding("remarks", Verdict.RIGHT_BUT, 0, 0, "", said) for said in one.answer.remarks]
    return found


def _formula(p: Problem, given: Any, expected: Any, allowed: float) -> Finding:
    gap = np.abs(given - expected).max(axis=1)
    where, worst = int(gap.argmax()), float(gap.max())
    said = sentence(
        "The force on particle {where} is {gap:.2g} N off {term}.",
        where=where, gap=worst, term=_term(p, given - expected),
    )  # fmt: skip
    verdict = Verdict.RIGHT if worst <= allowed else Verdict.WRONG
    return Finding("force formula", verdict, worst, allowed, "N", said, where)


def _term(p: Problem, error: Any) -> Sentence:
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


def _balance(p: Problem, given: Any, allowed: float) -> Finding:
    """Springs and dampers pull both ends alike: the sum of forces is the weight."""
    gap = float(np.abs(given.sum(0) - p.constant.sum(0)).max())
    limit = allowed * np.sqrt(p.count) * 2.0
    said = sentence("The sum of all forces is {gap:.2g} N off the weight.", gap=gap)
    verdict = Verdict.RIGHT if gap <= limit else Verdict.WRONG
    return Finding("momentum balance", verdict, gap, limit, "N", said)


def _predict(faults: tuple[Option, ...], case: Case) -> Mapping[str, Any]:
    p = problem_of(case.inputs)
    for fault in faults:
        assert fault.change is not None
        p = fault.change(p)
    return {"forces": all_forces(p)}


def variants() -> Iterator[Variant]:
    """Yield the right formula's faults, up to three of different aspects."""
    for count in range(1, MOST_FAULTS + 1):
        for faults in combinations(FORCE_FAULTS, count):
            if len({one.aspect for one in faults}) == count:
                keys = tuple(one.key for one in faults)
                yield Variant(keys, partial(_predict, faults))


_BY_KEY = {one.key: one.sentence for one in FORCE_FAULTS}


def describe(keys: Sequence[str]) -> Sentence:
    """Return the sentences of faults, given the keys of a class that no answer tells apart."""
    return either([[_BY_KEY[one] for one in key.split(" + ")] for key in keys])


def _diagnose(
    asked: Sequence[Asked], judgements: Sequence[CaseJudgement], greeting: Greeting
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
