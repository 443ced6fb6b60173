"""Name the faults of wrong energies."""

from collections.abc import Sequence
from functools import partial
from itertools import islice, product

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import sentence

from ..cause_search import JudgedAnswers
from ..contestant import Answer
from ..explain import either
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Verdict,
    first_broken,
)
from ..laws import hints_of
from .energy import ADDENDS, PARTS, SUMS, Answers, Energies, predict, sum_of, tolerance
from .faults import ENERGY_FAULTS, pairs
from .formulas import evaluate
from .options import Option
from .problem import (
    SpringProblem,
    problem_of,
)
from .relations import Sample, fitted, relation_of

MAX_EXPLANATIONS = 3


# The number of wrong answers to which a fault's number is fitted: more have more local minima.
FITTED = 8


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the energies, if some are wrong."""
    judgements, epsilon = judged_answers.report.judgements, judged_answers.greeting.epsilon
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
    return sum_of(name, faults, energies) if name in SUMS else predict(faults, p)[name]


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
