"""Laws of a Python solver as a parametrised test for pytest."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from plumbob.text.printable import harmless, visible

from .connections.host import PythonSolver
from .disciplines import DISCIPLINES
from .functions import FunctionConnection
from .judgement import TaskReport, Verdict
from .message import decode_greeting
from .verify import judge_cases, trials


def laws(
    solver: object = None,
    /,
    *,
    seed: int = 0,
    thorough: bool = False,
    **functions: Callable[..., Any],
) -> Callable[..., None]:
    """Return a test function, parametrised over every case of a solver.

    Bind the test to a name for pytest: `test_my_solver = laws(my_module)`, or
    `test_fk = laws(forward_kinematics=my_fk, ccd=my_ccd)`. A test fails with the sentence about
    the error and with the likely mistake; a case below the rounding floor is skipped.

    Args:
        solver: a module or an object with functions by the tasks' names.
        seed: of the random cases.
        thorough: whether to ask the long list of cases.
        functions: by the names of the tasks, or `ccd` and `fabrik`; a dict PLUMBOB declares.

    Raises:
        ImportError: if pytest is not installed.
        ValueError: if there is no solver, or both a module and functions.
    """
    try:
        import pytest
    except ImportError:
        raise ImportError("laws: expected pytest to be installed; pip install pytest") from None
    connection = _connection_to(solver, functions)
    groups = {
        (task, method): DISCIPLINES[task].cases(connection.greeting, method, seed, thorough)
        for task, method in trials(connection.greeting)
    }

    @cache
    def report(task: str, method: str) -> TaskReport:
        return judge_cases(connection, task, method, groups[task, method])

    @pytest.mark.parametrize(("task", "method", "case"), [
        pytest.param(task, method, case.name, id=" ".join(filter(None, (task, method, case.name))))
        for (task, method), cases in groups.items()
        for case in cases
    ])  # fmt: skip
    def test_law(task: str, method: str, case: str) -> None:
        _check(report(task, method), case)

    return test_law


def _connection_to(
    solver: object, functions: Mapping[str, Callable[..., Any]]
) -> FunctionConnection:
    """Return a module or functions as a connection; raise ValueError of both or neither."""
    if (solver is None) == (not functions):
        raise ValueError("laws: expected a module or functions by name, got both or neither")
    declared = functions.get("PLUMBOB") or getattr(solver, "PLUMBOB", None) or {}
    name = getattr(solver, "__name__", "") or "solver"
    offered = PythonSolver(functions if solver is None else solver, name, declared)
    return FunctionConnection(offered.functions, decode_greeting(offered.greeting))


def _check(report: TaskReport, name: str) -> None:
    """Fail if a case is not right; skip an undecided case."""
    import pytest

    judgements = {judgement.case.name: judgement for judgement in report.judgements}
    judgement = judgements.get(name)
    if judgement is None:
        reason = "it was not asked, since too many answers before were waited for"
        pytest.fail(reason, pytrace=False)
    if judgement.verdict is Verdict.UNDECIDED:
        pytest.skip("; ".join(map(str, judgement.complaints)) or "nobody can tell")
    if judgement.verdict > Verdict.UNDECIDED:
        likely = [explanation.sentence for explanation in report.diagnosis.explanations]
        lines = map(visible, map(str, [*judgement.complaints, *likely]))
        pytest.fail("\n".join(map(harmless, lines)), pytrace=False)
