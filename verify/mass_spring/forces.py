"""The task mass_spring_forces: its cases and its judgement."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.mass_spring import forces as reference_forces
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..cause_search import CauseSearch
from ..contestant import Answer, Exchange
from ..explain import TRIAL, Variant, either, explain, first_broken
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Finding, TaskReport, Verdict
from ..laws import digits, finding, hints_of, judge_case
from .cases import task_cases
from .faults import FORCE_FAULTS, Option, apply, pairs
from .formulas import evaluate
from .laws import not_finite, symmetry
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
from .relations import Sample, fitted, relation_of

TASK = "mass_spring_forces"
# Rounding of a length by the coordinates' epsilon, times the stiffness, and of some ten terms.
ROUNDINGS = 8.0
# An error is like a force if the cosine of the angle between them is larger.
ALIKE = 0.7


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return cases that suit the solver, the smallest first."""
    return task_cases(TASK, greeting, seed, thorough)


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
    cause_search: CauseSearch | None = None,
) -> TaskReport:
    """Hold the forces against the formula and the balance of momentum, and name the faults."""
    judgements = [_judge_case(exchange, exchanges, greeting) for exchange in exchanges]
    unexplained = Diagnosis(first_broken=first_broken(judgements), hints=hints_of(judgements))
    find_faults = partial(_diagnose, judgements, exchanges, greeting)
    diagnosis = (cause_search or CauseSearch()).run(find_faults, unexplained)
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


def _predict(
    faults: tuple[Option, ...], problems: Mapping[str, SpringProblem], case: Case
) -> Mapping[str, Any]:
    return {"forces": forces_with(faults, problems[case.name])}


def forces_with(faults: Sequence[Option], p: SpringProblem) -> FloatArray:
    """Return the forces of a solver with faults."""
    p = apply(faults, p, StepModel())[0]
    output = next((fault.output for fault in faults if fault.output), None)
    return np.asarray(evaluate(output, p)) if output else all_forces(p)


def variants(
    exchanges: Sequence[Exchange], epsilon: float, sentences: dict[str, Sentence]
) -> Iterator[Variant]:
    """Yield the right formula, its faults, another combination of its terms, and pairs of faults.

    The sentence of each fault is noted by its key.
    """
    problems = {exchange.case.name: problem_of(exchange.case.inputs) for exchange in exchanges}
    answers = [
        (problems[exchange.case.name], exchange.answer.values["forces"])
        for exchange in exchanges
        if isinstance(exchange.answer, Answer)
    ]

    def difference(fault: Option) -> FloatArray:
        return np.concatenate(
            [(forces_with((fault,), p) - f).ravel() / max(np.abs(f).max(), 1e-3)
             for p, f in answers[:TRIAL]]
        )  # fmt: skip

    samples = [
        Sample(f, partial(evaluate, p=p), tolerance(p, epsilon))
        for p, f in answers
        if np.isfinite(f).all()
    ]
    usual = [fault for fault in FORCE_FAULTS if fault.rare != "relation"]
    singles = (fault for fault in usual if fault.at is None)
    fits = (fitted(fault, difference, epsilon) for fault in usual if fault.at is not None)
    relations = (relation_of(name, samples) for name in ("forces",))
    special = filter(None, chain(fits, relations))
    for faults in chain([()], zip(singles), zip(special), pairs(usual)):
        sentences.update((fault.key, fault.sentence) for fault in faults)
        keys = tuple(fault.key for fault in faults)
        is_special = any(fault.range or fault.rare == "relation" for fault in faults)
        yield Variant(keys, partial(_predict, faults, problems), is_special)


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
    sentences = {"": sentence("")}
    explanations, count = explain(
        variants(telling, greeting.epsilon, sentences), telling, relative_tolerance,
        lambda keys: either([[sentences[fault] for fault in key.split(" + ")] for key in keys]),
        failing=[judgements[i].case.name for i in order if wrong[i]],
    )  # fmt: skip
    explanations = tuple(explanation for explanation in explanations if explanation.faults != ("",))
    first = None if explanations else first_broken(judgements)
    return Diagnosis(explanations, None, first, hints_of(judgements, bool(explanations)), count)
