"""The command `plumbob verify`."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..help_text import Command

if TYPE_CHECKING:
    from plumbob.crosscheck.verify.output.files import Files
    from plumbob.crosscheck.verify.output.question import Question
    from plumbob.crosscheck.verify.output.words import Say
    from plumbob.crosscheck.verify.solvers import ProcessLimits

RIGHT, WRONG = 0, 1
PROGRAM = "plumbob.program"
EXAMPLES = (
    "plumbob verify my_ik.py                    the functions of a Python file",
    "plumbob verify my_package.cloth:Solver     an object of a module",
    "plumbob verify -- ./my_solver --flag       any program that speaks the protocol",
    "plumbob verify --template cpp              a starter for such a program",
    "plumbob verify --export-cases cases        for code that can only read and write files,",
    "plumbob verify --answers cases             and what it has written there",
    "plumbob verify my_ik.py --html verdict.html --junit verdict.xml",
    "plumbob verify my_ik.py --rerun plumbob_failures/CASE.json",
)


class SolverCommand(Command):
    """A command that leaves all behind -- as it is: a program and its own options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the program aside and parse the rest."""
        if "--" in args:
            place = args.index("--")
            ctx.meta[PROGRAM] = args[place:]
            args = args[:place]
        return super().parse_args(ctx, args)


def program_of(context: typer.Context) -> list[str]:
    """Return the program behind --, without that; nothing if there is none."""
    return list(context.meta.get(PROGRAM, ()))[1:]


_File = Path | None
Solver = Annotated[
    list[str] | None,
    typer.Argument(metavar="SOLVER", help="my_ik.py, module:object, or -- and a program."),
]
Task = Annotated[list[str] | None, typer.Option(metavar="NAME", help="Only this task; repeatable.")]
Names = Annotated[bool, typer.Option("--list", help="List the tasks and stop.")]
Template = Annotated[
    str | None,
    typer.Option(metavar="LANGUAGE", help="Write a starter: cpp, rust, javascript, ..."),
]
Export = Annotated[
    _File,
    typer.Option("--export-cases", metavar="DIR", help="Write cases, to be answered by files."),
]
Answers = Annotated[_File, typer.Option(metavar="DIR", help="Judge the answers in such a folder.")]
Rerun = Annotated[_File, typer.Option(metavar="FILE", help="Ask a saved failing case again.")]
Thorough = Annotated[bool, typer.Option("--thorough", help="Ask the long list.")]
Seed = Annotated[int, typer.Option(min=0, help="Of the random cases.")]
TimeLimit = Annotated[float | None, typer.Option(metavar="SECONDS", help="For one request.")]
MemoryLimit = Annotated[int | None, typer.Option(metavar="MIB", min=1, help="For the solver.")]
Json = Annotated[_File, typer.Option(metavar="FILE", help="Write JSON.")]
Junit = Annotated[_File, typer.Option(metavar="FILE", help="Write JUnit XML.")]
Html = Annotated[_File, typer.Option(metavar="FILE", help="Write a page.")]
Output = Annotated[
    _File, typer.Option("--output", "-o", metavar="DIR", help="Write all three, and failing cases.")
]
Lang = Annotated[
    str | None, typer.Option(metavar="LANG", help="en or zh; else as the locale says.")
]
SelfTest = Annotated[
    bool, typer.Option("--self-test", help="Show that every known fault is found.")
]


def verify(  # noqa: PLR0913 -- one parameter an option
    context: typer.Context,
    solver: Solver = None,
    task: Task = None,
    names: Names = False,
    template: Template = None,
    export: Export = None,
    answers: Answers = None,
    rerun: Rerun = None,
    thorough: Thorough = False,
    seed: Seed = 0,
    time_limit: TimeLimit = None,
    memory_limit: MemoryLimit = None,
    json: Json = None,
    junit: Junit = None,
    html: Html = None,
    output: Output = None,
    lang: Lang = None,
    self_test: SelfTest = False,
) -> int:
    """Judge your solver: is it right, how far off is it, and which mistake is it?

    Exit code 0 if every task is RIGHT or RIGHT BUT, 1 if not, 2 for a wrong command
    or a file that could not be written.
    """
    _keep_to_one_thread()
    from plumbob.crosscheck.verify.language import language_of
    from plumbob.crosscheck.verify.output import listings
    from plumbob.crosscheck.verify.output.files import Files
    from plumbob.crosscheck.verify.output.question import ANSWERS, Question, limits
    from plumbob.crosscheck.verify.output.words import speaker

    language = lang or language_of()
    say = speaker(language)
    if names:
        return _print(listings.described(task or (), say))
    if template:
        return _print(listings.starter(template, Path(), say))
    if export:
        return _print(listings.exported(export, task or (), seed, thorough, say))
    if self_test:
        if task or solver or answers:
            raise ValueError("--self-test: expected no task or solver with it: it tries the judge")
        return _self_test(say)
    folder = [ANSWERS, str(answers)] if answers else []
    words = [*folder, *(solver or ()), *context.meta.get(PROGRAM, ())]
    question = Question(tuple(task or ()), rerun, thorough, seed)
    files = Files(json, junit, html, output)
    return _judge(words, limits(time_limit, memory_limit), question, files, language)


def _keep_to_one_thread() -> None:
    """Let NumPy, not yet imported, keep to one thread.

    Solver and reference are timed beside each other on one thread each, and the dense systems of
    the search are too small for more.
    """
    from plumbob.crosscheck.child_process import one_thread

    os.environ |= {**one_thread(), **os.environ}


def _judge(
    words: list[str], limits: "ProcessLimits", question: "Question", files: "Files", language: str
) -> int:
    """Ask a solver, print the verdict, and write the files that are wanted."""
    from plumbob.crosscheck.verify.contestant import NoGreetingError
    from plumbob.crosscheck.verify.output.question import ask, opened, suited
    from plumbob.crosscheck.verify.output.words import Presentation, speaker
    from plumbob.crosscheck.verify.sentence import sentence

    from ..terminal import progress

    say = speaker(language)
    _check(files)
    contestant = opened(words, limits, say)
    question = suited(question, contestant)
    try:
        with progress() as bar:
            shown = bar.add_task("", total=None)
            report = ask(contestant, question, lambda task, done, of: bar.update(
                shown, description=task, completed=done, total=of))  # fmt: skip
    except NoGreetingError as error:
        raise ValueError(say(sentence(
            "solver: expected one that can be started: {why}", why=error.failure.sentence
        ))) from None  # fmt: skip
    return files.write(report, question, Presentation(say, language, words))


def _check(files: "Files") -> None:
    """Find out before anything is asked whether the files can be written.

    Raises:
        ValueError, OSError: naming the file or folder that cannot.
    """
    from plumbob.bench.harness.record import check_regular

    from .options import writable

    for path in filter(None, files.paths()):
        check_regular(path)
        writable(path.parent)


def _print(lines: Iterable[str]) -> int:
    print("\n".join(lines))
    return RIGHT


def _self_test(say: "Say") -> int:
    """Show that every fault is caught and named, and nobody is accused who is right."""
    from rich.console import Console
    from rich.progress import track

    from plumbob.crosscheck.verify.output.listings import self_test
    from plumbob.crosscheck.verify.self_test import attempt, subjects

    console = Console(stderr=True)
    known = list(subjects())
    shown = track(known, "", console=console, transient=True, disable=not console.is_terminal)
    trials = [attempt(subject) for subject in shown]
    _print(self_test(trials, say))
    return RIGHT if all(trial.passed for trial in trials) else WRONG
