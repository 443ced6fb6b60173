"""Speeds of robots' joints that give the tool a velocity, of least length or not, damped or not."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from plumbob.reference import Articulation
from plumbob.reference.arguments import FloatArray
from plumbob.reference.jacobians import jacobian
from plumbob.text.sentence import Sentence, sentence, with_code

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange, Failure
from ..explain import Variant, either, explain
from ..greeting import Greeting
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..laws import finding, judge_case, not_finite
from . import robot_jacobian, robot_models, rounding
from .faults import TABLE, sentences_of
from .formulas import evaluate
from .report import report, with_hints
from .robot_faults import RIGHT
from .robot_jacobian import CONVENTIONS, Convention, right_jacobian
from .robot_models import feature_of, mechanism
from .robot_textbook import Inputs
from .skeletons import suits

TASK = "robot_velocity"
_SEED = 1969
# Singular values below this share of the largest are zero.
RANK = 1e-6
# The largest ratio of singular values in poses that are not singular, and how many are drawn.
CONDITION, DRAWS = 60.0, 400
# Damping that takes more than this share of the velocity away, far from singularities, is a fault.
LARGEST_LOSS = 0.25
# Speeds beyond so many times those of least length come from a division by almost zero.
FACTOR = 1e3
# Beyond so many times from a division by a rounded zero.
ENDLESS = 1e9
SINGULAR = "a singular pose"
# Mistakes in reading the velocity or solving for the speeds, by their keys.
READINGS = TABLE["robot_velocity"]
# Those that invert a singular matrix, which is so for robots with too few joints or too many.
TOO_FEW, TO_SPARE = "too few joints", "joints to spare"
CUT = "cut too large"
DIVIDED = "singular values of zero inverted"
# A factor of the linear, and one of the angular part of the tool's velocity; ratios agree so well.
WEIGHTS, SAME_WEIGHT = ("linear part weighted", "angular part weighted"), 1e-6
SENTENCES = sentences_of("robot_velocity") | {
    key: fault.sentence for key, fault in robot_jacobian.FAULTS.items()
}
# Frames in which the singular values of a Jacobian differ.
FRAMES = [CONVENTIONS[f"{frame}, linear part first"] for frame in ("world", "spatial")]
# What speeds solve that are right at another point p than the tool's origin: formulas of a matrix
# and of the parts of the velocity.
POINTS = [
    ["J", "v + np.cross(w, x - p)", "w"],
    ["spatial", "v - np.cross(w, p)", "w"],
    ["np.concatenate([J[:3] + np.cross(T(J[3:]), p - x).T, J[3:]])", "v", "w"],
]
# A Jacobian, and the velocity that the speeds give by it.
Equation = tuple[FloatArray, FloatArray]


def cases(greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
    """Return robots of one joint to seven, in random poses and in a singular one."""
    rng = np.random.default_rng([_SEED, seed])
    return [
        case
        for name, robot in robot_models.robots(rng).items()
        if suits(robot["parents"], greeting, robot["effector"])
        for case in _cases_of(name, robot, rng, 4 if thorough else 2)
    ]


def _cases_of(
    name: str, robot: Mapping[str, Any], rng: np.random.Generator, count: int
) -> Iterator[Case]:
    draws = rng.uniform(robot["lower"], robot["upper"], (DRAWS, len(robot["lower"])))
    rank = len(_singular_values(robot, draws[0]))
    regular = (q for q in draws if _is_regular(_singular_values(robot, q), rank))
    for number, q in enumerate(islice(regular, count)):
        yield _case(f"{name}, pose {number + 1}", robot, q, rng, "any pose")
    zero = np.zeros(len(robot["lower"]))
    if len(_singular_values(robot, zero)) < rank:
        case = _case(f"{name}, {SINGULAR}", robot, zero, rng, SINGULAR)
        yield replace(case, requirement="may")


def _case(
    name: str, robot: Mapping[str, Any], q: FloatArray, rng: np.random.Generator, family: str
) -> Case:
    """Return a request for a velocity that the tool can have."""
    J = jacobian(mechanism(robot), q, -1)
    twist = J @ (rng.choice([-1.0, 1.0], len(q)) * rng.uniform(0.5, 1.5, len(q)))
    velocities = {"linear_velocity": twist[:3], "angular_velocity": twist[3:]}
    inputs = {**robot, "q": q, **velocities, "urdf": robot_models.urdf(robot)}
    about = sentence("A robot of {joints} joints.", joints=len(q))
    facts = {"size": max(robot_models.size_of(robot), 1.0)}
    return Case(name, TASK, inputs, family, about, facts=facts)


def _singular_values(robot: Mapping[str, Any], q: FloatArray) -> FloatArray:
    """Return the singular values of the Jacobian other than zero, the largest first."""
    values = np.linalg.svd(jacobian(mechanism(robot), q, -1), compute_uv=False)
    return np.array(values[values > RANK * values[0]])


def _is_regular(values: FloatArray, rank: int) -> bool:
    return len(values) == rank and bool(values[0] <= CONDITION * values[-1])


def _equation(inputs: Inputs, frame: Convention = FRAMES[0]) -> Equation:
    """Return the equation that right speeds solve, in the world or for the point at its origin."""
    twist = np.concatenate([inputs["linear_velocity"], inputs["angular_velocity"]])
    tool = RIGHT.frames(inputs, inputs["q"])
    return right_jacobian(inputs, frame), frame(twist[:, None], tool.position, tool.rotation)[:, 0]


def _shortest(equation: Equation) -> FloatArray:
    """Return the speeds of least length that solve an equation."""
    J, twist = equation
    return np.asarray(np.linalg.pinv(J, RANK) @ twist)


def _speeds(robot: Articulation, q: FloatArray, twist: FloatArray) -> FloatArray:
    """Return the same from the robot itself: what is timed."""
    return _shortest((jacobian(robot, q, -1), twist))


def solving(
    equation: Equation, speeds: FloatArray, largest_loss: float = 1.0
) -> tuple[FloatArray, float]:
    """Return the speeds that solve an equation, those nearest to an answer, and their damping d.

    Along a singular vector damped least squares give s b / (s^2 + d^2) for the velocity b
    (Wampler 1986), which is less than b / s by the share d^2 / (s^2 + d^2); what the speeds are in
    the null space is free. The damping explains the speed along the vector on which it tells most.
    """
    J, twist = equation
    U, s, V = np.linalg.svd(J, full_matrices=False)
    rank = max(int(np.sum(s > RANK * s[0])), 1)
    s, b, V = s[:rank], (twist @ U)[:rank], V[:rank]
    c, square = V @ speeds, 0.0
    i = int(np.argmax(np.abs(b) / np.maximum(s, 1e-300)))
    if c[i]:
        square = max(float(s[i] * b[i] / c[i] - s[i] ** 2), 0.0)
    if largest_loss < 1.0:
        square = min(square, float(s[-1]) ** 2 * largest_loss / (1.0 - largest_loss))
    parts = s * b / np.maximum(s**2 + square, 1e-300)
    return speeds + (parts - c) @ V, float(np.sqrt(square))


def judge(
    exchanges: Sequence[Exchange],
    greeting: Greeting,
    method: str,
) -> TaskReport:
    """Judge speeds by the tool's velocity."""
    judgements = [_judgement(exchange, greeting) for exchange in exchanges]
    is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    return report(TASK, method, judgements, None if is_wrong else _behaviour(judgements, greeting))


