"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import forces as reference_forces

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, first_broken
from ..laws import digits, finding, hints_of, judge_case
from .cases import task_cases
from .laws import not_finite, symmetry
from .problem import SpringProblem, problem_of, state_of, system_of

TASK = "mass_spring_forces"
# Rounding of a length by the coordinates' epsilon, times the stiffness, and of some ten terms.
ROUNDINGS = 8.0


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Hold the forces against the formula and the balance of momentum."""
    judgements = [_judge_case(exchange, exchanges, greeting) for exchange in exchanges]
    first = first_broken(judgements, "equal answers") or first_broken(judgements)
    diagnosis = Diagnosis(first_broken=first, hints=hints_of(judgements))
    return TaskReport(TASK, "", judgements, diagnosis)


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
            yield not_finite(case, "forces")
            return
        yield _formula(output, forces, allowed)
        yield _balance(p, output, allowed)
        yield from filter(None, [symmetry(exchange, exchanges, {"forces": 2.0 * allowed})])

    size = float(np.abs(forces).max())
    if isinstance(answer, Answer) and size > allowed:
        correct_digits = digits(float(np.abs(answer.values["forces"] - forces).max()), size)
    expected = {"forces": forces}
    return judge_case(exchange, findings, 2.0 * allowed, reference, expected, correct_digits)


def _formula(output: FloatArray, expected: FloatArray, allowed: float) -> Finding:
    gap = np.abs(output - expected).max(axis=1)
    return finding("force formula", gap.max(), allowed, index=int(gap.argmax()))


def _balance(p: SpringProblem, output: FloatArray, allowed: float) -> Finding:
    """Springs and dampers pull both ends alike: the sum of forces is the weight."""
    gap = np.abs(output.sum(0) - p.constant.sum(0)).max()
    return finding("momentum balance", gap, allowed * np.sqrt(p.count) * 2.0)
