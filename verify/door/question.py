"""The solver and the cases that a command line names."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from plumbob.text.sentence import Say, sentence

from ..contestant import Contestant
from ..disciplines import DISCIPLINES
from ..judgement import Report
from ..verify import Notify, judge_cases, verify
from . import LIMITS, ProcessLimits, open_contestant, saved
from .files import FileContestant

# The words before a program, and before a folder of answers.
PROGRAM, ANSWERS = "--", "--answers"


def limits(seconds: float | None, mebibytes: int | None) -> ProcessLimits:
    """Return the limits of a program; the first request of a task may take longer, to compile."""
    if seconds is not None and not 0.0 < seconds < float("inf"):
        raise ValueError(f"time-limit: expected seconds above 0, got {seconds}")
    limits = LIMITS if mebibytes is None else LIMITS._replace(memory=mebibytes << 20)
    if seconds is None:
        return limits
    return limits._replace(request=seconds, first=max(seconds, limits.first))


def opened(words: Sequence[str], limits: ProcessLimits, say: Say) -> Contestant:
    """Return the solver that the words of a command line name; raise ValueError if none."""
    if words[:1] == [PROGRAM] and len(words) > 1:
        return open_contestant(words[1:], limits)
    if words[:1] == [ANSWERS] and len(words) > 2:
        raise ValueError(say(sentence(
            "answers: expected a folder in place of a solver, got {solver} as well",
            solver=" ".join(words[2:]),
        )))  # fmt: skip
    if words[:1] == [ANSWERS]:
        return FileContestant(Path(words[1]))
    if not words or words == [PROGRAM]:
        raise ValueError(say(sentence(
            "solver: expected a Python file, module:object, or -- and a program, got none; "
            "plumbob verify --template python writes a starter"
        )))  # fmt: skip
    if len(words) > 1:
        raise ValueError(say(sentence(
            "solver: expected one Python file or module:object, got {count} words; a program "
            "stands behind --, as in plumbob verify -- {program}",
            count=len(words), program=" ".join(words),
        )))  # fmt: skip
    return open_contestant(words[0], limits)


class Question(NamedTuple):
    """The cases to ask; arguments as of `verify`."""

    tasks: tuple[str, ...] = ()  # () for all that the solver offers
    rerun: Path | None = None  # a saved failing case, then the only one
    thorough: bool = False
    seed: int = 0


def suited(question: Question, contestant: Contestant) -> Question:
    """Return the question about the exported cases if the answers are files."""
    if isinstance(contestant, FileContestant):
        return question._replace(seed=contestant.seed, thorough=contestant.thorough)
    return question


def ask(
    contestant: Contestant,
    question: Question,
    notify: Notify,
    publish: Callable[[Report], None] = lambda report: None,
) -> Report:
    """Return the report, and end the solver; call `publish` as `verify` does."""
    try:
        report = _report(contestant, question, notify, publish)
    finally:
        contestant.close()  # its remarks are complete then
    return replace(report, remarks=(*report.remarks, *contestant.remarks))


def _report(
    contestant: Contestant,
    question: Question,
    notify: Notify,
    publish: Callable[[Report], None],
) -> Report:
    if question.rerun is None:
        options = question.tasks or None, question.seed, question.thorough
        return verify(contestant, *options, notify, publish)
    case, greeting = saved.load(question.rerun), contestant.greeting
    if case.task not in greeting.tasks or case.task not in DISCIPLINES:
        raise ValueError(f"--rerun: the solver does not offer the task {case.task!r}")
    cases = DISCIPLINES[case.task].cases(greeting, case.method, case.seed, case.thorough)
    cases = saved.cases_of(case, cases)
    report = judge_cases(contestant, case.task, case.method, cases, notify)
    return Report(greeting, [report], case.seed)