def diagnose(judged: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain wrong speeds, likely those of the Jacobian."""
    judgements, base, diagnosis = judged.report.judgements, judged.base, Diagnosis()
    if any(judgement.verdict >= Verdict.WRONG for judgement in judgements):
        diagnosis = _diagnosis(judgements, judged.greeting)
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


def _judgement(exchange: Exchange, greeting: Greeting) -> CaseJudgement:
    case = exchange.case
    equation = _equation(case.inputs)
    laws = partial(_findings, case, equation, greeting)
    shortest = _shortest(equation)
    allowed = _rounded(case, greeting) * max(1.0, float(np.abs(shortest).max()))
    rank = len(_singular_values(case.inputs, case.inputs["q"]))
    expected = {"velocities": shortest} if rank == len(shortest) else {}
    reference = partial(_speeds, mechanism(case.inputs), case.inputs["q"], equation[1])
    judgement = judge_case(exchange, laws, allowed, reference, expected)
    if case.family == SINGULAR and isinstance(exchange.answer, Failure):
        failure = exchange.answer.sentence
        judgement = replace(judgement, findings=(finding("speeds, failure", failure=failure),))
    return judgement


def _rounded(case: Case, greeting: Greeting) -> float:
    """Return how far rounding moves speeds of 1 rad/s, and what they do to the tool."""
    joints = len(case.inputs["q"])
    return CONDITION * rounding.positions(greeting.epsilon, joints, case.facts["size"])


def _findings(
    case: Case, equation: Equation, greeting: Greeting, outputs: Mapping[str, Any]
) -> Iterator[Finding]:
    speeds, is_singular = outputs["velocities"], case.family == SINGULAR
    if not np.isfinite(speeds).all():
        yield not_finite("speeds, no number" if is_singular else "numbers, of a joint", speeds)
        return
    if is_singular:
        yield finding("speeds", np.abs(speeds).max() / np.abs(_shortest(equation)).max(), FACTOR)
    J, twist = equation
    bound = _rounded(case, greeting) * max(1.0, float(np.abs(speeds).max()))
    nearest, damping = solving(equation, speeds)
    loss = float(np.linalg.norm(J @ speeds - twist) / np.linalg.norm(twist))
    is_damped = np.abs(nearest - speeds).max() <= bound and (is_singular or loss <= LARGEST_LOSS)
    key = "velocity of the tool, damped" if is_damped else "velocity of the tool"
    verdict = Verdict.RIGHT_EXCEPT if is_singular else None
    error = float(np.abs(J @ speeds - twist).max())
    yield finding(key, error, bound, verdict=verdict, damping=damping, loss=loss)


def _behaviour(judgements: Sequence[CaseJudgement], greeting: Greeting) -> Sentence:
    """Return whether the speeds of robots with joints to spare are of least length."""
    for judgement in judgements:
        J, _ = _equation(judgement.case.inputs)
        if isinstance(judgement.answer, Answer) and judgement.case.family != SINGULAR:
            speeds = judgement.answer.values["velocities"]
            excess = np.abs(speeds - _shortest((J, J @ speeds))).max()
            if excess > _rounded(judgement.case, greeting) * max(1.0, np.abs(speeds).max()):
                return sentence("Joints also move where that does not move the tool.")
    return sentence("Among the speeds that solve a request it gives those of least length.")


def _readings(key: str, inputs: Inputs) -> Iterator[Equation]:
    """Yield the equations that speeds with a fault solve."""
    J, twist = _equation(inputs)
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
    for J in robot_jacobian.FAULTS[key].jacobians(inputs, inputs["q"]):
        yield J, _equation(inputs)[1]


def _nearest(
    answers: Mapping[str, FloatArray],
    equations: Callable[[Inputs], Iterable[Equation]],
    loss: float,
    case: Case,
) -> dict[str, Any]:
    """Return the speeds nearest to an answer that solve an equation of a fault."""
    speeds, rank = answers[case.name], len(_singular_values(case.inputs, case.inputs["q"]))
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
        return {"velocities": ANSWERS[key](_equation(case.inputs, frame), speeds, largest)}

    nearest = partial(_nearest, answers)
    readings = [key for key, entry in READINGS.items() if {"solves", "point"} & entry.keys()]
    variants = [
        *(Variant((key,), partial(answer, key, frame)) for key in ANSWERS for frame in FRAMES),
        *(Variant((key,), partial(nearest, partial(_readings, key),
                                  READINGS[key].get("loss", LARGEST_LOSS))) for key in readings),
        *(Variant((key,), partial(nearest, partial(_by_jacobian, key), LARGEST_LOSS))
          for key in robot_jacobian.FAULTS if key != "angular part missing"),
    ]  # fmt: skip
    explanations, count = explain(
        variants,
        [Exchange(judgement.case, judgement.answer, judgement.answer)
         for judgement in ordered if judgement.case.name in answers],
        partial(_rounded, greeting=greeting),
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
    cuts = [[(_equation(case.inputs, frame), answers[case.name]) for case in cases]
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
    least = np.abs(_shortest(_equation(judgement.case.inputs))).max()
    return not np.abs(_velocities(judgement)).max() <= ENDLESS * least


def _without_number(judgements: Sequence[CaseJudgement]) -> str:
    """Return the fault of which wrong answers are no numbers in poses that lack a rank, or ""."""
    wrong = [judgement for judgement in judgements if judgement.verdict >= Verdict.WRONG]
    answered = [judgement for judgement in wrong if isinstance(judgement.answer, Answer)]
    is_divided = [
        _is_endless(judgement)
        and len(_singular_values(judgement.case.inputs, judgement.case.inputs["q"]))
        < min(6, len(judgement.case.inputs["q"]))
        for judgement in answered
    ]
    return DIVIDED if len(answered) == len(wrong) and all(is_divided) else ""


def _weighted(judgements: Sequence[CaseJudgement]) -> Explanation | None:
    """Return the factor that one part of the tool's velocity has in all answers of six freedoms."""
    ratios = dict[str, list[float]]()
    for judgement in judgements:
        J, twist = _equation(judgement.case.inputs)
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
    shapes = [(len(_singular_values(judgement.case.inputs, judgement.case.inputs["q"])),
               len(judgement.case.inputs["q"])) for judgement in regular]  # fmt: skip
    if is_wrong == [rank < 6 for rank, _ in shapes]:
        return TOO_FEW
    return TO_SPARE if is_wrong == [rank < joints for rank, joints in shapes] else ""
