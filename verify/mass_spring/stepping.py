"""Judge steps and motions by the declared or inferred model and by laws."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

import msgspec
import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler
from plumbob.reference.mass_spring import State
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..explain import either, share_of
from ..greeting import Greeting, Step
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Finding,
    TaskReport,
    Verdict,
    first_broken,
)
from ..laws import digits, hints_of, judge_case, laws_that_hold, proportion_of
from . import iterations, laws
from .cases import task_cases, trace_of
from .honest import ITERATIVE, SYMPLECTIC, compatible, honest
from .laws import IMPRECISE, SOLVED, StepContext, rounding
from .model import StepModel, predicted
from .options import ASPECTS, Option, apply
from .problem import SpringProblem, problem_of, state_of, system_of
from .search import (
    UNEXPLAINED,
    ModelMatch,
    ModelSearch,
    Probe,
    domains,
    fields_of,
    gaps_of,
    matches_of,
    probes_of,
    with_factorisation,
)  # fmt: skip

MAX_EXPLANATIONS = 3
# The number of small cases in which the nearest step is sought.
COMPARED = 4
# The number of larger cases in which faults are sought if all small ones are right.
LARGER = 2
# The least shares of the answers that several faults at once, or one, explain if not by chance.
MANY, SOME = 0.7, 0.3
LAWS: tuple[Callable[[StepContext], Finding | None], ...] = (
    laws.pins, laws.declared_step, laws.velocities, laws.velocity_loss, laws.pin_velocities,
    laws.momentum, laws.minimiser,
)  # fmt: skip


class Stepping(NamedTuple):
    """The discipline of a task of a single step or of several."""

    task: str

    def cases(self, greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
        """Return cases that suit the solver, the smallest first."""
        return task_cases(self.task, greeting, seed, thorough)

    def judge(self, exchanges: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
        """Hold answers against the step that is declared, or that an honest program makes."""
        problems = problems_of(exchanges, greeting)
        search = ModelSearch(_telling(exchanges, problems), greeting, is_honest=True)
        matches = search.run(probes_of(exchanges, problems, every=True))
        judgements = _judge_all(exchanges, problems, greeting, matches)
        is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
        step, hints = greeting.step, hints_of(judgements)
        behaviour = _behaviour(honest_options(matches, step), step, is_wrong) if matches else None
        diagnosis = Diagnosis((), behaviour, _first_broken(judgements), hints)
        diagnosis = replace(diagnosis, is_double=search.is_double())
        return TaskReport(self.task, "", judgements, diagnosis)


def _telling(exchanges: Sequence[Exchange], problems: Mapping[str, SpringProblem]) -> list[Probe]:
    """Return the probes, none if the answers are constant, which are of no step."""
    is_constant = _repeats(exchanges, 0.0) or _repeats(exchanges, 1.0)
    return [] if is_constant else probes_of(exchanges, problems)


def diagnose(judged: JudgedAnswers) -> Diagnosis:
    """Return the faults of a step, or of its iterations, that explain the answers."""
    exchanges, greeting, cause_search = judged.exchanges, judged.greeting, judged.search
    problems, step, epsilon = problems_of(exchanges, greeting), greeting.step, greeting.epsilon
    telling, probes = _telling(exchanges, problems), probes_of(exchanges, problems, every=True)
    judgements, matches = judged.report.judgements, list[ModelMatch]()
    search = ModelSearch(telling, greeting, cause_search=cause_search)
    honest_search = ModelSearch(telling, greeting, is_honest=True)

    def iteration_of(is_hasty: bool, least: float = IMPRECISE) -> Explanation | None:
        options: Sequence[Option] = honest_options(matches, step)
        if step.iterations is not None and step.start == "y" and not matches:
            options = _nearest_start(options, probes, epsilon)
        follow = partial(iterations.explanation, options, probes, step.start, epsilon)
        return cause_search.run(lambda: follow(is_hasty, least), None)

    is_iterative = step.method in ("converged", "linearised") or step.iterations is not None
    iteration = iteration_of(is_hasty=True) if is_iterative else None
    if iteration is None or iteration.share < 1.0 - UNEXPLAINED:
        matches = _matches(honest_search, search, probes)
    if iteration is None and (step.method is not None or matches):
        iteration = iteration_of(is_hasty=False)
    if iteration is None and matches and not matches[0].faults:
        find_larger = partial(_faults_of_larger, search, judgements, probes)
        matches = cause_search.run(find_larger, list[ModelMatch]()) or matches
    diagnosis = _diagnose(judgements, search, matches, probes)
    is_broken = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
    if iteration is None and not diagnosis.explained and is_broken:
        iteration = iteration_of(is_hasty=False, least=SOLVED)  # small errors break laws
    if iteration is not None and iteration.share > diagnosis.share:
        diagnosis = replace(diagnosis, explanations=(iteration,), first_broken=None, hints=())
    elif not diagnosis.explained:
        options = honest_options(matches, step)
        find_hint = partial(iterations.stiffness_hint, options, probes, epsilon)
        hint = cause_search.run(find_hint, None)
        first = diagnosis.first_broken if hint is None else first_broken(judgements)
        hints = diagnosis.hints if hint is None else (hint,)
        diagnosis = replace(diagnosis, first_broken=first, hints=hints)
    if not diagnosis.explained:
        return diagnosis
    options = honest_options(matches, step)  # the same step without the fault
    expected = {name: predicted(*apply(options, p, StepModel())) for name, p in problems.items()}
    return replace(diagnosis, expected=expected)


def _matches(
    honest_search: ModelSearch, search: ModelSearch, probes: Sequence[Probe]
) -> list[ModelMatch]:
    """Return the matches without a fault, or else the matches with faults."""
    cause_search, matches = search.cause_search, honest_search.run(probes)
    if not matches:
        matches = cause_search.run(lambda: matches_of(search, probes), matches)
    refine = partial(with_factorisation, matches, probes, search.epsilon)
    return cause_search.run(refine, matches)


def _faults_of_larger(
    search: ModelSearch,
    judgements: Sequence[CaseJudgement],
    probes: Sequence[Probe],
) -> list[ModelMatch]:
    """Return the matches with faults of the small probes and of some larger wrong answers."""
    wrong = {judgement.case.name for judgement in judgements if judgement.verdict >= Verdict.WRONG}
    larger = [probe for probe in probes if probe.name in wrong][:LARGER]
    is_tried = bool(search.probes and larger)
    matches = matches_of(search.with_probes(larger), probes) if is_tried else []
    return [match for match in matches if match.faults]


def _judge_all(
    exchanges: Sequence[Exchange],
    problems: Mapping[str, SpringProblem],
    greeting: Greeting,
    matches: Sequence[ModelMatch],
) -> list[CaseJudgement]:
    """Return the judgements of all answers, by the step that is declared or recognised."""
    options = honest_options(matches, greeting.step)
    recognised = greeting.step.method is not None or bool(matches)
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
    ends: dict[
        int, tuple[FloatArray, FloatArray]
    ] = {}  # the last states, by the number of particles
    for name, exchange in by_name.items():
        before = by_name.get(exchange.case.follows)
        h_before = before.case.inputs["h"] if before is not None else None
        inputs = dict(exchange.case.inputs)
        if greeting.system.continues and before is not None and isinstance(before.answer, Answer):
            answers = before.answer.values
            for state in {"positions", "velocities"} & answers.keys():
                frames = answers[state]
                inputs[state] = frames.reshape(-1, *frames.shape[-2:])[-1]
        p = problems[name] = problem_of(inputs, h_before)
        problems[name] = p.changed(before=ends.get(p.count))
        outputs = exchange.answer.values if isinstance(exchange.answer, Answer) else {}
        if {"positions", "velocities"} <= outputs.keys():
            x, v = (
                outputs[state].reshape(-1, p.count, 3)[-1] for state in ("positions", "velocities")
            )
            ends[p.count] = x, v
    return problems


def honest_options(matches: Sequence[ModelMatch], step: Step) -> tuple[Option, ...]:
    """Return the recognised choices of a solver, its faults replaced by declared choices."""
    options, faults = matches[0] if matches else ((), ())
    wrong = {fault.aspect for fault in faults}
    recognised = {option.aspect: option for option in options if option.aspect not in wrong}
    choices = domains(step)
    usual = {aspect: choices[aspect][0][0] for aspect in ASPECTS} | recognised
    if usual["integrator"].fields["integrator"].explicit:
        for aspect, name in (("damper", "explicit"), ("velocity", "separate")):
            if aspect not in recognised:
                fits = (o for o, cost in choices[aspect] if not cost and o.fields[aspect] == name)
                usual[aspect] = next(fits, usual[aspect])
    return tuple(usual[aspect] for aspect in ASPECTS)


def _nearest_start(
    options: Sequence[Option], probes: Sequence[Probe], epsilon: float
) -> Sequence[Option]:
    """Return choices of iterations that begin at y or, if more answers show that, at s_n."""
    place = ASPECTS.index("integrator")
    integrator = options[place].fields["integrator"]._replace(start="s_n")
    from_s_n = [*options]
    from_s_n[place] = options[place]._replace(fields={"integrator": integrator})
    hits = [sum(gap <= SOLVED for gap in gaps_of(model, probes, epsilon))
            for model in (options, from_s_n)]  # fmt: skip
    return options if hits[0] >= hits[1] else from_s_n


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
        "pins": {"springs": "penalty", "falling": "heavy", "weightless": "heavy"}.get(pins, pins),
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
    _, model = apply(options, p, StepModel())
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


def _diagnose(
    judgements: Sequence[CaseJudgement],
    search: ModelSearch,
    matches: Sequence[ModelMatch],
    probes: Sequence[Probe],
) -> Diagnosis:
    explanations: tuple[Explanation, ...] = ()
    behaviour, step = None, search.step
    if matches and matches[0].faults:
        failing = {j.case.name for j in judgements if j.verdict >= Verdict.UNDECIDED}
        explanation = _explanation(matches, probes, search.epsilon, failing)
        is_likely = explanation.share >= (MANY if len(matches[0].faults) > 1 else SOME)
        explanations = (explanation,) if is_likely else ()
    elif matches:
        is_wrong = any(judgement.verdict >= Verdict.WRONG for judgement in judgements)
        behaviour = _behaviour(honest_options(matches, step), step, is_wrong)
    hints = hints_of(judgements, bool(explanations))
    if _repeats(judgements, 1.0):
        first = sentence(
            "Positions are those of the request in all its answers: nothing moves. Answer the "
            "state at the end of the step."
        )
        return Diagnosis((), behaviour, first, hints, search.prediction_count)
    diagnosis = Diagnosis(explanations, behaviour, None, hints, search.prediction_count)
    if diagnosis.explained:
        return diagnosis
    is_undecided = (
        max((judgement.verdict for judgement in judgements), default=0) == Verdict.UNDECIDED
    )
    if any(judgement.verdict >= Verdict.WRONG for judgement in judgements):
        hints += proportion_of(judgements)
    if search.probes and behaviour is None and (step.method is None or is_undecided):
        nearest = search.cause_search.run(lambda: _nearest(search), None)
        hints += (*filter(None, [nearest]), laws_that_hold(judgements))
    return replace(diagnosis, first_broken=_first_broken(judgements), hints=hints)


def _behaviour(options: Sequence[Option], step: Step, is_wrong: bool) -> Sentence | None:
    """Return the honest model that answers are of, None if it is the one that is declared."""
    is_open = _leaves_open(step, options)
    integrator = fields_of({option.aspect: option for option in options})["integrator"]
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


def _repeats(asked: Sequence[Exchange] | Sequence[CaseJudgement], factor: float) -> bool:
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


def _nearest(search: ModelSearch) -> Sentence:
    """Return which of the known steps comes nearest to the answers to the probes."""
    usual = {option.aspect: option for option in honest_options((), search.step)}
    steps = []
    choices = honest(search.step)
    for integrator, damper in product(choices["integrator"], choices["damper"]):
        velocity = choices["velocity"][integrator.fields["integrator"].explicit]
        step = usual | {"integrator": integrator, "damper": damper, "velocity": velocity}
        if compatible(step):
            gaps = gaps_of(tuple(step.values()), search.probes[:COMPARED], search.epsilon)
            steps.append((float(np.median(gaps)), max(gaps), tuple(step.values())))
    median, worst, options = min(steps, key=lambda step: step[0])
    return sentence(
        "The nearest known step is {model}; relative to the displacement, it differs by "
        "{median:.2g} in the median small case and by {worst:.2g} in the worst.",
        model=describe_model(options),
        median=median,
        worst=worst,
    )


def _explanation(
    matches: Sequence[ModelMatch], probes: Sequence[Probe], epsilon: float, failing: set[str]
) -> Explanation:
    """Return the faults found with the share of answers that they reproduce, in classes.

    It is the share of all answers or, if less, of the failing answers. A factorisation shows in a
    pattern of failures, whatever it leaves.
    """
    scores, names = [], [probe.name for probe in probes]
    for match in matches:
        gaps = gaps_of(match.options, probes, epsilon)
        hits = {name: gap for name, gap in zip(names, gaps, strict=True) if gap <= SOLVED}
        is_pattern = any(fault.aspect == "factorisation" for fault in match.faults)
        share = share_of(hits, names, () if is_pattern else failing)
        scores.append((-share, max(hits.values(), default=0.0), match))
    scores.sort(key=lambda score: score[:2])
    best, distance, _ = scores[0]
    classes = {" + ".join(m.keys): m.faults for share, _, m in scores if share == best}
    keys = tuple(classes)[:MAX_EXPLANATIONS]
    message = either([list(map(_fault_sentence, classes[key])) for key in keys])
    return Explanation(keys, message, -best, distance)


def _fault_sentence(option: Option) -> Sentence:
    """Return the sentence of a fault, or of an honest choice that the greeting denies."""
    templates = {choice.sentence.template for choice in honest(Step()).get(option.aspect, ())}
    if option.sentence.template not in templates:
        return option.sentence
    integrator = option.fields.get("integrator")
    return sentence(
        "It differs from the declared step and behaves like this: {what}. If it makes more "
        "iterations, it finds directions once: find them again, at the new positions, in each."
        if integrator and (integrator.method, integrator.iterations) == ("local_global", 1)
        else "It differs from the declared step and behaves like this: {what}. If dampers are "
        "meant to be implicit, their part h c u u' of the system matrix is missing."
        if option.fields.get("damper") == "explicit"
        else "It differs from the declared step and behaves like this: {what}.",
        what=option.sentence,
    )


def _first_broken(judgements: Sequence[CaseJudgement]) -> Sentence | None:
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
