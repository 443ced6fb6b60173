"""The task energy: its cases and its judgement.

Zero of the gravitational energy is where the solver has it: the states of a case are asked in
several places, and only differences to the first of them count.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from plumbob.reference.mass_spring import kinetic_energy, potential_energy

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import either, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..sentence import sentence
from ..timing import timed
from . import laws
from .cases import task_cases
from .faults import GRAVITY, SPRINGS, Option, combined, faults_of
from .problem import (
    SpringProblem,
    all_forces,
    elastic_energy,
    problem_of,
    state_of,
    system_of,
)
from .rounding import correct_digits

TASK = "energy"
Values = Mapping[str, Any]
PARTS = ("total", "kinetic", "potential", "elastic", "gravitational")
# Those of which each has a formula of its own.
FORMULAS = ("kinetic", "elastic")
ROUNDINGS = 16.0
# Gauss points that integrate the force along a displacement of a tenth of a spring to rounding.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, most of them followed by a displaced one."""
    return [
        one
        for case in task_cases(TASK, greeting, seed, thorough)
        for one in ((case,) if "of" in case.facts else (case, _displaced(case, seed)))
    ]


def _displaced(case: Case, seed: int) -> Case:
    """Return the same system a little elsewhere."""
    x = case.inputs["positions"]
    rng = np.random.default_rng([13, seed, len(x)])
    return replace(
        case,
        name=case.name + ", displaced",
        inputs=dict(case.inputs) | {"positions": x + 0.02 * rng.standard_normal(x.shape)},
        about=sentence("The case before, its particles displaced."),
        facts=dict(case.facts) | {"from": case.name},
    )


