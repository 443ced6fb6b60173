"""Judge steps and motions: against what is declared, or else inferred, and against laws."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, product
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.explicit import symplectic_euler
from plumbob.reference.implicit_euler import ImplicitEuler

from ..case import Case
from ..contestant import Answer, Exchange
from ..explain import either, first_broken, hints_of
from ..greeting import Greeting, Step
from ..judgement import CaseJudgement, Diagnosis, Explanation, Finding, TaskReport, Verdict
from ..sentence import Sentence, sentence
from ..timing import timed
from . import laws
from .cases import task_cases
from .faults import ASPECTS, Option, apply
from .honest import DAMPERS, HONEST_VELOCITIES, compatible, domains, honest
from .laws import Context
from .model import StepModel, predicted
from .problem import SpringProblem, problem_of, state_of, system_of
from .rounding import SOLVED, apart, correct_digits, rounding
from .search import Found, Probe, Search, probes_of

MOST_TOLD = 3
LAWS: tuple[Callable[[Context], Finding | None], ...] = (
    laws.pins, laws.declared_step, laws.velocities, laws.momentum, laws.minimiser,
)  # fmt: skip


class Stepping(NamedTuple):
    """The discipline of a task that makes one step, or several."""

    task: str

    def cases(self, greeting: Greeting, method: str, seed: int, thorough: bool) -> list[Case]:
        """Return cases that suit the solver, the smallest first."""
        return task_cases(self.task, greeting, seed, thorough)

    def judge(self, asked: Sequence[Exchange], greeting: Greeting, method: str) -> TaskReport:
        """Hold answers against the step that is declared, or inferred, and name the faults."""
        problems = problems_of(asked, greeting)
        search = Search(probes_of(asked, problems), greeting.step, greeting.epsilon)
        found = search.run()
        right = honest_options(found, greeting.step)
        known = greeting.step.method is not None or bool(found and not found[0].faults)
        judgements = [
            _judge_case(one, asked, problems[one.case.name], greeting, right, known)
            for one in asked
        ]
        diagnosis = _diagnose(judgements, search, found, probes_of(asked, problems, every=True))
        return TaskReport(self.task, "", _with_faults(judgements, diagnosis, known), diagnosis)


def problems_of(asked: Sequence[Exchange], greeting: Greeting) -> dict[str, SpringProblem]:
    """Return the problem of each case; a solver that goes on starts from its own answer."""
    by_name = {one.case.name: one for one in asked}
    problems: dict[str, SpringProblem] = {}
    for one in asked:
        before = by_name.get(one.case.follows)
        h_before = before.case.inputs["h"] if before is not None else None
        inputs = dict(one.case.inputs)
        if greeting.system.continues and before is not None and isinstance(before.answer, Answer):
            inputs |= _state(before.answer.values)
        problems[one.case.name] = problem_of(inputs, h_before)
    return problems


def _state(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the last frame of an answer."""
    return {
        name: values[name].reshape(-1, *values[name].shape[-2:])[-1]
        for name in ("positions", "velocities")
        if name in values
    }


def honest_options(found: Sequence[Found], step: Step) -> tuple[Option, ...]:
    """Return what was found of a solver, its faults replaced by what it declares."""
    wrong = {one.aspect for one in found[0].faults} if found else set()
    options = {o.aspect: o for o in found[0].options if o.aspect not in wrong} if found else {}
    choices = domains(step)
    usual = {aspect: choices[aspect][0][0] for aspect in ASPECTS} | options
    if usual["integrator"].fields["integrator"].explicit:
        for aspect, value in (("damper", "explicit"), ("velocity", "separate")):
            if aspect not in options:
                fits = (o for o, cost in choices[aspect] if not cost and o.fields[aspect] == value)
                usual[aspect] = next(fits, usual[aspect])
    return tuple(usual[aspect] for aspect in ASPECTS)


def describe_model(options: Sequence[Option]) -> Sentence:
    """Return a model in words."""
    parts = {one.aspect: one.sentence for one in options}
    names = ("integrator", "substeps", "damper", "pins", "velocity")
    return sentence(
        "{integrator} ({substeps}, {damper}, {pins}, {velocity})",
        **{name: parts[name] for name in names},
    )


