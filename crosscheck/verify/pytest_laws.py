"""Laws of a Python solver as one parametrised test for pytest."""

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from .contestant import Failure
from .functions import FunctionContestant
from .judgement import LEAST_SHARE, CaseJudgement, TaskReport, Verdict
from .message import decode_greeting
from .sentence import Sentence
from .solvers.host import PythonSolver
from .verify import DISCIPLINES, judge_cases, trials


def laws(
    solver: object = None,
    /,
    *,
    seed: int = 0,
    thorough: bool = False,
    **functions: Callable[..., Any],
) -> Callable[..., None]:
    """Return a test function, parametrised over every case that is asked of a solver.

    Bind it to a name that pytest collects: `test_my_solver = laws(my_module)`, or
    `test_fk = laws(forward_kinematics=my_fk, ccd=my_ccd)`. A test fails with the sentence that says
    what is wrong, and with the mistake that explains it; one below the rounding floor is skipped.

    Args:
        solver: a module or an object with functions by the tasks' names.
        seed: of the random cases.
        thorough: whether to ask the long list of cases.
        functions: by the names of the tasks, or `ccd` and `fabrik`; a dict PLUMBOB declares.

    Raises:
        ValueError: if nothing of that is a solver.
    """
    if (solver is None) == (not functions):
        raise ValueError("laws: expected a module or functions by name, got both or neither")
    found = functions if solver is None else solver
    name = getattr(solver, "__name__", "") or "solver"
    declared = functions.get("PLUMBOB") or getattr(solver, "PLUMBOB", None) or {}
    offered = PythonSolver(found, name, declared)
    contestant = FunctionContestant(offered.functions, decode_greeting(offered.greeting))
    groups = {
        (task, method): DISCIPLINES[task].cases(contestant.greeting, method, seed, thorough)
        for task, method in trials(contestant.greeting)
    }

    @cache
    def judged(task: str, method: str) -> TaskReport:
        return judge_cases(contestant, task, method, groups[task, method])

    @pytest.mark.parametrize(("task", "method", "case"), [
        pytest.param(task, method, case.name, id=" ".join(filter(None, (task, method, case.name))))
        for (task, method), cases in groups.items()
        for case in cases
    ])  # fmt: skip
    def test_law(task: str, method: str, case: str) -> None:
        _check(judged(task, method), case)

    return test_law


def _check(report: TaskReport, name: str) -> None:
    """Fail if a case is not right; skip it if nobody can tell."""
    one = next((one for one in report.judgements if one.case.name == name), None)
    if one is None:
        words = "it was not asked, since too many answers before were waited for"
        pytest.fail(words, pytrace=False)
    if one.verdict is Verdict.UNDECIDED:
        pytest.skip("; ".join(map(str, _words(one))) or "nobody can tell")
    if one.verdict > Verdict.UNDECIDED:
        why = [one.sentence for one in report.diagnosis.explanations if one.share >= LEAST_SHARE]
        pytest.fail("\n".join(map(str, [*_words(one), *why])), pytrace=False)


def _words(one: CaseJudgement) -> list[Sentence]:
    if isinstance(one.answer, Failure):
        return [one.answer.sentence]
    found = [finding for finding in one.findings if finding.verdict is not Verdict.RIGHT]
    return [finding.sentence for finding in sorted(found, key=lambda one: -one.verdict)]