def judge(asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
    """Hold the energies against formulas and the work of forces, and name the faults."""
    judgements = [_judge_case(one, asked, greeting) for one in asked]
    return TaskReport(TASK, "", judgements, _diagnose(asked, judgements, greeting))


def right(p: SpringProblem) -> dict[str, float]:
    """Return all energies by the formulas [J]."""
    kinetic = 0.5 * float((p.masses[:, None] * p.velocities**2).sum())
    return _sums(kinetic, elastic_energy(p), -float((p.constant * p.positions).sum()))


def _sums(kinetic: float, elastic: float, gravitational: float) -> dict[str, float]:
    potential = elastic + gravitational
    values = (kinetic + potential, kinetic, potential, elastic, gravitational)
    return dict(zip(PARTS, values, strict=True))


def tolerance(p: SpringProblem, epsilon: float) -> float:
    """Return how far rounding may take an energy [J]."""
    x, v = np.abs(p.positions), np.abs(p.velocities)
    size = float(x.max() + p.rest_lengths.max(initial=0.0))
    stretch = np.abs(p.incidence @ p.positions).max(initial=0.0) + p.rest_lengths.max(initial=0.0)
    terms = float((p.stiffnesses * size * stretch).sum())
    terms += float((p.masses[:, None] * v**2).sum())
    terms += float((p.masses[:, None] * x * np.abs(p.gravity).max()).sum())
    return ROUNDINGS * epsilon * terms + 1e-300


def _judge_case(one: Exchange, asked: Sequence[Exchange], greeting: Greeting) -> CaseJudgement:
    p = problem_of(one.case.inputs)
    system, state = system_of(p), state_of(p)
    _, seconds = timed(
        lambda: potential_energy(system, state.positions) + kinetic_energy(system, state)
    )
    expected, allowed = right(p), tolerance(p, greeting.epsilon)
    if not isinstance(one.answer, Answer):
        return CaseJudgement(one.case, one.answer, (), expected, None, seconds)
    given = one.answer.values
    findings = tuple(_findings(one, one.answer, asked, p, allowed))
    errors = [abs(given[name] - expected[name]) for name in FORMULAS if name in given]
    size, worst = max(expected[name] for name in FORMULAS), max(errors, default=np.nan)
    digits = correct_digits(worst, size) if size > allowed and worst >= 0.0 else None
    return CaseJudgement(one.case, one.answer, findings, expected, digits, seconds)


def _findings(
    one: Exchange, answer: Answer, asked: Sequence[Exchange], p: SpringProblem, allowed: float
) -> list[Finding]:
    given, expected = answer.values, right(p)
    if not np.isfinite(list(given.values())).all():
        return [laws.no_numbers(sentence("Energies hold NaN or infinity."))]
    gaps = {name: abs(given[name] - expected[name]) for name in FORMULAS if name in given}
    found = [
        laws.bounded(name, gap, allowed, "J", sentence(
            "The {name} energy is {gap:.2g} J off its formula.", name=name, gap=gap))
        for name, gap in gaps.items()
    ]  # fmt: skip
    found += _sum_laws(given, allowed)
    before = next((o for o in asked if o.case.name == one.case.facts.get("from")), None)
    if before is not None and isinstance(before.answer, Answer):
        found += _work(problem_of(before.case.inputs), p, before.answer.values, given, allowed)
    found.append(laws.equal_requests(one, dict.fromkeys(PARTS, allowed)))
    return found + laws.remarks(answer)


def _sum_laws(given: Values, allowed: float) -> list[Finding]:
    """Return whether the parts add up, where all of them were answered."""
    found = []
    for whole, parts in (
        ("total", ("kinetic", "potential")),
        ("potential", ("elastic", "gravitational")),
    ):
        if all(name in given for name in (whole, *parts)):
            gap = abs(given[whole] - sum(given[name] for name in parts))
            said = sentence(
                "The {whole} energy is {gap:.2g} J off the sum of its parts.", whole=whole, gap=gap
            )
            found.append(laws.bounded("sum of energies", gap, 4.0 * allowed, "J", said))
    return found


def _work(
    p: SpringProblem, q: SpringProblem, before: Values, after: Values, allowed: float
) -> list[Finding]:
    """Return whether energies change by the work of forces between the two states."""
    found = []
    for name, work in works(p, q).items():
        if name not in before or name not in after:
            continue
        gap = abs((after[name] - before[name]) + work)
        said = sentence(
            "From one place to another the {name} energy changes by {gap:.2g} J other than by the "
            "work of the forces.",
            name=name,
            gap=gap,
        )
        found.append(laws.bounded("energy and work", gap, 4.0 * allowed, "J", said))
    return found


def works(p: SpringProblem, q: SpringProblem) -> dict[str, float]:
    """Return the work of forces along the line from one state to the other, by energy [J]."""
    d = q.positions - p.positions
    still = p.changed(velocities=0.0 * p.velocities)
    elastic = sum(
        0.5 * weight * float(
            ((all_forces(still.changed(positions=p.positions + 0.5 * (1.0 + t) * d))
              - p.constant) * d).sum()
        )
        for t, weight in zip(POINTS, WEIGHTS, strict=True)
    )  # fmt: skip
    gravitational = float((p.constant * d).sum())
    return {
        "elastic": elastic,
        "gravitational": gravitational,
        "potential": elastic + gravitational,
        "total": elastic + gravitational,
    }


_OF_FORCES = ("first end only", "second end only", "both ends alike",
              "last spring of a particle only", "direction not normalised",
              "springs push", "springs twice", "tension only ignored")  # fmt: skip
FAULTS = (
    *faults_of("kinetic", {
        "kinetic without 1/2": ({"parts": (2.0, 1.0, 1.0)}, sentence(
            "The kinetic energy lacks its 1/2: it is m/2 v².")),
        "kinetic missing": ({"parts": (0.0, 1.0, 1.0)}, sentence("The kinetic energy is missing.")),
        "kinetic without mass": (
            lambda p: p.changed(masses=np.ones(p.count), weighing=p.masses), sentence(
            "The kinetic energy lacks the mass: it is m/2 v².")),
        "kinetic subtracted": ({"parts": (-1.0, 1.0, 1.0)}, sentence(
            "The kinetic energy is subtracted.")),
    }),
    *faults_of("elastic", {
        "elastic without 1/2": ({"parts": (1.0, 2.0, 1.0)}, sentence(
            "The elastic energy lacks its 1/2: it is k/2 (l - r)².")),
        "elastic missing": ({"parts": (1.0, 0.0, 1.0)}, sentence("The elastic energy is missing.")),
        "elastic subtracted": ({"parts": (1.0, -1.0, 1.0)}, sentence(
            "The elastic energy is subtracted.")),
    }),
    *(one for one in SPRINGS if one.key not in _OF_FORCES),
    *GRAVITY[:-3],
)  # fmt: skip


def predict(faults: Sequence[Option], p: SpringProblem) -> dict[str, float]:
    """Return the energies that a solver with these faults answers."""
    factors = np.ones(3)
    for fault in faults:
        factors = factors * fault.fields.get("parts", 1.0)
        p = fault.change(p) if fault.change is not None else p
    values = right(p)
    parts = (values["kinetic"], values["elastic"], values["gravitational"])
    return _sums(*(float(f * part) for f, part in zip(factors, parts, strict=True)))


def _diagnose(
    asked: Sequence[Exchange], judgements: Sequence[CaseJudgement], greeting: Greeting
) -> Diagnosis:
    answered = [
        (problem_of(one.case.inputs), one.answer.values)
        for one in asked
        if isinstance(one.answer, Answer)
    ]
    if not answered or all(one.verdict < Verdict.WRONG for one in judgements):
        return Diagnosis()
    tried = 0
    for _, same_size in groupby(combined(FAULTS), key=len):
        matches = []
        for faults in same_size:
            tried += 1
            if all(_matches(faults, *one, greeting.epsilon) for one in answered):
                matches.append(faults)
        if matches:
            keys = tuple(" + ".join(one.key for one in faults) for faults in matches)[:3]
            said = either([[one.sentence for one in faults] for faults in matches])
            return Diagnosis((Explanation(keys, said, 1.0, 0.0),), variant_count=tried)
    return Diagnosis(first_broken=first_broken(judgements), variant_count=tried)


def _matches(faults: Sequence[Option], p: SpringProblem, given: Values, epsilon: float) -> bool:
    expected = predict(faults, p)
    limit = 8.0 * tolerance(p, epsilon)
    return all(abs(given[name] - expected[name]) <= limit for name in PARTS if name in given)