def _judge_case(
    one: Exchange,
    asked: Sequence[Exchange],
    p: SpringProblem,
    greeting: Greeting,
    options: tuple[Option, ...],
    known: bool,
) -> CaseJudgement:
    if not isinstance(one.answer, Answer):
        return CaseJudgement(one.case, one.answer, (), {})
    _, model = apply(options, p, StepModel())
    expected = predicted(p, model)
    context = Context(
        p, one.answer.values, rounding(p, model, greeting.epsilon), model, known,
        describe_model(options), expected, greeting.step.pins is not None,
    )  # fmt: skip
    findings = tuple(_findings(one, one.answer, asked, context))
    seconds = _reference_seconds(p, model)
    if not known:
        return CaseJudgement(one.case, one.answer, findings, {}, None, seconds)
    digits = _digits(expected, one.answer.values)
    return CaseJudgement(one.case, one.answer, findings, expected, digits, seconds)


def _findings(
    one: Exchange, answer: Answer, asked: Sequence[Exchange], context: Context
) -> list[Finding]:
    """Return what all laws that apply say."""
    broken = laws.finite(context)
    if broken is not None:
        return [broken]
    limits = {
        "positions": 4.0 * context.allowed.positions + _slack(context, "positions"),
        "velocities": 4.0 * context.allowed.velocities + _slack(context, "velocities"),
    }
    found = [
        *(law(context) for law in LAWS),
        laws.consistency(context) if one.case.facts.get("consistent") else None,
        laws.symmetry(one, asked, limits) if context.model.damper != "diagonal" else None,
        laws.equal_requests(one, limits),
    ]
    return [finding for finding in found if finding is not None] + laws.remarks(answer)


def _slack(context: Context, name: str) -> float:
    """Return what an iterative solver may leave of two answers that should be alike."""
    before = context.problem.positions if name == "positions" else 0.0
    changed = np.abs(np.asarray(context.answered.get(name, before)) - before)
    return SOLVED * float(changed.max(initial=0.0))


def _digits(expected: Mapping[str, Any], answered: Mapping[str, Any]) -> float | None:
    """Return the correct digits of the largest coordinate."""
    if not expected or "positions" not in answered:
        return None
    x = np.asarray(expected["positions"])
    gap = float(np.abs(x - answered["positions"]).max())
    return correct_digits(gap, float(np.abs(x).max())) if np.isfinite(gap) else None


def _reference_seconds(p: SpringProblem, model: StepModel) -> float:
    """Return the compiled reference's time for as many steps of the same kind [s]."""
    system, state = system_of(p), state_of(p)
    if model.integrator.explicit:
        _, seconds = timed(lambda: symplectic_euler(system, state, p.h))
        return seconds * model.substeps * (p.steps or 1)
    _, seconds = timed(lambda: ImplicitEuler(system, h=p.h).step(state))
    return seconds * (p.steps or 1)


def _diagnose(
    judgements: Sequence[CaseJudgement], search: Search, found: Sequence[Found], every: list[Probe]
) -> Diagnosis:
    explanations: tuple[Explanation, ...] = ()
    behaviour, step = None, search.step
    if found and found[0].faults:
        explanations = (_explanation(found, every, search.epsilon),)
    elif found and any(getattr(step, name) is None for name in _DECLARED):
        behaviour = sentence(
            "In small cases it behaves like {model}, with which it is compared."
            if any(one.verdict >= Verdict.WRONG for one in judgements)
            else "It behaves like {model}.",
            model=describe_model(honest_options(found, step)),
        )
    hints = hints_of(judgements)
    diagnosis = Diagnosis(explanations, behaviour, None, hints, search.tried)
    if diagnosis.explained:
        return diagnosis
    if search.probes and behaviour is None and step.method is None:
        hints += (_nearest(search), _what_holds(judgements))
    return replace(diagnosis, first_broken=_first_broken(judgements), hints=hints)


# What a greeting may say of its step; anything else is inferred.
_DECLARED = ("method", "substeps", "damper", "pins", "velocity")


def _nearest(search: Search) -> Sentence:
    """Return which of the steps that are known comes nearest to the answers to the probes."""
    usual = {option.aspect: option for option in honest_options((), search.step)}
    steps = []
    for integrator, damper in product(honest(search.step)["integrator"], DAMPERS):
        velocity = HONEST_VELOCITIES[integrator.fields["integrator"].explicit]
        step = usual | {"integrator": integrator, "damper": damper, "velocity": velocity}
        if compatible(step):
            errors = _errors(tuple(step.values()), search.probes, search.epsilon)
            steps.append((float(np.median(errors)), max(errors), tuple(step.values())))
    median, worst, options = min(steps, key=lambda step: step[0])
    return sentence(
        "The nearest step that is known is {model}; it differs by {median:.2g} of a displacement "
        "in the median small case, by {worst:.2g} in the worst.",
        model=describe_model(options),
        median=median,
        worst=worst,
    )


