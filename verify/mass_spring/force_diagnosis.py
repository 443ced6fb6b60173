"""Name the faults of wrong forces."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..explain import TRIAL, Variant, either, explain
from ..judgement import Diagnosis, Verdict, first_broken
from ..laws import hints_of
from .faults import FORCE_FAULTS, pairs
from .forces import tolerance
from .formulas import evaluate
from .model import StepModel
from .options import Option, apply
from .problem import (
    SpringProblem,
    all_forces,
    problem_of,
)
from .relations import Sample, fitted, relation_of


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


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the forces, if some are wrong."""
    judgements, exchanges, greeting = (
        judged_answers.report.judgements,
        judged_answers.exchanges,
        judged_answers.greeting,
    )
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
