"""Name the faults of wrong speeds."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence, sentence, with_code

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..explain import Variant, either, explain
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Verdict
from . import robot_jacobian_diagnosis
from .faults import TABLE, sentences_of
from .formulas import evaluate
from .report import with_hints
from .robot_jacobian import CONVENTIONS, Convention, right_jacobian
from .robot_models import feature_of
from .robot_readings import RIGHT
from .robot_textbook import Inputs
from .robot_velocity import (
    FRAMES,
    LARGEST_LOSS,
    RANK,
    SINGULAR,
    Equation,
    right_equation,
    rounded_velocity,
    shortest_speeds,
    singular_values,
    solving,
)

# Beyond so many times from a division by a rounded zero.
ENDLESS = 1e9


# Mistakes in reading the velocity or solving for the speeds, by their keys.
READINGS = TABLE["robot_velocity"]


# Those that invert a singular matrix, which is so for robots with too few joints or too many.
TOO_FEW, TO_SPARE = "too few joints", "joints to spare"


CUT = "cut too large"


DIVIDED = "singular values of zero inverted"


# A factor of the linear, and one of the angular part of the tool's velocity; ratios agree so well.
WEIGHTS, SAME_WEIGHT = ("linear part weighted", "angular part weighted"), 1e-6


SENTENCES = sentences_of("robot_velocity") | {
    key: fault.sentence for key, fault in robot_jacobian_diagnosis.FAULTS.items()
}


# What speeds solve that are right at another point p than the tool's origin: formulas of a matrix
# and of the parts of the velocity.
POINTS = [
    ["J", "v + np.cross(w, x - p)", "w"],
    ["spatial", "v - np.cross(w, p)", "w"],
    ["np.concatenate([J[:3] + np.cross(T(J[3:]), p - x).T, J[3:]])", "v", "w"],
]


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain wrong speeds, likely those of the Jacobian."""
    judgements, base, diagnosis = judged_answers.report.judgements, judged_answers.base, Diagnosis()
    if any(judgement.verdict >= Verdict.WRONG for judgement in judgements):
        diagnosis = _diagnosis(judgements, judged_answers.greeting)
        likely = [_of_base(e, base or ()) for e in diagnosis.explanations
                  if base is None or e.share == 1.0 or set(e.faults) & set(base)]  # fmt: skip
        diagnosis = replace(diagnosis, explanations=tuple(likely))
    return with_hints(judgements, diagnosis)


def _of_base(explanation: Explanation, base: Sequence[str]) -> Explanation:
    """Return an explanation with the faults of the Jacobian alone, if it has any of them."""
    shared = tuple(fault for fault in explanation.faults if fault in base)
    if not shared:
        return explanation
    return replace(explanation, faults=shared, sentence=either([[SENTENCES[k]] for k in shared]))


def _readings(key: str, inputs: Inputs) -> Iterator[Equation]:
    """Yield the equations that speeds with a fault solve."""
    J, twist = right_equation(inputs)
    tool, spatial = (right_jacobian(inputs, CONVENTIONS[f"{frame}, linear part first"])
                     for frame in ("tool", "spatial"))  # fmt: skip
    frames = RIGHT.frames(inputs, inputs["q"])
    zero = RIGHT.frames(inputs, 0.0 * inputs["q"])
    names = {
        "J": J, "tool": tool, "spatial": spatial, "v": twist[:3], "w": twist[3:],
        "x": frames.position, "R": frames.rotation, "x0": zero.position, "R0": zero.rotation,
        "joints": frames.origins,
    }  # fmt: skip
    entry = READINGS[key]
    solved = [entry["solves"]] if "solves" in entry else POINTS
    names["p"] = evaluate(entry.get("point", "x"), names)
    for formulas in solved:
        matrix, *parts = (evaluate(formula, names) for formula in formulas)
        yield matrix, np.concatenate(parts)


def _in_rows(J: FloatArray, speeds: FloatArray, rank: int) -> FloatArray:
    """Return speeds without the part that a matrix of lower rank does not use.

    Right speeds solve an equation that lacks rows too, but not with the least length.
    """
    inverse = np.linalg.pinv(J, RANK)
    return inverse @ J @ speeds if np.linalg.matrix_rank(inverse) < rank else speeds


