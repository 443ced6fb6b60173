"""Explain wrong steps by undeclared honest steps, or by early ends of iterations."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import msgspec
import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..cause_search import JudgedAnswers
from ..greeting import Step
from ..judgement import Diagnosis, Explanation, Verdict
from ..laws import laws_that_hold, proportion_of
from . import iterations
from .honest import compatible, honest, model_of
from .model_search import Probe, gap_of, honest_options
from .position_based import DECLARATION
from .stepping import Recognition, describe_model, recognise

# The number of small cases in which the nearest step is sought: the last, where methods differ.
COMPARED = 4
# A step that differs by a larger share of the displacement has nothing to say about the answers.
NEAR = 0.1


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return which other honest step, or end of iterations, explains wrong answers."""
    report, greeting, search = (
        judged_answers.report, judged_answers.greeting, judged_answers.search,
    )  # fmt: skip
    diagnosis = replace(report.diagnosis, explanations=())
    if not any(judgement.verdict >= Verdict.UNDECIDED for judgement in report.judgements):
        return diagnosis
    recognition = recognise(report.exchanges, greeting)
    model, probes, start = recognition.model, recognition.probes, greeting.step.start
    stages = (
        partial(_undeclared_step, recognition),
        partial(iterations.explanation, model, probes, start, greeting.epsilon),
    )
    is_compared = recognition.telling and not recognition.is_position_based
    for stage in stages if is_compared and recognition.is_known else ():
        explanation = search.run(stage, None)
        if explanation is not None:
            return replace(diagnosis, explanations=(explanation,), first_broken=None, hints=())
    return _with_hints(diagnosis, judged_answers, recognition)


def _with_hints(
    diagnosis: Diagnosis, judged_answers: JudgedAnswers, recognition: Recognition
) -> Diagnosis:
    """Return a diagnosis without an explanation, with what is known of the answers."""
    judgements, greeting = judged_answers.report.judgements, recognition.greeting
    telling, run = recognition.telling, judged_answers.search.run
    stiffness = partial(
        iterations.stiffness_hint, recognition.model, recognition.probes, greeting.epsilon
    )
    if telling and not recognition.is_position_based and (hint := run(stiffness, None)) is not None:
        return replace(diagnosis, hints=(hint,))
    hints = diagnosis.hints
    worst = max(judgement.verdict for judgement in judgements)
    if worst >= Verdict.WRONG:
        hints += proportion_of(judgements)
    is_open = greeting.step.method is None or worst == Verdict.UNDECIDED
    if telling and diagnosis.behaviour is None and is_open:
        nearest = run(partial(_nearest, telling, recognition), None)
        hints += (*filter(None, [nearest]), laws_that_hold(judgements))
    return replace(diagnosis, hints=hints)


def _undeclared_step(recognition: Recognition) -> Explanation | None:
    """Return the honest step that all probes are of, which the greeting denies."""
    greeting = recognition.greeting
    declared = greeting.step
    if declared == Step() or recognition.match:
        return None
    undeclared = msgspec.structs.replace(greeting, step=Step(substeps=declared.substeps))
    other = recognise(recognition.exchanges, undeclared)
    if not other.match:
        return None
    integrator = other.model.integrator
    if declared.method == "local_global" and integrator[::2] == ("local_global", 1):
        return None  # its iterations end after the first one
    words = sentence(
        "It differs from the declared step and behaves like this: {what}.",
        what=other.description,
    )
    return Explanation(("another step",), words, 1.0, 0.0)


def _nearest(telling: Sequence[Probe], recognition: Recognition) -> Sentence | None:
    """Return which of the known steps comes near to the answers to the probes, if any does."""
    greeting = recognition.greeting
    usual = {option.aspect: option for option in honest_options((), greeting)}
    steps, choices = [], honest(greeting.step, {})
    for integrator, damper in product(choices["integrator"], choices["damper"]):
        velocity = choices["velocity"][integrator.choice.explicit]
        step = usual | {"integrator": integrator, "damper": damper, "velocity": velocity}
        if compatible(step):
            options = tuple(step.values())
            gaps = [
                gap_of(model_of(options), probe, greeting.epsilon) for probe in telling[-COMPARED:]
            ]
            known = [gap for gap in gaps if gap is not None] or [np.inf]
            steps.append((float(np.median(known)), max(known), options))
    median, worst, options = min(steps, key=lambda step: step[0])
    if median > NEAR:
        return None
    return sentence(
        "The nearest known step is {model}; relative to the displacement, it differs by "
        "{median:.2g} in the median small case and by {worst:.2g} in the worst. If it moves "
        "particles until springs have their lengths (Verlet with constraints, PBD, XPBD), declare "
        "{declaration}.",
        model=describe_model(options),
        median=median,
        worst=worst,
        declaration=DECLARATION,
    )
