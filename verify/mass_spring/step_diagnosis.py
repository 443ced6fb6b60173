"""Explain wrong steps by honest ones: another than declared, or iterations that end early."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import msgspec
import numpy as np

from plumbob.text.sentence import Sentence, sentence, with_code

from ..cause_search import JudgedAnswers
from ..fault_programs import coded_faults
from ..greeting import Greeting, Step
from ..judgement import Diagnosis, Explanation, Verdict
from ..laws import laws_that_hold, proportion_of
from . import iterations
from .honest import Option, compatible, honest, model_of
from .laws import SOLVED
from .model import first_equation
from .model_search import ModelSearch, Probe, gaps_of, honest_options, probes_of
from .stepping import describe_model, problems_of, telling_probes

# The number of small cases in which the nearest step is sought.
COMPARED = 4
# A step that differs by a larger share of the displacement has nothing to say about the answers.
NEAR = 0.1
# The code of an unchecked factorisation.
UNCHECKED = "PB-STEP-059"


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return which other honest step, or end of iterations, explains wrong answers."""
    report, greeting, search = (
        judged_answers.report, judged_answers.greeting, judged_answers.search,
    )  # fmt: skip
    diagnosis = replace(report.diagnosis, explanations=())
    if not any(judgement.verdict >= Verdict.UNDECIDED for judgement in report.judgements):
        return diagnosis
    problems = problems_of(report.exchanges, greeting)
    probes = probes_of(report.exchanges, problems, every=True)
    telling = telling_probes(report.exchanges, problems)
    match = ModelSearch(telling, greeting).run(probes)
    options = honest_options(match, greeting)
    stages = (
        partial(_undeclared_step, () if match else telling, probes, greeting),
        partial(iterations.explanation, options, probes, greeting.step.start, greeting.epsilon),
        partial(_unchecked_factorisation, options, probes, greeting.epsilon),
    )
    is_known = greeting.step.method is not None or bool(match)
    for stage in stages if telling and is_known else ():
        explanation = search.run(stage, None)
        if explanation is not None:
            return replace(diagnosis, explanations=(explanation,), first_broken=None, hints=())
    return _with_hints(diagnosis, judged_answers, options, telling, probes)


def _with_hints(
    diagnosis: Diagnosis,
    judged_answers: JudgedAnswers,
    options: Sequence[Option],
    telling: Sequence[Probe],
    probes: Sequence[Probe],
) -> Diagnosis:
    """Return a diagnosis without an explanation, with what is known of the answers."""
    judgements, greeting = judged_answers.report.judgements, judged_answers.greeting
    stiffness = partial(iterations.stiffness_hint, options, probes, greeting.epsilon)
    if telling and (hint := judged_answers.search.run(stiffness, None)) is not None:
        return replace(diagnosis, hints=(hint,))
    hints = diagnosis.hints
    worst = max(judgement.verdict for judgement in judgements)
    if worst >= Verdict.WRONG:
        hints += proportion_of(judgements)
    is_open = greeting.step.method is None or worst == Verdict.UNDECIDED
    if telling and diagnosis.behaviour is None and is_open:
        nearest = judged_answers.search.run(partial(_nearest, telling, greeting), None)
        hints += (*filter(None, [nearest]), laws_that_hold(judgements))
    return replace(diagnosis, hints=hints)


def _undeclared_step(
    telling: Sequence[Probe], probes: Sequence[Probe], greeting: Greeting
) -> Explanation | None:
    """Return the honest step that all probes are of, which the greeting denies."""
    if greeting.step == Step() or not telling:
        return None
    step = Step(substeps=greeting.step.substeps or 1)  # others take long
    undeclared = msgspec.structs.replace(greeting, step=step)
    match = ModelSearch(telling, undeclared).run(probes)
    if not match:
        return None
    integrator, method = model_of(match).integrator, greeting.step.method
    if method == "local_global" and (integrator.method, integrator.iterations) == (method, 1):
        return None  # its iterations end after the first one
    options = honest_options(match, undeclared)
    words = sentence(
        "It differs from the declared step and behaves like this: {what}.",
        what=describe_model(options),
    )
    return Explanation(("another step",), words, 1.0, 0.0)


def _unchecked_factorisation(
    options: Sequence[Option], probes: Sequence[Probe], epsilon: float
) -> Explanation | None:
    """Return that Cholesky's factorisation fails unchecked where that explains the answers.

    It does if a linearised step is right where its matrix is positive definite, wrong elsewhere,
    and there goes where g rises, as no corrected matrix could.
    """
    model = model_of(options)
    if model.integrator.method != "newton" or model.integrator.iterations != 1:
        return None
    single = [probe for probe in probes if not probe.problem.steps]
    rises = [_rise(options, probe) for probe in single]
    gaps = np.array(gaps_of(options, single, epsilon))
    is_indefinite = np.array([rise is not None for rise in rises], dtype=bool)
    if not any(rises) or ((gaps > SOLVED) != is_indefinite).any():
        return None
    fault = coded_faults()[UNCHECKED]
    return Explanation((fault.name,), with_code(UNCHECKED, fault.sentence), 1.0, 0.0)


def _rise(options: Sequence[Option], probe: Probe) -> bool | None:
    """Return whether an answer goes where g rises, None if the step's matrix is definite."""
    equation = first_equation(probe.problem, model_of(options))
    start = equation.starts[equation.start.model.integrator.start]
    if equation.is_definite(equation.matrix(start, equation.start.model.integrator.hessian)):
        return None
    step = probe.answers.get("positions", start) - start
    return not float((equation.free_gradient(start) * step).sum()) < 0.0


def _nearest(telling: Sequence[Probe], greeting: Greeting) -> Sentence | None:
    """Return which of the known steps comes near to the answers to the probes, if any does."""
    usual = {option.aspect: option for option in honest_options((), greeting)}
    steps, choices = [], honest(greeting.step)
    for integrator, damper in product(choices["integrator"], choices["damper"]):
        velocity = choices["velocity"][integrator.fields["integrator"].explicit]
        step = usual | {"integrator": integrator, "damper": damper, "velocity": velocity}
        if compatible(step):
            options = tuple(step.values())
            gaps = gaps_of(options, telling[:COMPARED], greeting.epsilon)
            steps.append((float(np.median(gaps)), max(gaps), options))
    median, worst, options = min(steps, key=lambda step: step[0])
    if median > NEAR:
        return None
    return sentence(
        "The nearest known step is {model}; relative to the displacement, it differs by "
        "{median:.2g} in the median small case and by {worst:.2g} in the worst.",
        model=describe_model(options),
        median=median,
        worst=worst,
    )
