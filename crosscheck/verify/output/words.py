"""What the terminal, the files and the page of `verify` share: verdicts in words."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ..judgement import LEAST_SHARE, CaseJudgement, Report, TaskReport, Verdict
from ..language import translator
from ..sentence import Sentence, sentence, visible
from . import saved

Say = Callable[[Sentence], str]
GOOD = (Verdict.RIGHT, Verdict.RIGHT_BUT)
VERDICTS = {
    Verdict.RIGHT: sentence("RIGHT"),
    Verdict.RIGHT_BUT: sentence("RIGHT BUT"),
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
        """Return the command that asks the saved case of a task again, None if there is none."""
        path = self.files.get((task.task, task.method))
        return saved.command(self.solver, path) if path else None


def speaker(language: str) -> Say:
    """Return a function that translates a sentence to one line of printable text."""
    translate = translator(language)
    return lambda words: visible(words.text(translate))


def title(report: TaskReport) -> str:
    """Return a task's name, with its method."""
    return visible(f"{report.task} {report.method}".strip())


def passed(report: TaskReport) -> str:
    """Return the number of cases that are RIGHT or RIGHT BUT, and of all."""
    count = sum(judgement.verdict in GOOD for judgement in report.judgements)
    return f"{count}/{len(report.judgements)}"


def digits(subject: TaskReport | CaseJudgement) -> str:
    """Return the number of correct digits, a dash if it cannot be counted."""
    return "–" if subject.digits is None else f"{subject.digits:.1f}"


def speed(report: TaskReport, say: Say) -> str:
    """Return the speed of a solver relative to the reference, a dash if it is not measured."""
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
    """Return the solver's name, version and language, and its precision if it is as declared."""
    greeting = report.greeting
    name = " ".join(filter(None, (greeting.name, greeting.version)))
    language = sentence(", {language}", language=greeting.language) if greeting.language else ""
    if any(task.precision for task in report.tasks):
        return sentence("{name}{language}", name=name, language=language)
    return sentence(
        "{name}{language}, single precision"
        if greeting.precision == "single"
        else "{name}{language}, double precision",
        name=name,
        language=language,
    )


def remarks(report: Report) -> Iterator[Sentence]:
    """Yield reasons for a precision, with their tasks if not all, and for the lack of a time."""
    reasons = {str(task.precision): task.precision for task in report.tasks if task.precision}
    for text, reason in reasons.items():
        tasks = [title(task) for task in report.tasks if str(task.precision) == text]
        partial = sentence("{tasks}: {reason}", tasks=", ".join(tasks), reason=reason)
        yield partial if len(tasks) < len(report.tasks) else reason
    yield from [task.untimed for task in report.tasks if task.untimed][:1]
    yield from report.remarks


def explanations(report: TaskReport) -> Iterator[Sentence]:
    """Yield explanations of wrong answers, nearest first, then the inferred behaviour and hints."""
    diagnosis = report.diagnosis
    for i, explanation in enumerate(diagnosis.explanations):
        yield sentence(
            "Or: {what} (explains {share:.0%} of the answers compared)"
            if i and explanation.share >= LEAST_SHARE
            else "{what} (explains {share:.0%} of the answers compared)"
            if explanation.share >= LEAST_SHARE
            else "The nearest known mistake explains only {share:.0%} of the answers: {what}",
            what=explanation.sentence,
            share=explanation.share,
        )
    yield from filter(None, (diagnosis.first_broken, diagnosis.behaviour, *diagnosis.hints))


def advice(tasks: Sequence[TaskReport]) -> Sentence:
    """Return what to do next."""
    bad = [task for task in tasks if task.verdict not in GOOD]
    if not bad:
        return sentence(
            "Next: --junit FILE for your CI, plumbob.testing for your pytest, --thorough for "
            "more cases."
        )
    first = bad[0]
    if first.verdict is Verdict.UNDECIDED:
        return (
            sentence('Next: declare the step that you make, by "step" in the greeting '
                     "(docs/protocol.md).")
            if first.diagnosis.hints
            else sentence("Next: run more cases with --thorough.")
        )  # fmt: skip
    template = sentence("Next: correct {task}, rerun the saved case, then run all cases again.")
    if first.verdict is Verdict.BROKEN and not first.diagnosis.explained:
        template = sentence("Next: make {task} answer every case first; the failing case is saved.")
    elif len(bad) > 1:
        template = sentence(
            "Next: correct {task} first, since other tasks may depend on it; then run this again."
        )
    return Sentence(template.template, {"task": title(first)})
