"""Judge steps and motions by the declared or inferred model and by laws."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

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
from . import laws
from .cases import task_cases, trace_of
from .honest import ITERATIVE, SYMPLECTIC, Option, model_of
from .laws import SOLVED, StepContext, rounding
from .model import StepModel, predicted
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
        problems = problems_of(exchanges, greeting)
        search = ModelSearch(telling_probes(exchanges, problems), greeting)
        match = search.run(probes_of(exchanges, problems, every=True))
        judgements = _judge_all(exchanges, problems, greeting, match)
        is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
        options = honest_options(match, greeting)
        behaviour = step_behaviour(options, greeting.step, is_wrong) if match else None
        first, hints = first_broken_step(judgements), hints_of(judgements)
        if repeats(judgements, 1.0):
            first = sentence(
                "Positions are those of the request in all its answers: nothing moves. Answer the "
                "state at the end of the step."
            )
        diagnosis = Diagnosis((), behaviour, first, hints, is_double=search.is_double())
        return TaskReport(self.TASK, "", judgements, diagnosis)


def telling_probes(
    exchanges: Sequence[Exchange], problems: Mapping[str, SpringProblem]
) -> list[Probe]:
    """Return the probes, none if the answers are constant, which are of no step."""
    is_constant = repeats(exchanges, 0.0) or repeats(exchanges, 1.0)
    return [] if is_constant else probes_of(exchanges, problems)


def _judge_all(
    exchanges: Sequence[Exchange],
    problems: Mapping[str, SpringProblem],
    greeting: Greeting,
    match: Sequence[Option],
) -> list[CaseJudgement]:
    """Return the judgements of all answers, by the step that is declared or recognised."""
    options = honest_options(match, greeting)
    recognised = greeting.step.method is not None or bool(match)
    return [
        _judge_case(
            exchange, exchanges, problems[exchange.case.name], greeting, options, recognised
        )
        for exchange in exchanges
    ]


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
    names = ("integrator", "substeps", "damper", "pins", "velocity")
    return sentence(
        "{integrator} ({substeps}, {damper}, {pins}, {velocity})",
        **{name: parts[name] for name in names},
    )


def declaration_of(options: Sequence[Option]) -> str:
    """Return the field of a greeting that declares a model, "" if the protocol has none for it."""
    fields = {name: value for option in options for name, value in option.fields.items()}
    integrator, pins = fields["integrator"], fields["pins"].split()[0]
    method, is_iterative = integrator.method, integrator.method in ITERATIVE
    if method == "newton" and integrator.iterations == 1:
        method = "linearised"
    step = {
        "method": "symplectic" if method in SYMPLECTIC else method,
        "order": "positions_first" if method == "positions_first" else None,
        "start": integrator.start if is_iterative else None,
        "iterations": integrator.iterations if is_iterative else None,
        "substeps": fields["substeps"],
        "damper": fields["damper"],
        "pins": {"springs": "penalty", "weightless": "heavy"}.get(pins, pins),
        "velocity": fields["velocity"],
    }
    if fields["scaling"] != 1.0:
        if fields["damper"] != "none":
            return ""
        step |= {"damper": "global_factor", "damping_factor": fields["scaling"]}
    step = {name: value for name, value in step.items() if value is not None}
    try:
        msgspec.convert(step, Step)
    except msgspec.ValidationError:
        return ""
    return json.dumps({"step": step})[1:-1]


def _judge_case(
    exchange: Exchange,
    exchanges: Sequence[Exchange],
    p: SpringProblem,
    greeting: Greeting,
    options: tuple[Option, ...],
    recognised: bool,
) -> CaseJudgement:
    case, answer = exchange.case, exchange.answer
    if not isinstance(answer, Answer):
        return CaseJudgement(case, answer, (), {})
    model = model_of(options)
    expected, positions = predicted(p, model), answer.values.get("positions")
    context = StepContext(
        p, answer.values, rounding(p, model, greeting.epsilon), model, recognised,
        describe_model(options), expected, greeting.step,
    )  # fmt: skip
    correct_digits = None
    if recognised and expected and positions is not None:
        gap = float(np.abs(expected["positions"] - positions).max())
        if np.isfinite(gap):
            correct_digits = digits(gap, float(np.abs(expected["positions"]).max()))
    # What rounding and an iterative solver may leave of two answers that should be alike.
    allowed = {
        name: 4.0 * getattr(context.allowed, name)
        + SOLVED * float(np.abs(answer.values.get(name, origin) - origin).max(initial=0.0))
        for name, origin in (("positions", p.positions), ("velocities", 0.0))
    }
    judgement = judge_case(
        exchange, lambda outputs: _findings(exchange, exchanges, context, allowed), allowed,
        partial(_reference_step, p, model), expected if recognised else {}, correct_digits,
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
    outputs = context.answers.items()
    invalid = [name for name, numbers in outputs if not np.isfinite(numbers).all()]
    if invalid:
        return [laws.not_finite(exchange.case, ", ".join(invalid))]
    findings = [law(context) for law in LAWS]
    if exchange.case.facts.get("consistent") and not laws.keeps_declaration(context):
        findings.append(laws.consistency(context))
    if context.model.damper != "diagonal":
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
    is_open = _leaves_open(step, options)
    integrator = model_of(options).integrator
    if not is_open and integrator.hessian == "exact":
        return None
    declaration = declaration_of(options) if is_open and not is_wrong else ""
    return sentence(
        "In small cases it behaves like {model}, with which it is compared."
        if is_wrong
        else "It behaves like {model}. Declare it with {declaration}."
        if declaration
        else "It behaves like {model}.",
        model=describe_model(options),
        declaration=declaration,
    )


def repeats(asked: Sequence[Exchange] | Sequence[CaseJudgement], factor: float) -> bool:
    """Return whether all answers are the positions of their requests times a factor."""
    pairs = [
        (factor * item.case.inputs["positions"], item.answer.values["positions"])
        for item in asked
        if isinstance(item.answer, Answer) and "positions" in item.answer.values
    ]
    return bool(pairs) and all(np.allclose(before, after, atol=SOLVED) for before, after in pairs)


def _leaves_open(step: Step, options: Sequence[Option]) -> bool:
    """Return whether a greeting leaves something open that is not as usual."""
    fields = {name: value for option in options for name, value in option.fields.items()}
    integrator = fields["integrator"]
    order = SYMPLECTIC["symplectic"]
    usual = {"substeps": 1, "velocity": VELOCITY_OF[integrator.explicit], "order": order}
    fields["order"] = SYMPLECTIC.get(integrator.method, order)
    is_counted = integrator.method in ITERATIVE and step.method == integrator.method
    if is_counted and step.iterations is None:
        return True
    return any(
        getattr(step, name) is None and (name not in usual or fields[name] != usual[name])
        for name in _DECLARED
    )


# The usual velocity of implicit and of explicit methods.
VELOCITY_OF = ("displacement", "separate")
# What a greeting may say of its step; anything else is inferred.
_DECLARED = ("method", "order", "substeps", "damper", "pins", "velocity")


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