def _what_holds(judgements: Sequence[CaseJudgement]) -> Sentence:
    """Return the laws that no answer breaks."""
    verdicts: dict[str, Verdict] = {}
    for finding in chain.from_iterable(judgement.findings for judgement in judgements):
        verdicts[finding.law] = max(finding.verdict, verdicts.get(finding.law, Verdict.RIGHT))
    names = ", ".join(law for law, verdict in verdicts.items() if not verdict)
    return sentence("What holds in every case: {laws}.", laws=names or "–")


def _explanation(found: Sequence[Found], every: Sequence[Probe], epsilon: float) -> Explanation:
    """Return the faults found with the share of all answers that they reproduce, in classes."""
    scores = []
    for one in found:
        errors = _errors(one.options, every, epsilon)
        hits = [error for error in errors if error <= SOLVED]
        scores.append((-len(hits) / max(len(errors), 1), max(hits, default=0.0), one.faults))
    scores.sort(key=lambda score: score[:2])
    share, distance, _ = scores[0]
    classes = {
        " + ".join(one.key for one in faults): faults for lost, _, faults in scores if lost == share
    }
    keys = tuple(classes)[:MOST_TOLD]
    said = either([list(map(_fault_sentence, classes[key])) for key in keys])
    return Explanation(keys, said, -share, distance)


def _errors(options: tuple[Option, ...], probes: Sequence[Probe], epsilon: float) -> list[float]:
    """Return how far each answer is from a step with these options, relative to what it moves."""
    errors = []
    for plain, answered, _ in probes:
        p, model = apply(options, plain, StepModel(damper="none"))
        expected, allowed = predicted(p, model), rounding(plain, model, epsilon)
        errors.append(apart(plain, expected, answered, allowed) if expected else np.inf)
    return errors


def _fault_sentence(one: Option) -> Sentence:
    """Return what is said of a fault; of an honest choice that was denied, that it is one."""
    if any(one.key == other.key for other in honest(Step()).get(one.aspect, ())):
        return sentence("Other than declared, it behaves like this: {what}.", what=one.sentence)
    return one.sentence


def _first_broken(judgements: Sequence[CaseJudgement]) -> Sentence | None:
    """Return the first law that broke, and where to look if all cases before are right.

    The cases add one aspect after another.
    """
    law = first_broken(judgements)
    case = next((one.case for one in judgements if one.verdict > Verdict.RIGHT_BUT), None)
    if law is None or case is None or case.name != law.values["case"]:
        return law
    return sentence("{law} {trace}", law=law, trace=_TRACES.get(case.family, _TRACES["cloth"]))


_TRACES: Mapping[str, Sentence] = {
    "flight": sentence("Look at gravity, h and the velocity: no spring acts there."),
    "springs": sentence("Free flight is right: look at the spring's force and the system matrix."),
    "rest": sentence("Nothing should move there: look at rest lengths."),
    "dampers": sentence("Undamped springs are right: look at the damper."),
    "pins": sentence("Without pins all is right: look at how particles are held."),
    "gravity": sentence("Gravity along y is right: look at its other components."),
    "external forces": sentence("Look at how external forces are added."),
    "tension only": sentence("Look at springs shorter than at rest."),
    "h changes": sentence("A single h is right: look at what is kept from one request to another."),
    "system changes": sentence("Look at what is kept from one request to another."),
    "cloth": sentence("Small systems are right: look at indices and at what larger ones add."),
}


def _with_faults(
    judgements: Sequence[CaseJudgement], diagnosis: Diagnosis, known: bool
) -> list[CaseJudgement]:
    """Return the judgements, undecided steps wrong where a fault explains them."""
    if known or not diagnosis.explained:
        return list(judgements)
    said = sentence("No honest step gives its answers; a faulty one does.")
    return [
        replace(judgement, findings=tuple(
            replace(one, verdict=Verdict.WRONG, sentence=said)
            if one.law == "declared step" and one.verdict is Verdict.UNDECIDED else one
            for one in judgement.findings
        ))
        for judgement in judgements
    ]  # fmt: skip
