"""Which answers are compared with programs, and how a right program answers them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..case import Case
from ..exchange import Answer, Exchange, Failure
from ..gaps import difference
from ..judgement import CaseJudgement, Finding, TaskReport, Verdict
from ..kinematics.sweeps import ROUNDED, PoseTrial
from ..kinematics.textbook import SOLVERS as METHODS
from ..laws import LAWS
from .mutants import Program
from .right_programs import comparable

# The most small and large wrong answers, and small right ones, that are compared with programs; a
# program has to give the first of them.
SMALL, LARGE, TRIAL = 9, 3, 1
# Of quarter turns rounding decides which of equal components a quaternion is made of.
TRIAL_OF_QUARTERS = 6
# So many answers a right program has to miss before its lines are changed, or, if they keep all
# laws, before any mistake is named: fewer would be met by many changes by chance.
MIN_DIFFERENT = 3
# Cases for which a right program goes through its loops more often are left out: they take long,
# unless a pass is along a curve. A known fault may have loops that the right program lacks.
MAX_PASSES, OF_CURVES = 200, 2000
# But not if they go as often through them for the shortest case, as a constant number of sweeps.
LONGER = 3
# A cause would be any that is as near, where a wrong answer is as near to the right one as so many
# tolerances.
NEAR = 3.0
# The law of sweeps that are neither the textbook's nor those of a known honest program.
ANOTHER = "one sweep, another"
# The input that asks for a single iteration of a solver.
ITERATIONS = "max_iterations"


def doubtful_answers(report: TaskReport) -> tuple[list[CaseJudgement], bool]:
    """Return answers that keep all laws but may be a mistake's, and whether it is a known one.

    These are sweeps that differ from the textbook's, or else solves that end short of the nearest
    point, or else all sweeps within limits where all targets are reached.
    """
    sweeps = [j for j in report.judgements if j.case.requirement == "must" and _is_single(j)]
    differing = [
        j
        for j in sweeps
        if any(map(_is_of_another, j.findings))
        and not PoseTrial(Exchange(j.case, j.answer, j.answer)).has_ended
    ]
    if differing:
        return differing, False
    short = [j for j in report.judgements if _misses(j, "nearest point")]
    if short and report.method in METHODS:
        return short, True
    limited = [j for j in report.judgements if "cones" in j.case.inputs]
    is_missed = any(_misses(judgement, "target reached") for judgement in limited)
    return [j for j in sweeps if j in limited], not is_missed


def _misses(judgement: CaseJudgement, law: str) -> bool:
    """Return whether an answer is reproached by a law."""
    return any(entry.verdict and entry.law == law for entry in judgement.findings)


def _is_of_another(entry: Finding) -> bool:
    """Return whether a sweep is not the textbook's, nor that of a known honest program."""
    return bool(entry.verdict) and entry.sentence.template == LAWS[ANOTHER]["sentence"]


def compared_answers(report: TaskReport, doubtful: Sequence[CaseJudgement]) -> list[Exchange]:
    """Return small and large answers, the wrong or doubtful answers first."""
    judgements = [
        judgement
        for judgement in report.judgements
        if judgement.case.requirement == "must" and _is_telling(judgement.case, judgement.answer)
    ]
    is_sweep = [j for j in judgements if "sweeps" in j.case.facts]
    if any(j.verdict >= Verdict.UNDECIDED for j in is_sweep):
        judgements = is_sweep
    judgements.sort(key=lambda j: j.case.size)
    wrong = [j for j in judgements if j.verdict >= Verdict.UNDECIDED or j in doubtful]
    right = [j for j in judgements if j not in wrong and not doubtful]
    telling = [*wrong[:SMALL], *wrong[SMALL:][-LARGE:], *right[:SMALL]]
    single = [j for j in right if _is_single(j) and j not in telling]
    telling += single if judgements is not is_sweep else []
    return [comparable(Exchange(j.case, j.answer, j.answer)) for j in telling if wrong]


