"""Name the faults of wrong steps and motions."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from plumbob.text.sentence import Sentence, sentence

from ..cause_search import JudgedAnswers
from ..explain import either, share_of
from ..greeting import Step
from ..judgement import (
    CaseJudgement,
    Diagnosis,
    Explanation,
    Verdict,
    first_broken,
)
from ..laws import hints_of, laws_that_hold, proportion_of
from . import iterations
from .honest import compatible, honest
from .laws import IMPRECISE, SOLVED
from .model import StepModel, predicted
from .model_search import UNEXPLAINED, ModelMatch, ModelSearch, Probe, gaps_of, probes_of
from .options import ASPECTS, Option, apply
from .search import FaultSearch, matches_of, with_factorisation
from .stepping import (
    describe_model,
    first_broken_step,
    honest_options,
    problems_of,
    repeats,
    step_behaviour,
    telling_probes,
)

MAX_EXPLANATIONS = 3


# The number of small cases in which the nearest step is sought.
COMPARED = 4


# The number of larger cases in which faults are sought if all small ones are right.
LARGER = 2


# The least shares of the answers that several faults at once, or one, explain if not by chance.
MANY, SOME = 0.7, 0.3


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults of a step, or of its iterations, that explain the answers."""
    exchanges, greeting, cause_search = (
        judged_answers.exchanges,
        judged_answers.greeting,
        judged_answers.search,
    )
    problems, step, epsilon = problems_of(exchanges, greeting), greeting.step, greeting.epsilon
    telling, probes = (
        telling_probes(exchanges, problems),
        probes_of(exchanges, problems, every=True),
    )
    judgements, matches = judged_answers.report.judgements, list[ModelMatch]()
    search = FaultSearch(telling, greeting, cause_search)
    honest_search = ModelSearch(telling, greeting)

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
    honest_search: ModelSearch, search: FaultSearch, probes: Sequence[Probe]
) -> list[ModelMatch]:
    """Return the matches without a fault, or else the matches with faults."""
    cause_search, matches = search.cause_search, honest_search.run(probes)
    if not matches:
        matches = cause_search.run(lambda: matches_of(search, probes), matches)
    refine = partial(with_factorisation, matches, probes, search.epsilon)
    return cause_search.run(refine, matches)


def _faults_of_larger(
    search: FaultSearch,
    judgements: Sequence[CaseJudgement],
    probes: Sequence[Probe],
) -> list[ModelMatch]:
    """Return the matches with faults of the small probes and of some larger wrong answers."""
    wrong = {judgement.case.name for judgement in judgements if judgement.verdict >= Verdict.WRONG}
    larger = [probe for probe in probes if probe.name in wrong][:LARGER]
    is_tried = bool(search.probes and larger)
    matches = matches_of(search.with_probes(larger), probes) if is_tried else []
    return [match for match in matches if match.faults]


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


def _diagnose(
    judgements: Sequence[CaseJudgement],
    search: FaultSearch,
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
        behaviour = step_behaviour(honest_options(matches, step), step, is_wrong)
    hints = hints_of(judgements, bool(explanations))
    if repeats(judgements, 1.0):
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
    return replace(diagnosis, first_broken=first_broken_step(judgements), hints=hints)


def _nearest(search: FaultSearch) -> Sentence:
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
