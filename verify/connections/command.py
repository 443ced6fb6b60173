"""The solver and the cases of a command line."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from plumbob.text.sentence import Say, sentence

from ..disciplines import DISCIPLINES
from ..exchange import Connection
from ..judgement import Report
from ..verify import Notify, judge_cases, verify
from . import LIMITS, ProcessLimits, open_connection, saved
from .files import FileConnection

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


def open_named(words: Sequence[str], limits: ProcessLimits, say: Say) -> Connection:
    """Return the solver in the words of a command line; raise ValueError if none."""
    if words[:1] == [PROGRAM] and len(words) > 1:
        return open_connection(words[1:], limits)
    if words[:1] == [ANSWERS] and len(words) > 2:
        raise ValueError(say(sentence(
            "answers: expected a folder in place of a solver, got {solver} as well",
            solver=" ".join(words[2:]),
        )))  # fmt: skip
    if words[:1] == [ANSWERS]:
        return FileConnection(Path(words[1]))
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
    return open_connection(words[0], limits)


class CaseOptions(NamedTuple):
    """The cases of a command line; arguments as of `verify`."""

    tasks: tuple[str, ...] = ()  # () for all that the solver offers
    rerun: Path | None = None  # a saved failing case, then the only one
    thorough: bool = False
    seed: int = 0


def options_of_answers(options: CaseOptions, connection: Connection) -> CaseOptions:
    """Return the options about the exported cases if the answers are files."""
    if isinstance(connection, FileConnection):
        return options._replace(seed=connection.seed, thorough=connection.thorough)
    return options


def judge(
    connection: Connection,
    options: CaseOptions,
    notify: Notify,
    publish: Callable[[Report], None] = lambda report: None,
) -> Report:
    """Return the report, and end the solver; call `publish` as `verify` does."""
    try:
        report = _report(connection, options, notify, publish)
    finally:
        connection.close()  # its remarks are complete then
    return replace(report, remarks=(*report.remarks, *connection.remarks))


def _report(
    connection: Connection,
    options: CaseOptions,
    notify: Notify,
    publish: Callable[[Report], None],
) -> Report:
    if options.rerun is None:
        tasks, seed = options.tasks or None, options.seed
        return verify(connection, tasks, seed, options.thorough, notify, publish)
    case, greeting = saved.load(options.rerun), connection.greeting
    if case.task not in greeting.tasks or case.task not in DISCIPLINES:
        raise ValueError(f"--rerun: the solver does not offer the task {case.task!r}")
    cases = DISCIPLINES[case.task].cases(greeting, case.method, case.seed, case.thorough)
    cases = saved.cases_of(case, cases)
    report = judge_cases(connection, case.task, case.method, cases, notify)
    return Report(greeting, [report], case.seed)