def _truncated(equation: Equation, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the speeds nearest to an answer without the smallest singular values, and the shares
    of the largest that the smallest used and the largest unused are.
    """  # noqa: D205 -- the sentence is long
    J, twist = equation
    U, s, V = np.linalg.svd(J, full_matrices=False)
    sums = np.cumsum((U.T @ twist / np.maximum(s, 1e-300))[:, None] * V, axis=0)
    count = 1 + int(np.abs(sums - speeds).max(axis=-1).argmin())
    return sums[count - 1], np.append(s, 0.0)[count - 1 : count + 1] / s[0]


def _answer(
    entry: Mapping[str, str], equation: Equation, speeds: FloatArray, largest: float
) -> FloatArray:
    """Return the speeds of a fault's formula.

    Of singular values s, vectors V, velocities b along them, and a damping d that follows from the
    factor f of the part that tells most.
    """
    J, twist = equation
    U, s, V = np.linalg.svd(J, full_matrices=False)
    rank = max(int(np.sum(s > RANK * s[0])), 1)
    s, b, V = s[:rank], (twist @ U)[:rank], V[:rank]
    i = int(np.argmax(np.abs(b) / s))
    d = evaluate(entry.get("damping", "0"), {"s": s[i], "f": (V @ speeds)[i] / b[i]})
    names = {"right": b / s @ V, "largest": largest, "s": s, "b": b, "V": V, "d": d}
    return np.asarray(evaluate(entry["answer"], names))


# The speeds nearest to an answer that programs with a fault answer, given also the largest speed.
ANSWERS: Mapping[str, Callable[[Equation, FloatArray, float], FloatArray]] = {
    CUT: lambda equation, speeds, largest: _truncated(equation, speeds)[0],
    **{key: partial(_answer, entry) for key, entry in READINGS.items() if "answer" in entry},
}


def _by_jacobian(key: str, inputs: Inputs) -> Iterator[Equation]:
    """Yield the equations that speeds solve with a wrong Jacobian."""
    for J in robot_jacobian_diagnosis.FAULTS[key].jacobians(inputs, inputs["q"]):
        yield J, right_equation(inputs)[1]


def _nearest(
    answers: Mapping[str, FloatArray],
    equations: Callable[[Inputs], Iterable[Equation]],
    loss: float,
    case: Case,
) -> dict[str, Any]:
    """Return the speeds nearest to an answer that solve an equation of a fault."""
    speeds, rank = answers[case.name], len(singular_values(case.inputs, case.inputs["q"]))
    solutions = [
        solving(equation, _in_rows(equation[0], speeds, rank), loss)[0]
        for equation in equations(case.inputs)
    ]
    return {
        "velocities": min(solutions, key=lambda solution: float(np.abs(solution - speeds).max()))
    }


def _diagnosis(judgements: Sequence[CaseJudgement], greeting: Greeting) -> Diagnosis:
    """Return the faults that explain most answers, of wrong answers first."""
    key = _without_number(judgements) or _inverted(judgements)
    if key:
        return Diagnosis((Explanation((key,), SENTENCES[key], 1.0, 0.0),))
    ordered = sorted(judgements, key=lambda judgement: (-judgement.verdict, -judgement.case.size))
    answers = {
        judgement.case.name: _velocities(judgement)
        for judgement in ordered
        if _is_number(judgement) and judgement.case.family != SINGULAR
    }
    largest = max((float(np.abs(speeds).max()) for speeds in answers.values()), default=0.0)

    def answer(key: str, frame: Convention, case: Case) -> dict[str, Any]:
        speeds = answers[case.name]
        return {"velocities": ANSWERS[key](right_equation(case.inputs, frame), speeds, largest)}

    nearest = partial(_nearest, answers)
    readings = [key for key, entry in READINGS.items() if {"solves", "point"} & entry.keys()]
    variants = [
        *(Variant((key,), partial(answer, key, frame)) for key in ANSWERS for frame in FRAMES),
        *(Variant((key,), partial(nearest, partial(_readings, key),
                                  READINGS[key].get("loss", LARGEST_LOSS))) for key in readings),
        *(Variant((key,), partial(nearest, partial(_by_jacobian, key), LARGEST_LOSS))
          for key in robot_jacobian_diagnosis.FAULTS if key != "angular part missing"),
    ]  # fmt: skip
    explanations, count = explain(
        variants,
        [Exchange(judgement.case, judgement.answer, judgement.answer)
         for judgement in ordered if judgement.case.name in answers],
        partial(rounded_velocity, greeting=greeting),
        lambda keys: either([[SENTENCES[key]] for key in keys]),
        trial=2,
        failing=[j.case.name for j in ordered if j.verdict >= Verdict.WRONG],
    )  # fmt: skip
    is_certain = bool(explanations) and explanations[0].share == 1.0
    if not is_certain and (weighted := _weighted(judgements)):
        return Diagnosis((weighted,), variant_count=count)
    hints = feature_of(judgements) if not explanations else ()
    if explanations and explanations[0].faults == (CUT,):
        hints = (_cut(judgements, answers),)
    return Diagnosis(explanations, hints=hints, variant_count=count)


def _cut(judgements: Sequence[CaseJudgement], answers: Mapping[str, FloatArray]) -> Sentence:
    """Return the shares of the largest singular value, in the likelier frame, of the cut."""
    cases = [judgement.case for judgement in judgements if judgement.case.name in answers]
    cuts = [[(right_equation(case.inputs, frame), answers[case.name]) for case in cases]
            for frame in FRAMES]  # fmt: skip
    nearest = min(cuts, key=lambda pairs: sum(
        float(np.abs(_truncated(*pair)[0] - pair[1]).max()) for pair in pairs
    ))  # fmt: skip
    retained, dropped = np.transpose([_truncated(*pair)[1] for pair in nearest])
    return sentence("You drop singular values up to {dropped:.2g} of the largest and use those "
                    "from {kept:.2g} of it.", dropped=dropped.max(),
                    kept=retained.min())  # fmt: skip


def _velocities(judgement: CaseJudgement) -> FloatArray:
    assert isinstance(judgement.answer, Answer)
    return np.asarray(judgement.answer.values["velocities"])


def _is_number(judgement: CaseJudgement) -> bool:
    """Return whether a case has an answer of numbers."""
    return isinstance(judgement.answer, Answer) and bool(np.isfinite(_velocities(judgement)).all())


def _is_endless(judgement: CaseJudgement) -> bool:
    """Return whether speeds are no numbers, or far beyond those of least length."""
    least = np.abs(shortest_speeds(right_equation(judgement.case.inputs))).max()
    return not np.abs(_velocities(judgement)).max() <= ENDLESS * least


def _without_number(judgements: Sequence[CaseJudgement]) -> str:
    """Return the fault of which wrong answers are no numbers in poses that lack a rank, or ""."""
    wrong = [judgement for judgement in judgements if judgement.verdict >= Verdict.WRONG]
    answered = [judgement for judgement in wrong if isinstance(judgement.answer, Answer)]
    is_divided = [
        _is_endless(judgement)
        and len(singular_values(judgement.case.inputs, judgement.case.inputs["q"]))
        < min(6, len(judgement.case.inputs["q"]))
        for judgement in answered
    ]
    return DIVIDED if len(answered) == len(wrong) and all(is_divided) else ""


def _weighted(judgements: Sequence[CaseJudgement]) -> Explanation | None:
    """Return the factor that one part of the tool's velocity has in all answers of six freedoms."""
    ratios = dict[str, list[float]]()
    for judgement in judgements:
        J, twist = right_equation(judgement.case.inputs)
        is_whole = _is_number(judgement) and np.linalg.matrix_rank(J, RANK * np.abs(J).max()) == 6
        if judgement.case.family == SINGULAR or not is_whole:
            continue
        given, asked = (J @ _velocities(judgement)).reshape(2, 3), twist.reshape(2, 3)
        factors = (given * asked).sum(axis=1) / (asked * asked).sum(axis=1)
        gaps = np.abs(given - factors[:, None] * asked).max(axis=1)
        is_told = (gaps <= SAME_WEIGHT * np.abs(asked).max(axis=1)).all()
        for key, factor, other in zip(WEIGHTS, factors, factors[::-1], strict=True):
            is_alone = is_told and abs(other - 1.0) <= SAME_WEIGHT
            ratios.setdefault(key, []).append(float(factor) if is_alone else np.nan)
    for key, values in ratios.items():
        factor = values[0]
        is_same = np.abs(np.array(values) - factor) <= SAME_WEIGHT * abs(factor)
        if len(values) > 2 and is_same.all() and abs(factor - 1.0) > SAME_WEIGHT:
            words = Sentence(READINGS[key]["sentence"], {"factor": factor})
            return Explanation((key,), with_code(READINGS[key]["code"], words), 1.0, 0.0)
    return None


def _inverted(judgements: Sequence[CaseJudgement]) -> str:
    """Return the fault of a matrix that is singular just where answers are wrong, or ""."""
    regular = [judgement for judgement in judgements if judgement.case.family != SINGULAR]
    is_wrong = [judgement.verdict >= Verdict.WRONG for judgement in regular]
    shapes = [(len(singular_values(judgement.case.inputs, judgement.case.inputs["q"])),
               len(judgement.case.inputs["q"])) for judgement in regular]  # fmt: skip
    if is_wrong == [rank < 6 for rank, _ in shapes]:
        return TOO_FEW
    return TO_SPARE if is_wrong == [rank < joints for rank, joints in shapes] else ""
