"""What the terminal, the files and the page of `verify` have in common: verdicts in words."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from ..contestant import Answer
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
    """What is shown besides a report."""

    say: Say  # puts sentences into words of the language
    language: str  # a key of LANGUAGES
    solver: Sequence[str]  # as it stands on the command line
    # where the smallest failing case of a task and method is saved
    files: Mapping[tuple[str, str], Path] = {}

    def command(self, task: TaskReport) -> Sentence | None:
        """Return what asks the saved case of a task again, None if there is none."""
        path = self.files.get((task.task, task.method))
        return saved.command(self.solver, path) if path else None


def speaker(language: str) -> Say:
    """Return what puts a sentence into words of a language, on one line, all of it printable."""
    translate = translator(language)
    return lambda one: visible(one.text(translate))


def title(report: TaskReport) -> str:
    """Return a task's name, with its method."""
    return visible(f"{report.task} {report.method}".strip())


def passed(report: TaskReport) -> str:
    """Return how many cases of all are right, or right but for what is said."""
    return f"{sum(one.verdict in GOOD for one in report.judgements)}/{len(report.judgements)}"


def digits(judged: TaskReport | CaseJudgement) -> str:
    """Return how many digits are correct, a dash where that says nothing."""
    return "–" if judged.digits is None else f"{judged.digits:.1f}"


def speed(report: TaskReport, say: Say) -> str:
    """Return the time of a solver beside the reference's, a dash if that is not measured."""
    if report.untimed:
        return say(sentence("not timed"))
    if report.slowdown is None:
        return "–"
    rate = max(report.slowdown, 1.0 / report.slowdown)
    times = f"{rate:,.0f}" if rate >= 9.95 else f"{rate:.1f}"
    if rate < 1.05:
        return say(sentence("as fast"))
    if report.slowdown > 1.0:
        return say(sentence("{times} x slower", times=times))
    return say(sentence("{times} x faster", times=times))


def introduction(report: Report) -> Sentence:
    """Return who is judged: its name, version, language and precision, if that is so."""
    greeting = report.greeting
    words = " ".join(filter(None, (greeting.name, greeting.version)))
    language = sentence(", {language}", language=greeting.language) if greeting.language else ""
    if any(task.precision for task in report.tasks):
        return sentence("{name}{language}", name=words, language=language)
    return sentence(
        "{name}{language}, single precision"
        if greeting.precision == "single"
        else "{name}{language}, double precision",
        name=words,
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


def complaints(judgement: CaseJudgement) -> list[Sentence]:
    """Return what is wrong with an answer, the worst first; nothing where it is right."""
    if not isinstance(judgement.answer, Answer):
        return [judgement.answer.sentence]
    found = [one for one in judgement.findings if one.verdict is not Verdict.RIGHT]
    return [one.sentence for one in sorted(found, key=lambda one: -one.verdict)]


def explanations(report: TaskReport) -> Iterator[Sentence]:
    """Yield why answers are wrong, nearest first, and what the solver behaves like."""
    for one in report.diagnosis.explanations:
        yield sentence(
            "{what} (explains {share:.0%} of the answers compared)"
            if one.share >= LEAST_SHARE
            else "The nearest known mistake explains only {share:.0%} of the answers: {what}",
            what=one.sentence,
            share=one.share,
        )
    found = report.diagnosis
    yield from filter(None, (found.first_broken, found.behaviour, *found.hints))


def advice(tasks: Sequence[TaskReport]) -> Sentence:
    """Return what to do next."""
    bad = [one for one in tasks if one.verdict not in GOOD]
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
            else sentence("Next: ask the long list of cases with --thorough.")
        )  # fmt: skip
    template = sentence("Next: correct {task}, rerun the saved case, then run all again.")
    if first.verdict is Verdict.BROKEN and not first.diagnosis.explained:
        template = sentence(
            "Next: let {task} answer every case first; what it breaks on is saved above."
        )
    elif len(bad) > 1:
        template = sentence(
            "Next: correct {task} first, since the others may rest on it; then run this again."
        )
    return Sentence(template.template, {"task": title(first)})
