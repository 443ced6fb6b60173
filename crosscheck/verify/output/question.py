"""Which solver a command line means, and what it is asked."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ..contestant import Contestant
from ..judgement import Report
from ..sentence import sentence
from ..solvers import LIMITS, ProcessLimits, open_contestant
from ..solvers.files import FileContestant
from ..verify import DISCIPLINES, judge_cases, verify
from . import saved
from .words import Say

# Told the task, the number of cases done, and of all, before each case.
Notify = Callable[[str, int, int], None]


# What stands before a program, and before a folder of answers.
PROGRAM, ANSWERS = "--", "--answers"


def limits(seconds: float | None, mebibytes: int | None) -> ProcessLimits:
    """Return the limits of a program; the first request of a task may take longer, to compile.

    Raises:
        ValueError: if the time is none.
    """
    if seconds is not None and not 0.0 < seconds < float("inf"):
        raise ValueError(f"time-limit: expected seconds above 0, got {seconds}")
    chosen = LIMITS if mebibytes is None else LIMITS._replace(memory=mebibytes << 20)
    if seconds is None:
        return chosen
    return chosen._replace(request=seconds, first=max(seconds, chosen.first))


def opened(words: Sequence[str], chosen: ProcessLimits, say: Say) -> Contestant:
    """Return the solver behind its door.

    Args:
        words: a Python file, module:object or the like; or "--", a program, its arguments; or
            "--answers" and a folder.
        chosen: what it may take.
        say: for what is wrong with the words.

    Raises:
        ValueError: if the words name no solver.
    """
    if words[:1] == [PROGRAM] and len(words) > 1:
        return open_contestant(words[1:], chosen)
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
    return open_contestant(words[0], chosen)


class Question(NamedTuple):
    """Which cases to ask."""

    tasks: tuple[str, ...] = ()  # only these, () for all that the solver offers
    rerun: Path | None = None  # a saved failing case, which is then all that is asked
    thorough: bool = False  # thorough, seed: as of `plumbob.crosscheck.verify.verify`
    seed: int = 0


def suited(question: Question, contestant: Contestant) -> Question:
    """Return the question with the cases that were exported, where answers are files."""
    if isinstance(contestant, FileContestant):
        return question._replace(seed=contestant.seed, thorough=contestant.thorough)
    return question


def ask(contestant: Contestant, question: Question, notify: Notify) -> Report:
    """Return what was found; the solver is ended then, whatever happens."""
    try:
        report = _report(contestant, question, notify)
    finally:
        contestant.close()  # its remarks are complete then
    return replace(report, remarks=(*report.remarks, *contestant.remarks))


def _report(contestant: Contestant, question: Question, notify: Notify) -> Report:
    if question.rerun is None:
        return verify(contestant, question.tasks or None, question.seed, question.thorough, notify)
    one = saved.load(question.rerun)
    greeting = contestant.greeting
    if one.task not in greeting.tasks or one.task not in DISCIPLINES:
        raise ValueError(f"--rerun: the solver does not offer the task {one.task!r}")
    cases = DISCIPLINES[one.task].cases(greeting, one.method, one.seed, one.thorough)
    wanted = saved.cases_of(one, cases)
    judged = judge_cases(contestant, one.task, one.method, wanted, notify)
    return Report(greeting, [judged], one.seed)
