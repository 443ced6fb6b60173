"""The command `plumbob verify`."""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .help_text import Command
from .options import FAILED, SUCCESS, File, Text, Texts, argument, flag, option

if TYPE_CHECKING:
    from plumbob.text.sentence import Say, Sentence
    from plumbob.verify.connections import ProcessLimits
    from plumbob.verify.connections.command import CaseOptions
    from plumbob.verify.judgement import Report
    from plumbob.verify.screen.files import Files
    from plumbob.verify.screen.words import Presentation
    from plumbob.verify.verify import Notify

PROGRAM = "plumbob.program"
# Seconds between lines on progress in a pipe: after a longer silence, a service may assume a hang.
LINE_PAUSE = 6.0


class SolverCommand(Command):
    """A command that keeps the words behind --: a program and its own options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the program aside and parse the rest."""
        if "--" in args:
            place = args.index("--")
            ctx.meta[PROGRAM] = args[place:]
            args = args[:place]
        return super().parse_args(ctx, args)


def program_of(context: typer.Context) -> list[str]:
    """Return the program behind --, without the dashes; empty if none."""
    return list(context.meta.get(PROGRAM, ()))[1:]


Solver = Annotated[Texts, argument("SOLVER", "my_ik.py, module:object, or -- and a program.")]
Tasks = Annotated[Texts, option("NAME", "Judge only this task; repeatable.")]
Template = Annotated[Text, option("LANGUAGE", "Write a starter: cpp, rust, javascript, ...")]
Export = Annotated[File, option("DIR", "Write the cases as files and stop.", "--export-cases")]
Answers = Annotated[File, option("DIR", "Judge the answers to exported cases.")]
TimeLimit = Annotated[float | None, option("SECONDS", "Time limit of one request.")]
MemoryLimit = Annotated[int | None, option("MIB", "Memory limit of the solver.", min=1)]
Folder = Annotated[
    File, option("DIR", "Write all four formats and failing cases.", "--output", "-o")
]
Language = Annotated[Text, option("LANG", "Language: en or zh (zh-CN); default: the locale.")]
Schema = Annotated[bool, flag("Print the JSON Schema of the protocol.", "--schema")]
SelfTest = Annotated[bool, flag("Test verify itself with all known faults.", "--self-test")]


def verify(  # noqa: PLR0913 -- one parameter an option
    context: typer.Context,
    solver: Solver = None,
    *,
    task: Tasks = None,
    names: Annotated[bool, flag("List the tasks and stop.", "--list")] = False,
    template: Template = None,
    export: Export = None,
    answers: Answers = None,
    rerun: Annotated[File, option("FILE", "Repeat a saved failing case.")] = None,
    thorough: Annotated[bool, flag("Run more cases; this takes longer.", "--thorough")] = False,
    seed: Annotated[int, option("", "Seed of the random cases.", min=0)] = 0,
    time_limit: TimeLimit = None,
    memory_limit: MemoryLimit = None,
    json: Annotated[File, option("FILE", "Write the verdict as JSON.")] = None,
    junit: Annotated[File, option("FILE", "Write the verdict as JUnit XML.")] = None,
    html: Annotated[File, option("FILE", "Write the verdict as a page.")] = None,
    output: Folder = None,
    lang: Language = None,
    schema: Schema = False,
    self_test: SelfTest = False,
) -> int:
    """Judge your solver: is it right, how large are its errors, what is the mistake?

    Exit code 0 if every task is RIGHT or RIGHT EXCEPT, 1 if not, 2 if a command or file is wrong,
    3 if Plumbob itself failed at a task and the other tasks are right.
    """
    if schema:
        return _print_schema()
    with _starting() as bar:
        from plumbob.text.language import language_of
        from plumbob.verify.connections.command import CaseOptions, limits
        from plumbob.verify.screen.files import Files
        from plumbob.verify.screen.words import Presentation, speaker

        language = language_of(lang)
        folder = ["--answers", str(answers)] if answers else []
        words = [*folder, *(solver or ()), *context.meta.get(PROGRAM, ())]
        options = CaseOptions(tuple(task or ()), rerun, thorough, seed)
        presentation = Presentation(speaker(language), language, words)
        finish: Callable[[], int]
        if names or template or export:
            finish = partial(_list, options, names, template, export, presentation.say)
        elif self_test:
            finish = partial(_self_test, [*words, *options.tasks], presentation.say)
        else:
            files = Files(json, junit, html, output)
            finish = _judge(presentation, limits(time_limit, memory_limit), options, files, bar)
    return finish()


