"""Name the faults of wrong Jacobians."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from plumbob.reference.arguments import BoolArray, FloatArray
from plumbob.text.sentence import Sentence, sentence

from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..greeting import Greeting
from ..judgement import LEAST_SHARE, Diagnosis, Explanation, Verdict
from .formulas import evaluate
from .report import with_hints
from .robot_faults import FAULTS as POSE_FAULTS
from .robot_faults import JACOBIAN_FAULTS
from .robot_jacobian import (
    CONVENTIONS,
    Convention,
    best_convention,
    jacobian_bound,
    jacobian_gap,
    right_jacobian,
)
from .robot_readings import RobotFault

# A fault is compared with all answers only if it explains one of the first.
TRIAL = 2


# A fault explains an answer if it leaves this share of the answer's error: rounding is larger in
# differences.
REMAINDER = 1e-4


# What programs with a fault answer.
FAULTS: Mapping[str, RobotFault] = {
    key: fault
    for key, fault in (JACOBIAN_FAULTS | POSE_FAULTS).items()
    if not (fault.relative or fault.is_of_target)
}


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the Jacobians, if some are wrong."""
    judgements, diagnosis = judged_answers.report.judgements, Diagnosis()
    if any(judgement.verdict >= Verdict.WRONG for judgement in judgements):
        _, matches = best_convention(judged_answers.exchanges, judged_answers.greeting)
        wrong, right = (
            [
                exchange
                for exchange in judged_answers.exchanges
                if matches.get(exchange.case.name) is value
            ]
            for value in (False, True)
        )
        diagnosis = _diagnosis(wrong, right, judged_answers.greeting)
    return with_hints(judgements, diagnosis)


def _share(fault: RobotFault, exchanges: Sequence[Exchange], greeting: Greeting) -> float:
    """Return the share of the answers that a fault explains in one of the conventions.

    Right answers that the fault does not change are not counted; those that it would are.
    """
    conventions = CONVENTIONS.values()
    is_right, is_explained = np.zeros((2, len(exchanges), len(conventions)), dtype=bool)
    for i, exchange in enumerate(exchanges):
        if i == TRIAL and not is_explained.any():
            return 0.0
        inputs = exchange.case.inputs
        frames = fault.frames(inputs, inputs["q"])
        answer = fault.rules.get("answer", "J")
        columns = fault._replace(rules={**fault.rules, "answer": "J"})
        jacobians = list(columns.jacobians(inputs, inputs["q"]))
        for k, convention in enumerate(conventions):
            predictions = (
                evaluate(answer, {"J": convention(J, frames.position, frames.rotation)})
                for J in jacobians
            )
            bound, error = (
                jacobian_bound(exchange.case, greeting),
                jacobian_gap(exchange, right_jacobian(inputs, convention)),
            )
            is_right[i, k] = error <= bound
            gap = min(jacobian_gap(exchange, J) for J in predictions)
            is_explained[i, k] = gap <= max(bound, REMAINDER * error)
    explained, counted = is_explained & ~is_right, ~(is_explained & is_right)
    return float((explained.sum(axis=0) / np.maximum(counted.sum(axis=0), 1)).max())


# Groups of which only one may be wrong, and the parts of columns that they have: by whether a part
# is angular, of a slide, of the joint that carries the tool and of one at the base.
GROUPS: Sequence[tuple[Sentence, Callable[..., BoolArray]]] = (
    (sentence("the linear parts of hinges"), lambda part, slide, last, first: ~part & ~slide),
    (sentence("the angular parts of hinges"), lambda part, slide, last, first: part & ~slide),
    (sentence("the columns of slides"), lambda part, slide, last, first: slide),
    (sentence("the last columns"), lambda part, slide, last, first: last),
    (sentence("the first columns"), lambda part, slide, last, first: first),
    (sentence("the columns of hinges"), lambda part, slide, last, first: ~slide),
)  # fmt: skip


def _relation(exchanges: Sequence[Exchange], greeting: Greeting) -> tuple[Sentence, ...]:
    """Return the factors, or else the only parts, by which all answers differ from a convention."""
    best, share = tuple[Sentence, ...](), 0.0
    for name, convention in CONVENTIONS.items():
        columns = [_columns(exchange, name, convention, greeting) for exchange in exchanges]
        answer, right, bound, *flags = (np.concatenate(x) for x in zip(*columns, strict=True))
        is_right = np.abs(answer - right).max(axis=-1) <= bound
        groups = [(words, has_parts(*np.array(flags, dtype=bool))) for words, has_parts in GROUPS]
        factors = [(answer * right)[group].sum() / max((right[group] ** 2).sum(), 1e-300)
                   for _, group in groups[:3]]  # fmt: skip
        scale = sum(f * group for f, (_, group) in zip(factors, groups, strict=False))
        if (np.abs(answer - scale[:, None] * right).max(axis=-1) <= bound).all():
            words = sentence(
                "Your numbers are the right ones times a factor: {linear:.6g} in the linear parts "
                "of hinges, {angular:.6g} in their angular parts, {slide:.6g} in slides.",
                linear=factors[0], angular=factors[1], slide=factors[2],
            )  # fmt: skip
            return (words,) if np.ptp(factors) > REMAINDER else ()  # else laws.py says it
        only = [words for words, group in groups if is_right[~group].all()]
        if only and is_right.mean() > share:
            words = sentence("Only {what} of your Jacobians are wrong: all else is right.",
                             what=only[0])  # fmt: skip
            best, share = (words,), float(is_right.mean())
    return best


def _columns(
    exchange: Exchange, name: str, convention: Convention, greeting: Greeting
) -> Sequence[FloatArray]:
    """Return the answer's and the right parts of columns, (part, 3), bounds, and flags of each."""
    assert isinstance(exchange.answer, Answer)
    inputs = exchange.case.inputs
    shift = 3 if "angular part first" in name else 0
    pair = exchange.answer.values["jacobian"], right_jacobian(inputs, convention)
    parts = [np.roll(J, shift, axis=0).reshape(2, 3, -1).swapaxes(1, 2) for J in pair]
    joints = np.arange(len(inputs["q"]))
    flags = (inputs["slides"], joints == inputs["effector"], inputs["parents"] < 0)
    bounds = np.full(2 * len(joints), jacobian_bound(exchange.case, greeting))
    return (
        *(part.reshape(-1, 3) for part in parts),
        bounds,
        np.repeat([0, 1], len(joints)),
        *(np.tile(x, 2) for x in flags),
    )


def _diagnosis(
    wrong: Sequence[Exchange], right: Sequence[Exchange], greeting: Greeting
) -> Diagnosis:
    """Return the fault that explains most Jacobians, wrong ones with many joints first."""
    if not wrong:
        return Diagnosis()
    exchanges = [*sorted(wrong, key=lambda exchange: -len(exchange.case.inputs["q"])), *right]
    shares = {
        key: min(_share(fault, exchanges, greeting), _share(fault, wrong, greeting))
        for key, fault in FAULTS.items()
    }
    key = max(shares, key=shares.__getitem__, default="")
    if not key or shares[key] < LEAST_SHARE:
        return Diagnosis(hints=_relation(exchanges, greeting), variant_count=len(FAULTS))
    explanation = Explanation((key,), FAULTS[key].sentence, shares[key], 0.0)
    return Diagnosis((explanation,), variant_count=len(FAULTS))
