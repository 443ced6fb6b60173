"""Judge steps and motions by the declared or inferred model and by laws."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

import msgspec
import numpy as np

from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import State
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer, Exchange
from ..greeting import Greeting, Step
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    Finding,
    TaskReport,
    Verdict,
    first_broken,
)
from ..laws import digits, hints_of, judge_case
from . import laws, position_based
from .cases import task_cases, trace_of
from .honest import ITERATIVE, PINS, SYMPLECTIC, Option, model_of
from .laws import SOLVED, StepContext, rounding
from .model import Scaling, StepModel, predicted
from .model_search import ModelSearch, Probe, honest_options, probes_of
from .problem import SpringProblem, problem_of, state_of, system_of

LAWS: tuple[Callable[[StepContext], Finding | None], ...] = (
    laws.pins, laws.declared_step, laws.velocities, laws.velocity_loss, laws.pin_velocities,
    laws.momentum, laws.minimiser,
)  # fmt: skip


class Stepping(NamedTuple):
    """The discipline of a task of a single step or of several."""

    TASK: str

    def cases(self, greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
        """Return cases that suit the solver, the smallest first."""
        return task_cases(self.TASK, greeting, seed, thorough)

    def judge(self, exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
        """Hold answers against the step that is declared, or that an honest program makes."""
        recognition = recognise(exchanges, greeting)
        judgements = [_judge_case(exchange, exchanges, recognition) for exchange in exchanges]
        is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
        first, hints = first_broken_step(judgements), hints_of(judgements)
        if repeats(judgements, 1.0):
            first = sentence(
                "Positions are those of the request in all its answers: nothing moves. Answer the "
                "state at the end of the step."
            )
        behaviour = recognition.behaviour(is_wrong)
        diagnosis = Diagnosis((), behaviour, first, hints, is_double=recognition.is_double)
        return TaskReport(self.TASK, "", judgements, diagnosis)


class Recognition(NamedTuple):
    """The honest step that answers are of, or that the greeting declares."""

    exchanges: tuple[Exchange, ...]
    greeting: Greeting
    problems: Mapping[str, SpringProblem]
    telling: list[Probe]  # by which it was sought, none if the answers are of no step
    probes: list[Probe]  # all answers
    match: tuple[Option, ...]  # () if none explains the answers
    options: tuple[Option, ...]  # the match, completed by declared and usual choices
    model: StepModel
    is_position_based: bool
    is_double: bool  # whether the answers have more digits than single precision leaves

    @property
    def is_known(self) -> bool:
        """Whether the step is declared or was recognised."""
        declared = self.greeting.step.method is not None
        return declared or self.is_position_based or bool(self.match)

    @property
    def description(self) -> Sentence:
        """The step in words."""
        if self.is_position_based:
            return position_based.description(self.model)
        return describe_model(self.options)

    def behaviour(self, is_wrong: bool) -> Sentence | None:
        """Return the step that answers are of, None if it is the one that is declared."""
        if not self.is_position_based:
            words = step_behaviour(self.options, self.greeting.step, is_wrong)
            return words if self.match else None
        if is_wrong:
            return None
        answers = [(p.problem, p.answers) for p in self.probes]
        stiffness = position_based.stiffness(answers, self.model)
        if self.greeting.step.method is not None:
            return stiffness
        words = sentence("It behaves like {model}. Declare it with {declaration}.")
        declaration = position_based.DECLARATION
        return Sentence(words.template, {"model": self.description, "declaration": declaration})


@dataclass(frozen=True)
class _Declaration:
    """A greeting that is compared by its text: there may be lists in it."""

    text: str
    greeting: Greeting = field(compare=False)


def recognise(exchanges: Sequence[Exchange], greeting: Greeting) -> Recognition:
    """Return the step that answers are of; it is sought once for a verdict and its cause."""
    return _recognise(tuple(exchanges), _Declaration(repr(greeting), greeting))


@lru_cache(maxsize=4)
def _recognise(exchanges: tuple[Exchange, ...], declaration: _Declaration) -> Recognition:
    greeting = declaration.greeting
    problems = problems_of(exchanges, greeting)
    probes = probes_of(exchanges, problems, every=True)
    is_constant = repeats(exchanges, 0.0) or repeats(exchanges, 1.0)
    telling = [] if is_constant else probes_of(exchanges, problems)
    search, method = ModelSearch(telling, greeting), greeting.step.method
    match: tuple[Option, ...] = ()
    if method != position_based.METHOD:
        match = search.run(probes)
    options = honest_options(match, greeting)
    model, answers = model_of(options), [(p.problem, p.answers) for p in telling]
    is_position_based = method == position_based.METHOD or (
        method is None and not match and position_based.is_shown(answers)
    )
    if is_position_based:
        model = position_based.flight_model(greeting.step, answers)
    return Recognition(
        exchanges, greeting, problems, telling, probes, match, options, model, is_position_based,
        search.is_double(),
    )  # fmt: skip


def problems_of(exchanges: Sequence[Exchange], greeting: Greeting) -> dict[str, SpringProblem]:
    """Return the problem of each case; a solver that goes on starts from its own answer."""
    by_name = {exchange.case.name: exchange for exchange in exchanges}
    problems: dict[str, SpringProblem] = {}
    for name, exchange in by_name.items():
        before = by_name.get(exchange.case.follows)
        inputs = dict(exchange.case.inputs)
        if greeting.system.continues and before is not None and isinstance(before.answer, Answer):
            answers = before.answer.values
            for state in {"positions", "velocities"} & answers.keys():
                frames = answers[state]
                inputs[state] = frames.reshape(-1, *frames.shape[-2:])[-1]
        problems[name] = problem_of(inputs)
    return problems


def describe_model(options: Sequence[Option]) -> Sentence:
    """Return a model in words."""
    parts = {option.aspect: option.sentence for option in options}
    if model_of(options).scaling != Scaling():
        parts["damper"] = parts["scaling"]
    names = ("integrator", "substeps", "damper", "pins", "velocity")
    return sentence(
        "{integrator} ({substeps}, {damper}, {pins}, {velocity})",
        **{name: parts[name] for name in names},
    )


def step_fields(model: StepModel) -> dict[str, Any]:
    """Return the fields of a greeting that declare a model, None those that it has not."""
    integrator, pins, factor = model.integrator, model.pin_kind, model.scaling.factor
    method, is_iterative = integrator.method, integrator.method in ITERATIVE
    if method == "newton" and integrator.iterations == 1:
        method = "linearised"
    is_scaled = factor != 1.0 and model.damper == "none"
    return {
        "method": "symplectic" if method in SYMPLECTIC else method,
        "order": SYMPLECTIC.get(method),
        "start": integrator.start if is_iterative else None,
        "iterations": integrator.iterations if is_iterative else None,
        "substeps": model.substeps,
        "damper": "global_factor" if is_scaled else model.damper,
        "damping_factor": factor if is_scaled else None,
        "pins": next((name for name, kinds in PINS.items() if pins in kinds), pins),
        "velocity": model.velocity,
    }


def declaration_of(model: StepModel) -> str:
    """Return the field of a greeting that declares a model, "" if the protocol has none for it."""
    fields = step_fields(model)
    if fields["order"] == "velocities_first":
        fields["order"] = None
    step = {name: value for name, value in fields.items() if value is not None}
    is_undeclared = model.scaling.factor != 1.0 and fields["damping_factor"] is None
    try:
        msgspec.convert(step, Step)
    except msgspec.ValidationError:
        return ""
    return "" if is_undeclared else json.dumps({"step": step})[1:-1]


def _judge_case(
    exchange: Exchange, exchanges: Sequence[Exchange], recognition: Recognition
) -> CaseJudgement:
    case, answer, greeting = exchange.case, exchange.answer, recognition.greeting
    p, model, is_known = recognition.problems[case.name], recognition.model, recognition.is_known
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {})
    predict = position_based.flight if recognition.is_position_based else predicted
    expected, positions = predict(p, model), answer.values.get("positions")
    context = StepContext(
        p, answer.values, rounding(p, model, greeting.epsilon), model, is_known,
        recognition.description, expected, greeting.step,
    )  # fmt: skip
    is_predicted = is_known and not recognition.is_position_based
    correct_digits = None
    if is_predicted and expected and positions is not None:
        gap = float(np.abs(expected["positions"] - positions).max())
        if np.isfinite(gap):
            correct_digits = digits(gap, float(np.abs(expected["positions"]).max()))
    # What rounding and an iterative solver may leave of two answers that should be alike.
    allowed = {
        name: 4.0 * getattr(context.allowed, name)
        + SOLVED * float(np.abs(answer.values.get(name, origin) - origin).max(initial=0.0))
        for name, origin in (("positions", p.positions), ("velocities", 0.0))
    }
    judge = position_based.findings if recognition.is_position_based else _findings

    def findings(outputs: Mapping[str, Any]) -> list[Finding]:
        invalid = [name for name, numbers in outputs.items() if not np.isfinite(numbers).all()]
        if invalid:
            return [laws.not_finite(case, ", ".join(invalid))]
        return judge(exchange, exchanges, context, allowed)

    judgement = judge_case(
        exchange, findings, allowed,
        partial(_reference_step, p, model), expected if is_predicted else {}, correct_digits,
    )  # fmt: skip
    steps = (p.steps or 1) * (model.substeps if model.integrator.explicit else 1)
    return replace(judgement, reference_seconds=steps * (judgement.reference_seconds or 0.0))


def _findings(
    exchange: Exchange,
    exchanges: Sequence[Exchange],
    context: StepContext,
    allowed: Mapping[str, float],
) -> list[Finding]:
    """Return the findings of all laws that apply."""
    findings = [law(context) for law in LAWS]
    if exchange.case.facts.get("consistent") and not laws.keeps_declaration(context):
        findings.append(laws.consistency(context))
    findings.append(laws.symmetry(exchange, exchanges, allowed))
    return [entry for entry in findings if entry is not None]


def _reference_step(p: SpringProblem, model: StepModel) -> State:
    """Return the end of one step of the same kind by the compiled reference."""
    system, state = system_of(p), state_of(p)
    if model.integrator.explicit:
        return symplectic_euler(system, state, p.h)
    return ImplicitEuler(system, h=p.h).step(state).state


def step_behaviour(options: Sequence[Option], step: Step, is_wrong: bool) -> Sentence | None:
    """Return the honest model that answers are of, None if it is the one that is declared."""
    model = model_of(options)
    is_open = _leaves_open(step, model)
    if not is_open and model.integrator.hessian == "exact":
        return None
    declaration = declaration_of(model) if is_open and not is_wrong else ""
    return sentence(
        "In small cases it behaves like {model}, with which it is compared."
        if is_wrong
        else "It behaves like {model}. Declare it with {declaration}."
        if declaration
        else "It behaves like {model}.",
        model=describe_model(options),
        declaration=declaration,
    )


def _leaves_open(step: Step, model: StepModel) -> bool:
    """Return whether a greeting leaves something open that is not as usual."""
    is_counted = step.method in ITERATIVE and step.method == model.integrator.method
    if is_counted and step.iterations is None:
        return True
    velocity = "separate" if model.integrator.explicit else "displacement"
    usual = {"substeps": 1, "velocity": velocity, "order": "velocities_first"}
    fields = step_fields(model)
    return any(
        getattr(step, name) is None and fields[name] not in (None, usual.get(name))
        for name in ("method", "order", "substeps", "damper", "pins", "velocity")
    )


def repeats(answered: Sequence[Exchange] | Sequence[CaseJudgement], factor: float) -> bool:
    """Return whether all answers are the positions of their requests times a factor."""
    pairs = [
        (factor * item.case.inputs["positions"], item.answer.values["positions"])
        for item in answered
        if isinstance(item.answer, Answer) and "positions" in item.answer.values
    ]
    return bool(pairs) and all(np.allclose(before, after, atol=SOLVED) for before, after in pairs)


def first_broken_step(judgements: Sequence[CaseJudgement]) -> Sentence | None:
    """Return the first law that broke, and where to look if all cases before are right.

    Each case adds an aspect to the cases before it.
    """
    law = first_broken(judgements)
    cases = [j.case for j in judgements if j.verdict > Verdict.RIGHT_EXCEPT]
    if law is None or not cases or cases[0].name != law.values["case"]:
        return law
    is_pinned = all(len(case.inputs.get("pinned", [0])) for case in cases)
    family = "later cases" if cases[0].family == "pins" and not is_pinned else cases[0].family
    return sentence("{law} {trace}", law=law, trace=trace_of(family))