@contextmanager
def _starting() -> Iterator[Any]:
    """Show the progress of imports and of the judge, which take seconds, on a bar."""
    # Solver and reference are timed on a thread each; NumPy is not imported yet.
    from plumbob.process.child import one_thread

    os.environ |= {**one_thread(), **os.environ}
    from .terminal import lines_in_a_pipe, progress

    with progress() as bar, lines_in_a_pipe(bar, (LINE_PAUSE, LINE_PAUSE)):
        bar.add_task("starting", total=None)
        yield bar


def _list(
    options: "CaseOptions", names: bool, template: str | None, export: Path | None, say: "Say"
) -> int:
    """Print the tasks, or write a starter or cases and print what to do next."""
    from plumbob.verify.screen import listings

    if template and not names:
        return _print(listings.starter(template, Path(), say))
    if export and not names:
        cases = options.tasks, options.seed, options.thorough
        return _print(listings.exported(export, *cases, say))
    return _print(listings.described(options.tasks, say))


def _judge(
    context: "Presentation",
    limits: "ProcessLimits",
    options: "CaseOptions",
    files: "Files",
    bar: Any,
) -> Callable[[], int]:
    """Judge a solver; return what prints the verdict, writes the files and gives the exit code."""
    from plumbob.process.paths import check_regular
    from plumbob.text.sentence import sentence
    from plumbob.verify.connections.command import judge, open_named, options_of_answers
    from plumbob.verify.exchange import NoGreetingError
    from plumbob.verify.screen.files import UNJUDGED
    from plumbob.verify.verify import failed

    from .options import writable

    say = context.say
    for path in filter(None, files.paths()):
        check_regular(path)
        writable(path.parent)
    user_solver = open_named(list(context.solver), limits, say)
    options = options_of_answers(options, user_solver)
    notify, publish = _notifier(bar, say), _publisher(bar, files, options, context)
    try:
        notify(sentence("starting the solver"), 0, None)
        report = judge(user_solver, options, notify, publish)
    except NoGreetingError as error:
        raise ValueError(say(sentence(
            "solver: it did not start, or did not answer the greeting (the first request). {why}",
            why=error.failure.sentence,
        ))) from None  # fmt: skip
    except (OSError, ValueError):
        raise
    except Exception as error:
        print("plumbob:", say(failed(error)), file=sys.stderr)
        return lambda: UNJUDGED
    return partial(files.write, report, options, context)


def _notifier(bar: Any, say: "Say") -> "Notify":
    """Return what shows the progress of the present work on a bar."""
    row = bar.tasks[0].id

    def notify(work: "Sentence", count: int, total: int | None) -> None:
        nonlocal row
        if (text := say(work)) != bar.tasks[0].description:
            bar.remove_task(row)
            row = bar.add_task(text, total=total)
        bar.update(row, completed=count)

    return notify


def _publisher(
    bar: Any, files: "Files", options: "CaseOptions", context: "Presentation"
) -> Callable[["Report"], None]:
    """Return what prints the newest verdict and writes the files, before any cause is sought."""
    from plumbob.verify.screen.words import verdict_line

    def publish(report: "Report") -> None:
        if report.tasks:
            line = context.say(verdict_line(report.tasks[-1]))
            bar.console.print(line, highlight=False, markup=False, soft_wrap=True)
        files.save(report, options, context)

    return publish


def _print(lines: Iterable[str]) -> int:
    print("\n".join(lines))
    return SUCCESS


def _print_schema() -> int:
    from plumbob.verify.schema import text

    return _print([text()])


def _self_test(words: list[str], say: "Say") -> int:
    """Check that every fault is found and named, and no right solver is accused."""
    if words:
        raise ValueError("--self-test: expected no task or solver with it: it tries the judge")
    from rich.console import Console
    from rich.progress import track

    from plumbob.verify.screen.listings import self_test
    from plumbob.verify.self_test import attempt, subjects

    console = Console(stderr=True)
    solvers = track(
        list(subjects()), "", console=console, transient=True, disable=not console.is_terminal
    )
    trials = [attempt(solver) for solver in solvers]
    _print(self_test(trials, say))
    return SUCCESS if all(trial.passed for trial in trials) else FAILED
