"""Name the faults of wrongly resampled curves."""

from collections.abc import Callable, Sequence

from plumbob.reference.arguments import FloatArray
from plumbob.text.sentence import Sentence

from ..case import Case
from ..cause_search import JudgedAnswers
from ..contestant import Answer, Exchange
from ..explain import Variant, explain
from ..greeting import Greeting
from ..judgement import Diagnosis, Verdict
from .faults import AS_THE_TEXTBOOK, sentences_of
from .report import with_hints
from .resample import TASK
from .resample_faults import FAULTS
from .resampling import even_points


def diagnose(judged_answers: JudgedAnswers) -> Diagnosis:
    """Return the faults that explain the points, if some are wrong."""
    judgements, behaviour = (
        judged_answers.report.judgements,
        judged_answers.report.diagnosis.behaviour,
    )
    pairs = zip(judged_answers.exchanges, judgements, strict=True)
    wrong_first = sorted(pairs, key=lambda pair: pair[1].verdict is Verdict.RIGHT)
    diagnosis = Diagnosis(behaviour=behaviour)
    if any(judgement.verdict and isinstance(judgement.answer, Answer) for judgement in judgements):
        ordered = [exchange for exchange, _ in wrong_first]
        diagnosis = _diagnosis(ordered, judged_answers.greeting, behaviour)
    return with_hints(judgements, diagnosis)


def _diagnosis(
    wrong_first: Sequence[Exchange], greeting: Greeting, behaviour: Sentence | None
) -> Diagnosis:
    """Return the faults that reproduce the answers."""
    sentences = {"": AS_THE_TEXTBOOK, **sentences_of(TASK)}

    def variant(key: str, points: Callable[[Case], FloatArray]) -> Variant:
        return Variant((key,) if key else (), lambda case: {"points": points(case)})

    def tolerance(case: Case) -> float:
        return max(1e-9, 64.0 * greeting.epsilon * len(case.inputs["curve"]))

    models = {"": (even_points,), **FAULTS}
    variants = [variant(key, points) for key, choices in models.items() for points in choices]
    explanations, count = explain(variants, wrong_first, tolerance, lambda keys: sentences[keys[0]])
    keys = [explanation.faults for explanation in explanations]
    faulty = tuple(  # of the implementations of a fault the best
        explanations[i] for i in range(len(keys)) if keys[i] not in (("",), *keys[:i])
    )
    return Diagnosis(faulty, behaviour, variant_count=count)
