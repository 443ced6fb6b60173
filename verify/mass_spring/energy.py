"""The task energy: its cases and its judgement.

Zero of the gravitational energy is where the solver has it: the states of a case are asked in
several places, and only differences to the first of them count.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice, product
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import kinetic_energy, potential_energy
from plumbob.text.sentence import sentence

from ..case import Case
from ..cause_search import CauseSearch
from ..contestant import Answer, Exchange
from ..explain import either, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import digits, finding, hints_of, judge_case
from .cases import task_cases
from .faults import ENERGY_FAULTS, Option, apply, pairs
from .formulas import evaluate
from .laws import not_finite
from .model import StepModel
from .problem import (
    SpringProblem,
    all_forces,
    elastic_energy,
    problem_of,
    state_of,
    system_of,
)
from .relations import Sample, fitted, relation_of

TASK = "energy"
Energies = Mapping[str, Any]
PARTS = ("total", "kinetic", "potential", "elastic", "gravitational")
SUMS = {"total": ("kinetic", "potential"), "potential": ("elastic", "gravitational")}
ADDENDS = ("kinetic", "elastic", "gravitational")
# Those of which each has a formula of its own.
FORMULAS = ("kinetic", "elastic")
ROUNDINGS = 16.0
MAX_EXPLANATIONS = 3
# The number of wrong answers to which a fault's number is fitted: more have more local minima.
FITTED = 8
# Gauss points that integrate the force along a displacement of a tenth of a spring to rounding.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, most of them followed by the same case displaced."""
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
    cause_search: CauseSearch | None = None,
) -> TaskReport:
    """Hold the energies against formulas and the work of forces, and name the faults."""
    judgements = [_judge_case(exchange, exchanges, greeting) for exchange in exchanges]
    unexplained = Diagnosis(first_broken=first_broken(judgements), hints=hints_of(judgements))
    find_faults = partial(_diagnose, judgements, greeting.epsilon)
    diagnosis = (cause_search or CauseSearch()).run(find_faults, unexplained)
    return TaskReport(TASK, "", judgements, diagnosis)


def predict(faults: Sequence[Option], p: SpringProblem) -> dict[str, float]:
    """Return all energies by the formulas, as a solver with these faults has them [J]."""
    p, _ = apply(faults, p, StepModel())
    kinetic = 0.5 * (p.masses[:, None] * p.velocities**2).sum()
    parts = np.array([kinetic, elastic_energy(p), -(p.constant * p.positions).sum()])
    for fault in faults:
        parts *= fault.parts or 1.0
        if fault.energy and fault.energy[0] in ADDENDS:
            parts[ADDENDS.index(fault.energy[0])] = evaluate(fault.formula, p)
    energies = dict(zip(ADDENDS, parts.tolist(), strict=True))
    return {name: _sum(name, faults, energies) for name in SUMS} | energies


def _sum(whole: str, faults: Sequence[Option], energies: Energies) -> float:
    """Return the total or the potential energy of these parts, as faults of sums have it [J]."""
    factors = {part: 1.0 for part in ADDENDS if whole == "total" or part != "kinetic"}
    for fault in faults:
        if fault.energy[:1] != (whole,):
            continue
        if fault.formula:
            return float(evaluate(fault.formula, None, energies))
        named = SUMS["potential"] if fault.energy[1] == "potential" else fault.energy[1:2]
        factors |= dict.fromkeys(named, fault.energy[2])
    return sum(factor * energies[part] for part, factor in factors.items())


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
    expected, allowed = predict((), p), tolerance(p, greeting.epsilon)
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
        sums["total"] = abs(energies["total"] - _sum("total", (), energies))
    return sums


def _work(
    p: SpringProblem, q: SpringProblem, before: Energies, after: Energies
) -> dict[str, float]:
    """Return how far changes of energies are from the work of forces between the two states."""
    return {
        name: abs(after[name] - before[name] + work)
        for name, work in works(p, q).items()
        if name in before and name in after
    }


def works(p: SpringProblem, q: SpringProblem) -> dict[str, float]:
    """Return by energy the work of forces along the line between two states [J].

    The total changes by the kinetic energy gained, less the work.
    """
    before, d = p, q.positions - p.positions
    p = p.changed(velocities=np.zeros_like(p.velocities))
    elastic = 0.0
    for t, weight in zip(POINTS, WEIGHTS, strict=True):
        forces = all_forces(p.changed(positions=p.positions + 0.5 * (1.0 + t) * d)) - p.constant
        elastic += 0.5 * weight * float((forces * d).sum())
    gravitational = float((p.constant * d).sum())
    potential = elastic + gravitational
    gained = predict((), q)["kinetic"] - predict((), before)["kinetic"]
    return {
        "elastic": elastic,
        "gravitational": gravitational,
        "potential": potential,
        "total": potential - gained,
    }


