"""The task energy: its cases and its judgement.

The solver chooses the zero of the gravitational energy. The states of a case are asked in several
places, and only differences to the first place count.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from plumbob.reference.mass_spring import kinetic_energy, potential_energy
from plumbob.text.sentence import sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    Finding,
    TaskReport,
    first_broken,
)
from ..laws import digits, finding, hints_of, judge_case
from .cases import task_cases
from .laws import not_finite
from .problem import (
    SpringProblem,
    elastic_energy,
    problem_of,
    state_of,
    system_of,
)

TASK = "energy"
Energies = Mapping[str, Any]
SUMS = {"total": ("kinetic", "potential"), "potential": ("elastic", "gravitational")}
ADDENDS = ("kinetic", "elastic", "gravitational")
# Those of which each has a formula of its own.
FORMULAS = ("kinetic", "elastic")
ROUNDINGS = 16.0


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return suitable cases, mostly followed by the same case displaced."""
    pairs = ([case] if "of" in case.facts else [case, _displaced(case, seed)]
             for case in task_cases(TASK, greeting, seed, thorough))  # fmt: skip
    return [case for pair in pairs for case in pair]


def _displaced(case: Case, seed: int) -> Case:
    """Return the same system a little elsewhere."""
    x = case.inputs["positions"]
    rng = np.random.default_rng([13, seed, len(x)])
    return replace(
        case,
        name=case.name + ", displaced",
        inputs=dict(case.inputs)
        | {
            "positions": x + 0.02 * rng.standard_normal(x.shape),
            "velocities": 1.25 * case.inputs["velocities"],
        },
        about=sentence("The previous case with displaced particles."),
        facts=dict(case.facts) | {"from": case.name},
    )


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Hold the energies against formulas and the work of forces."""
    judgements = [_judge_case(exchange, exchanges, greeting) for exchange in exchanges]
    answers = [j.answer.values for j in judgements if isinstance(j.answer, Answer)]
    is_zero = bool(answers) and not any(any(values.values()) for values in answers)
    first = sentence("Every energy is 0 in all cases.") if is_zero else first_broken(judgements)
    diagnosis = Diagnosis(first_broken=first, hints=hints_of(judgements))
    return TaskReport(TASK, "", judgements, diagnosis)


def predict(p: SpringProblem) -> dict[str, float]:
    """Return all energies by the formulas [J]."""
    kinetic = 0.5 * float((p.masses[:, None] * p.velocities**2).sum())
    elastic, gravitational = elastic_energy(p), -float((p.constant * p.positions).sum())
    potential = elastic + gravitational
    return {
        "total": kinetic + potential,
        "kinetic": kinetic,
        "potential": potential,
        "elastic": elastic,
        "gravitational": gravitational,
    }


def tolerance(p: SpringProblem, epsilon: float) -> float:
    """Return how far rounding may take an energy [J]."""
    x, rest = np.abs(p.positions), p.rest_lengths.max(initial=0.0)
    stretch = np.abs(p.incidence @ p.positions).max(initial=0.0) + rest
    terms = float((p.stiffnesses * (x.max() + rest) * stretch).sum())
    terms += float((p.masses[:, None] * p.velocities**2).sum())
    terms += float((p.masses[:, None] * x * np.abs(p.gravity).max()).sum())
    return ROUNDINGS * epsilon * terms + 1e-300


def _judge_case(
    exchange: Exchange, exchanges: Sequence[Exchange], greeting: Greeting
) -> CaseJudgement:
    case, answer = exchange.case, exchange.answer
    p = problem_of(case.inputs)
    system, state = system_of(p), state_of(p)
    expected, allowed = predict(p), tolerance(p, greeting.epsilon)
    outputs = answer.values if isinstance(answer, Answer) else {}
    gaps = {name: abs(outputs[name] - expected[name]) for name in FORMULAS if name in outputs}
    before = next((e for e in exchanges if e.case.name == case.facts.get("from")), None)

    def findings(energies: Energies) -> Iterator[Finding]:
        if not np.isfinite(list(energies.values())).all():
            yield not_finite(case, "energies")
            return
        for name, gap in gaps.items():
            yield finding("energy formula", gap, allowed, law=name, name=name)
        for name, gap in _sums(energies).items():
            yield finding("sum of energies", gap, 4.0 * allowed, name=name)
        if before is not None and isinstance(before.answer, Answer):
            start = problem_of(before.case.inputs)
            for name, gap in _work(start, p, before.answer.values, energies).items():
                yield finding("energy and work", gap, 4.0 * allowed, name=name)

    size = max(expected[name] for name in FORMULAS)
    return judge_case(
        exchange, findings, allowed,
        lambda: potential_energy(system, state.positions) + kinetic_energy(system, state),
        expected, digits(max(gaps.values()), size) if gaps and size > allowed else None,
    )  # fmt: skip


def _sums(energies: Energies) -> dict[str, float]:
    """Return how far energies are from the sums of their parts, where all of them are known."""
    sums = {
        whole: abs(energies[whole] - sum(energies[name] for name in parts))
        for whole, parts in SUMS.items()
        if {whole, *parts} <= energies.keys()
    }
    if "total" not in sums and {"total", *ADDENDS} <= energies.keys():
        sums["total"] = abs(energies["total"] - sum(energies[name] for name in ADDENDS))
    return sums


def _work(
    p: SpringProblem, q: SpringProblem, before: Energies, after: Energies
) -> dict[str, float]:
    """Return how far changes of energies between two states are from the work of forces.

    The zero of gravity is where the solver has it, so that only changes of a potential count.
    """
    start, end = predict(p), predict(q)
    return {
        name: abs((after[name] - before[name]) - (end[name] - start[name]))
        for name in ("elastic", "gravitational", "potential", "total")
        if name in before and name in after
    }
