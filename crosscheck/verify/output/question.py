"""Ask a solver what the command line says, with a bar that shows how far it is."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ..contestant import Contestant
from ..judgement import Report
from ..solvers.files import FileContestant
from ..verify import DISCIPLINES, judge_cases, verify
from . import saved


class Question(NamedTuple):
    """Which cases to ask.

    Attributes:
        tasks: only these, () for all that the solver offers.
        rerun: a saved failing case, which is then all that is asked.
        thorough, seed: as of `plumbob.crosscheck.verify.verify`.
    """

    tasks: tuple[str, ...] = ()
    rerun: Path | None = None
    thorough: bool = False
    seed: int = 0


def suited(question: Question, contestant: Contestant) -> Question:
    """Return the question with the cases that were exported, where answers are files."""
    if isinstance(contestant, FileContestant):
        return question._replace(seed=contestant.seed, thorough=contestant.thorough)
    return question


def ask(contestant: Contestant, question: Question) -> Report:
    """Return what was found; the solver is ended then, whatever happens."""
    from plumbob.terminal import progress

    try:
        with progress() as bar:
            shown = bar.add_task("", total=None)
            report = _report(
                contestant,
                question,
                lambda task, done, of: bar.update(
                    shown, description=task, completed=done, total=of
                ),
            )
    finally:
        contestant.close()  # its remarks are complete then
    return replace(report, remarks=(*report.remarks, *contestant.remarks))


def _report(
    contestant: Contestant, question: Question, notify: Callable[[str, int, int], None]
) -> Report:
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
