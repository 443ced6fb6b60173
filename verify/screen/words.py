"""Verdicts in words, for the terminal, the files and the page of `verify`."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from plumbob.text.language import translator
from plumbob.text.printable import visible
from plumbob.text.sentence import Say, Sentence, codes_in, sentence

from ..connections import saved
from ..exchange import Failure
from ..judgement import CaseJudgement, Report, TaskReport, Verdict

GOOD = (Verdict.RIGHT, Verdict.RIGHT_EXCEPT)
# A part of the answers of unwritten starters.
UNWRITTEN = "is not written yet"
STEPS = ("mass_spring_step", "mass_spring_motion")
VERDICTS = {
    Verdict.RIGHT: sentence("RIGHT"),
    Verdict.RIGHT_EXCEPT: sentence("RIGHT EXCEPT"),
    Verdict.UNDECIDED: sentence("UNDECIDED"),
    Verdict.WRONG: sentence("WRONG"),
    Verdict.BROKEN: sentence("BROKEN"),
}


class Presentation(NamedTuple):
    """The language, the command line and the saved cases."""

    say: Say  # translates a sentence
    language: str  # a key of LANGUAGES
    solver: Sequence[str]  # its words on the command line
    # the file of the smallest failing case of a task and method
    files: Mapping[tuple[str, str], Path] = {}

    def command(self, task: TaskReport) -> Sentence | None:
        """Return the command to repeat the saved case of a task, or None."""
        path = self.files.get((task.task, task.method))
        return saved.command(self.solver, path) if path else None


def speaker(language: str) -> Say:
    """Return a translator of sentences to lines of printable text."""
    translate = translator(language)
    return lambda words: visible(words.text(translate))


def title(report: TaskReport) -> str:
    """Return a task's name, with its method."""
    return visible(f"{report.task} {report.method}".strip())


def passed(report: TaskReport) -> str:
    """Return the number of RIGHT and RIGHT EXCEPT cases, and of all."""
    count = sum(judgement.verdict in GOOD for judgement in report.judgements)
    return f"{count}/{len(report.judgements)}"


def verdict_line(report: TaskReport) -> Sentence:
    """Return a task's name, its verdict and the number of cases passed."""
    return sentence(
        "{task}: {verdict}, {passed} cases passed",
        task=title(report),
        verdict=VERDICTS[report.verdict],
        passed=passed(report),
    )


def digits(subject: TaskReport | CaseJudgement) -> str:
    """Return the number of correct digits, a dash without a count."""
    return "–" if subject.digits is None else f"{max(0.0, subject.digits):.1f}"


def speed(report: TaskReport, say: Say) -> str:
    """Return the speed of a solver relative to the reference, a dash without a measurement."""
    if report.untimed:
        return say(sentence("not timed"))
    if report.slowdown is None:
        return "–"
    rate = max(report.slowdown, 1.0 / report.slowdown)
    times = f"{rate:,.0f}" if rate >= 9.95 else f"{rate:.1f}"
    if rate < 1.05:
        return say(sentence("as fast"))
    is_slower = report.slowdown > 1.0
    return say(
        sentence("{times} times slower" if is_slower else "{times} times faster", times=times)
    )


def introduction(report: Report) -> Sentence:
    """Return the solver's name, version and language, and its declared precision."""
    greeting = report.greeting
    name = " ".join(filter(None, (greeting.name, greeting.version)))
    language = sentence(", {language}", language=greeting.language) if greeting.language else ""
    if any(task.assumptions for task in report.tasks):
        return sentence("{name}{language}", name=name, language=language)
    return sentence(
        "{name}{language}, single precision"
        if greeting.precision == "single"
        else "{name}{language}, double precision",
        name=name,
        language=language,
    )


def remarks(report: Report) -> Iterator[Sentence]:
    """Yield the assumptions, with their tasks if not all, and reasons for missing times."""
    reasons = {str(reason): reason for task in report.tasks for reason in task.assumptions}
    for text, reason in reasons.items():
        tasks = [title(task) for task in report.tasks if text in map(str, task.assumptions)]
        partial = sentence("{tasks}: {reason}", tasks=", ".join(tasks), reason=reason)
        yield partial if len(tasks) < len(report.tasks) else reason
    if unwritten := [title(task) for task in report.tasks if is_unwritten(task)]:
        yield sentence(
            "Not written yet: {tasks}. Put your code into the starter, and delete what you do not "
            "have from its tasks.",
            tasks=", ".join(unwritten),
        )
    yield from [task.untimed for task in report.tasks if task.untimed][:1]
    yield from report.remarks