def _diagnose(judgements: Sequence[CaseJudgement], epsilon: float) -> Diagnosis:
    answers = [
        (problem_of(judgement.case.inputs), judgement.answer.values)
        for judgement in judgements
        if isinstance(judgement.answer, Answer)
        and np.isfinite(list(judgement.answer.values.values())).all()
    ]
    if not answers or all(judgement.verdict < Verdict.WRONG for judgement in judgements):
        return Diagnosis()
    hints, first = hints_of(judgements), first_broken(judgements)
    if not any(any(values[name] for name in values.keys() & PARTS) for _, values in answers):
        return Diagnosis(first_broken=sentence("Every energy is 0 in all cases."), hints=hints)
    if set(ADDENDS) <= answers[0][1].keys():
        mistakes, share = _by_energy(judgements, answers, epsilon)
    else:
        mistakes, share = _together(answers, epsilon), 1.0
    if not mistakes:
        return Diagnosis(first_broken=first, hints=hints)
    keys = [" + ".join(fault.key for fault in faults) for faults in mistakes]
    message = either([[fault.sentence for fault in faults] for faults in mistakes])
    explanation = Explanation(tuple(keys[:MAX_EXPLANATIONS]), message, share, 0.0)
    return Diagnosis((explanation,), None, None if share == 1.0 else first, hints)


Answers = Sequence[tuple[SpringProblem, Energies]]


def _by_energy(
    judgements: Sequence[CaseJudgement], answers: Answers, epsilon: float
) -> tuple[list[tuple[Option, ...]], float]:
    """Return the faults that explain each wrong energy by itself, and the share of those."""
    named = answers[0][1].keys()
    wrong = {
        str(entry.sentence.values.get("name"))
        for judgement in judgements
        for entry in judgement.findings
        if entry.verdict >= Verdict.WRONG
    }
    groups = [
        _mistakes(name, answers, epsilon)
        for name in PARTS
        if name in named and (name in wrong or name in SUMS)
        if not _explains((), name, answers, epsilon)
    ]
    explained = [group for group in groups if group]
    share = len(explained) / max(len(groups), 1)
    if not explained:
        return [], share
    keys = [{fault.key for fault in group} for group in explained]
    if common := [fault for fault in explained[0] if all(fault.key in group for group in keys)]:
        return [(fault,) for fault in common[:MAX_EXPLANATIONS]], share
    return list(islice(product(*explained), MAX_EXPLANATIONS)), share


def _mistakes(name: str, answers: Answers, epsilon: float) -> list[Option]:
    """Return the faults that give all answers of an energy, else one with a number that they tell.

    The last resort is another combination of known terms.
    """

    def difference(fault: Option) -> FloatArray:
        gaps = [(_expected((fault,), name, p, e) - e[name]) / tolerance(p, epsilon)
                for p, e in wrong[:FITTED]]  # fmt: skip
        return np.array(gaps)

    wrong = [answer for answer in answers if not _explains((), name, [answer], epsilon)]
    concerned = [
        fault
        for fault in ENERGY_FAULTS
        if fault.rare != "relation"
        and (fault.energy[:1] == (name,) or not (fault.energy or name in SUMS))
    ]
    samples = [
        Sample(np.array([e[name]]), partial(evaluate, p=p, values=e), 4.0 * tolerance(p, epsilon))
        for p, e in answers
    ]
    plain = (fault for fault in concerned if fault.at is None)
    fits = (fitted(fault, difference, 1.0) for fault in concerned if fault.at is not None)
    relation = (relation_of(name, samples) for _ in range(1))
    for faults in (plain, filter(None, fits), filter(None, relation)):
        if matching := [fault for fault in faults if _explains((fault,), name, answers, epsilon)]:
            return matching
    return []


def _expected(faults: Sequence[Option], name: str, p: SpringProblem, energies: Energies) -> float:
    """Return an energy of a solver with faults, a sum from the answered parts."""
    return _sum(name, faults, energies) if name in SUMS else predict(faults, p)[name]


def _explains(faults: Sequence[Option], name: str, answers: Answers, epsilon: float) -> bool:
    """Return whether faults, or the formula if there are none, give all answers of an energy."""
    return all(
        abs(e[name] - _expected(faults, name, p, e))
        <= 8.0 * (tolerance(p, epsilon) + epsilon * abs(e[name]))
        for p, e in answers
    )


def _together(answers: Answers, epsilon: float) -> list[tuple[Option, ...]]:
    """Return the fewest faults that explain all answers, at most two."""
    usual = [fault for fault in ENERGY_FAULTS if fault.rare != "relation" and fault.at is None]
    for groups in ([()], zip(usual), pairs(usual)):
        matches = [
            faults
            for faults in groups
            if all(_matches(predict(faults, p), p, values, epsilon) for p, values in answers)
        ]
        if matches:
            return [faults for faults in matches if faults]
    return []


def _matches(expected: Energies, p: SpringProblem, answers: Energies, epsilon: float) -> bool:
    limit = 8.0 * tolerance(p, epsilon)
    return all(abs(answers[name] - expected[name]) <= limit for name in answers.keys() & PARTS)
