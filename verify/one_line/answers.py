"""The answers to compare with programs, and the answers of right programs."""

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

# The largest numbers of small and large wrong answers, and small right answers, for comparison. A
# program has to give the first answer.
SMALL, LARGE, TRIAL = 9, 3, 1
# Of quarter turns rounding decides which of equal components a quaternion is made of.
TRIAL_OF_QUARTERS = 6
# A right program has to miss this number of answers before its lines are changed. Answers within
# all laws need as many before any mistake is named: many changes meet fewer by chance.
MIN_DIFFERENT = 3
# Cases with more passes of a right program through its loops are left out for their time, unless a
# pass is along a curve. A known fault may have additional loops.
MAX_PASSES, OF_CURVES = 200, 2000
ALONG_CURVES = ("resample", "robot_track")
# Cases stay if the shortest case has as many passes, like a constant number of sweeps.
LONGER = 3
# A wrong answer within so many tolerances of the right answer would fit too many causes.
NEAR = 3.0
# The law of sweeps unlike the textbook's and all known honest programs'.
ANOTHER = "one sweep, another"
# The input for a single iteration of a solver.
ITERATIONS = "max_iterations"


def doubtful_answers(report: TaskReport) -> tuple[list[CaseJudgement], bool]:
    """Return doubtful answers within all laws, and whether their mistake is known.

    These are sweeps unlike the textbook's, or else solves short of the nearest point. Without both,
    these are all sweeps within limits where all targets are reached.
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
    """Return whether a sweep is neither the textbook's nor a known honest program's."""
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
    """Return answers with their real number of sweeps in place of the requested number.

    Answers to requests with a tolerance are left out: a solver may ignore tolerances as well.
    """
    return [
        replace(e, case=replace(e.case, inputs={**e.case.inputs, ITERATIONS: count}))
        for e in compared
        if e.case.inputs["tolerance"] == 0.0
    ]


def without_near(
    compared: Sequence[Exchange], report: TaskReport, tolerance: float
) -> list[Exchange]:
    """Return answers without wrong answers too near to right answers to tell a cause."""
    near = {
        j.case.name
        for j in report.judgements
        if j.verdict >= Verdict.UNDECIDED
        and isinstance(j.answer, Answer)
        and difference(j.expected, j.answer.values) <= NEAR * tolerance
    }
    return [exchange for exchange in compared if exchange.case.name not in near]


def positions_alone(compared: Sequence[Exchange]) -> list[Exchange]:
    """Return the answers that have positions, without their other outputs."""
    positions = ((e, e.answer.values.get("positions")) for e in compared)  # type: ignore[union-attr]
    return [replace(e, answer=Answer({"positions": x}, 0.0)) for e, x in positions if x is not None]


def compare(
    program: Program,
    run: Callable[[Case], Mapping[str, Any]],
    compared: Sequence[Exchange],
    tolerance: float,
) -> tuple[list[Exchange], list[Exchange], dict[str, int]]:
    """Return the answers unlike a right program's, the equal answers, and the passes.

    The passes through its loops are by the names of cases; answers of too many are left out.
    """
    answers = [program.count_passes(partial(run, exchange.case)) for exchange in compared]
    most = max(MAX_PASSES, LONGER * min((count for _, count in answers), default=0))
    passes, different, same = dict[str, int](), list[Exchange](), list[Exchange]()
    for exchange, (right, count) in zip(compared, answers, strict=True):
        assert isinstance(exchange.answer, Answer)
        is_curve = exchange.case.task in ALONG_CURVES
        if count <= (OF_CURVES if is_curve else most):
            passes[exchange.case.name] = count
            is_same = difference(right, exchange.answer.values) <= tolerance
            (same if is_same else different).append(exchange)
    # Single iterations of another solver differ everywhere, and decide soon.
    single = [exchange for exchange in different if exchange.case.inputs.get(ITERATIONS) == 1]
    return (single if len(single) >= MIN_DIFFERENT else different), same, passes


def telling_answers(different: Sequence[Exchange], same: Sequence[Exchange]) -> list[Exchange]:
    """Return answers unlike a program's, then at most as many equal answers."""
    return [*different, *same[: max(len(different), MIN_DIFFERENT)]]


def trial_count(report: TaskReport) -> int:
    """Return of how many of the first answers a program has to give any."""
    return TRIAL_OF_QUARTERS if report.task == "forward_kinematics" else TRIAL