def is_unwritten(task: TaskReport) -> bool:
    """Return whether all answers to a task come from a starter as written."""
    return bool(task.judgements) and all(
        isinstance(judgement.answer, Failure) and UNWRITTEN in str(judgement.answer.sentence)
        for judgement in task.judgements
    )


def explanations(report: TaskReport) -> Iterator[Sentence]:
    """Yield observations on wrong answers, then causes, nearest first, behaviour and hints."""
    diagnosis = report.diagnosis
    yield from diagnosis.observations
    for i, explanation in enumerate(diagnosis.explanations):
        yield sentence(
            "Or: {what} (explains {share:.0%} of the answers compared)"
            if i
            else "{what} (explains {share:.0%} of the answers compared)",
            what=explanation.sentence,
            share=explanation.share,
        )
    yield from filter(None, (diagnosis.first_broken, diagnosis.behaviour, *diagnosis.hints))


def reservations(task: TaskReport) -> list[Sentence]:
    """Return mistakes, each kind of the worst complaints about right answers, and the behaviour.

    Each kind is represented by the complaint with the largest error.
    """
    kinds: dict[tuple[str, str], Sentence] = {}
    for judgement in task.judgements:
        for complaint in judgement.complaints[:1] if judgement.verdict is task.verdict else ():
            cause = complaint.values.get("cause")
            kind = complaint.template, cause.template if isinstance(cause, Sentence) else ""
            if kind not in kinds or _error_in(complaint) > _error_in(kinds[kind]):
                kinds[kind] = complaint
    mistakes = [words for words in explanations(task) if codes_in(words)]
    other_sentences = [words for words in explanations(task) if words not in mistakes]
    return [*mistakes, *kinds.values(), *other_sentences]


def _error_in(words: Sentence) -> float:
    """Return the error in a complaint, or in its part after the frame, else 0."""
    parts = [words, *(part for part in words.values.values() if isinstance(part, Sentence))]
    errors = [part.values.get("error") for part in parts]
    return max((float(error) for error in errors if isinstance(error, int | float)), default=0.0)


def advice(tasks: Sequence[TaskReport]) -> Sentence:
    """Return the next step to take."""
    bad = [task for task in tasks if task.verdict not in GOOD]
    if not bad:
        return sentence(
            "Next: correct what is said above, or leave it if it is meant. Then --junit FILE for "
            "your CI, plumbob.testing for your pytest, --thorough for more cases."
            if any(task.verdict is Verdict.RIGHT_EXCEPT for task in tasks)
            else "Next: --junit FILE for your CI, plumbob.testing for your pytest, --thorough for "
            "more cases."
        )
    if is_unwritten(bad[0]):
        template = sentence("Next: write {task}, then run this again.")
        return Sentence(template.template, {"task": title(bad[0])})
    first = bad[0]
    if first.needs_declaration:
        return sentence("Next: declare what is meant in the greeting; correct the rest.")
    if first.verdict is Verdict.UNDECIDED and not first.diagnosis.explained:
        return (
            sentence("Next: compare your step with the nearest known one; if it is meant to be "
                     'another, declare it by "step" in the greeting (docs/protocol.md).')
            if first.task in STEPS and first.diagnosis.hints
            else sentence("Next: run more cases with --thorough.")
        )  # fmt: skip
    template = sentence("Next: correct {task}, rerun the saved case, then run all cases again.")
    if first.verdict is Verdict.BROKEN and not first.diagnosis.explained:
        template = sentence("Next: make {task} answer every case first; the failing case is saved.")
    elif len(bad) > 1:
        template = sentence(
            "Next: correct {task} first, since other tasks may depend on it; then run this again."
        )
    step = Sentence(template.template, {"task": title(first)})
    codes = [code for cause in first.diagnosis.explanations[:1] for code in cause.codes]
    if not codes:
        return step
    pointer = sentence(
        "plumbob explain {code} shows the mistake in a short program.", code=codes[0]
    )
    return sentence("{step} {pointer}", step=step, pointer=pointer)
