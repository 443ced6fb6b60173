"""What the terminal, the files and the page of `verify` have in common: verdicts in words."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from plumbob.bench.text import visible

from ..contestant import Answer
from ..judgement import LEAST_SHARE, CaseJudgement, Report, TaskReport, Verdict
from ..language import translator
from ..sentence import Sentence, sentence

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
    """What is shown besides a report.

    Attributes:
        say: puts sentences into words of the language.
        language: a key of LANGUAGES.
        solver: as it stands on the command line.
        files: where the smallest failing case of a task and method is saved.
    """

    say: Say
    language: str
    solver: Sequence[str]
    files: Mapping[tuple[str, str], Path] = {}


def speaker(language: str) -> Say:
    """Return what puts a sentence into words of a language, on one line, all of it printable."""
    translate = translator(language)
    return lambda one: visible(one.text(translate))


def title(report: TaskReport) -> str:
    """Return a task's name, with its method."""
    return visible(f"{report.task} {report.method}".strip())


def passed(report: TaskReport) -> int:
    """Return how many cases are right, or right but for what is said."""
    return sum(one.verdict in GOOD for one in report.judgements)


def speed(report: TaskReport) -> Sentence | None:
    """Return the time of a solver beside the reference's, or None if that is not measured."""
    if report.untimed:
        return sentence("not timed")
    times = report.slowdown
    if times is None:
        return None
    if times >= 9.95:
        return sentence("{times:,.0f} x slower", times=times)
    if times >= 1.05:
        return sentence("{times:.1f} x slower", times=times)
    if times > 1 / 1.05:
        return sentence("as fast")
    if times > 1 / 9.95:
        return sentence("{times:.1f} x faster", times=1 / times)
    return sentence("{times:,.0f} x faster", times=1 / times)


def introduction(report: Report) -> Sentence:
    """Return who is judged: its name, version, language and precision, if that is so."""
    greeting = report.greeting
    words = " ".join(filter(None, (greeting.name, greeting.version)))
    language = sentence(", {language}", language=greeting.language) if greeting.language else ""
    if any(task.precision for task in report.tasks):
        return sentence("{name}{language}", name=words, language=language)
    if greeting.precision == "single":
        return sentence("{name}{language}, single precision", name=words, language=language)
    return sentence("{name}{language}, double precision", name=words, language=language)


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
    found.sort(key=lambda one: -one.verdict)
    return [one.sentence for one in found]


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
    for words in (report.diagnosis.first_broken, report.diagnosis.behaviour):
        if words is not None:
            yield words
    yield from report.diagnosis.hints


def advice(tasks: Sequence[TaskReport]) -> Sentence:
    """Return what to do next."""
    bad = [one for one in tasks if one.verdict not in GOOD]
    if not bad:
        return sentence(
            "Next: --junit FILE for your CI, plumbob.testing for your pytest, --thorough for "
            "more cases."
        )
    first = bad[0]
    if first.verdict is Verdict.UNDECIDED and first.diagnosis.hints:
        return sentence(
            'Next: declare the step that you make, by "step" in the greeting (docs/protocol.md).'
        )
    if first.verdict is Verdict.UNDECIDED:
        return sentence("Next: ask the long list of cases with --thorough.")
    if first.verdict is Verdict.BROKEN and not first.diagnosis.explained:
        return sentence(
            "Next: let {task} answer every case first; what it breaks on is saved above.",
            task=title(first),
        )
    if len(bad) > 1:
        return sentence(
            "Next: correct {task} first, since the others may rest on it; then run this again.",
            task=title(first),
        )
    return sentence("Next: correct {task}, rerun the saved case, then run all again.",
                    task=title(first))  # fmt: skip