def _is_single(judgement: CaseJudgement) -> bool:
    return bool(judgement.case.inputs.get(ITERATIONS) == 1)


def _is_telling(case: Case, answer: Answer | Failure) -> bool:
    """Return whether an answer has numbers alone, and not only zeros and numbers of the request."""
    if not isinstance(answer, Answer):
        return False
    names = {"local_rotations"} & answer.values.keys() or answer.values.keys()
    outputs = [np.asarray(answer.values[name], dtype=float) for name in names]
    inputs = [np.zeros(()), *(np.asarray(v) for v in case.inputs.values() if np.ndim(v) > 0)]
    is_new = (
        not any(_repeats(output, array) for array in inputs) and output.any() for output in outputs
    )
    return all(np.isfinite(output).all() for output in outputs) and any(is_new)


def _repeats(output: Any, array: Any) -> bool:
    """Return whether an output is an input, but for rounding and the signs of quaternions."""
    is_alike = np.shape(output) == np.shape(array)
    return is_alike and np.allclose(np.abs(output), np.abs(array), rtol=0.0, atol=ROUNDED)


def with_sweeps(compared: Sequence[Exchange], count: int) -> list[Exchange]:
    """Return answers with the number of sweeps that they have, whatever was asked.

    They are of requests without a tolerance, which a solver may not read either.
    """
    return [
        replace(e, case=replace(e.case, inputs={**e.case.inputs, ITERATIONS: count}))
        for e in compared
        if e.case.inputs["tolerance"] == 0.0
    ]


def without_near(
    compared: Sequence[Exchange], report: TaskReport, tolerance: float
) -> list[Exchange]:
    """Return answers without the wrong ones that are too near to right ones to tell a cause."""
    near = {
        j.case.name
        for j in report.judgements
        if j.verdict >= Verdict.UNDECIDED
        and isinstance(j.answer, Answer)
        and difference(j.expected, j.answer.values) <= NEAR * tolerance
    }
    return [exchange for exchange in compared if exchange.case.name not in near]


def positions_alone(exchange: Exchange) -> Exchange:
    """Return an answer with its positions alone."""
    assert isinstance(exchange.answer, Answer)
    return replace(exchange, answer=Answer({"positions": exchange.answer.values["positions"]}, 0.0))


def compare(
    program: Program,
    run: Callable[[Case], Mapping[str, Any]],
    compared: Sequence[Exchange],
    tolerance: float,
) -> tuple[list[Exchange], list[Exchange], dict[str, int]]:
    """Return the answers that a right program does not give, the answers that it gives, and passes.

    The passes through its loops are by the names of cases; answers of too many are left out.
    """
    answers = [program.count_passes(partial(run, exchange.case)) for exchange in compared]
    most = max(MAX_PASSES, LONGER * min((count for _, count in answers), default=0))
    passes, different, same = dict[str, int](), list[Exchange](), list[Exchange]()
    for exchange, (right, count) in zip(compared, answers, strict=True):
        assert isinstance(exchange.answer, Answer)
        is_curve = exchange.case.task == "resample"
        if count <= (OF_CURVES if is_curve else most):
            passes[exchange.case.name] = count
            is_same = difference(right, exchange.answer.values) <= tolerance
            (same if is_same else different).append(exchange)
    # Single iterations of another solver differ everywhere: they decide soon.
    single = [exchange for exchange in different if exchange.case.inputs.get(ITERATIONS) == 1]
    return (single if len(single) >= MIN_DIFFERENT else different), same, passes


def telling_answers(different: Sequence[Exchange], same: Sequence[Exchange]) -> list[Exchange]:
    """Return answers that a program does not give, then no more of the others."""
    return [*different, *same[: max(len(different), MIN_DIFFERENT)]]


def trial_count(report: TaskReport) -> int:
    """Return of how many of the first answers a program has to give any."""
    return TRIAL_OF_QUARTERS if report.task == "forward_kinematics" else TRIAL
