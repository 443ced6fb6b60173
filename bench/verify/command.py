"""The command `plumbob verify`."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

if TYPE_CHECKING:
    from .words import Say

RIGHT, WRONG = 0, 1
_PROGRAM = "plumbob.program"
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


class SolverCommand(TyperCommand):
    """A command that leaves all behind -- as it is: a program and its own options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the program aside and parse the rest."""
        if "--" in args:
            place = args.index("--")
            ctx.meta[_PROGRAM] = args[place:]
            args = args[:place]
        return super().parse_args(ctx, args)


def verify(  # noqa: PLR0913 -- one parameter an option
    context: typer.Context,
    solver: Annotated[
        list[str] | None,
        typer.Argument(metavar="SOLVER", help="my_ik.py, module:object, or -- and a program."),
    ] = None,
    task: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this task; repeatable.")
    ] = None,
    names: Annotated[bool, typer.Option("--list", help="List the tasks and stop.")] = False,
    template: Annotated[
        str | None,
        typer.Option(metavar="LANGUAGE", help="Write a starter: cpp, rust, javascript, ..."),
    ] = None,
    export: Annotated[
        Path | None,
        typer.Option("--export-cases", metavar="DIR", help="Write cases, to be answered by files."),
    ] = None,
    answers: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Judge the answers in such a folder.")
    ] = None,
    rerun: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Ask a saved failing case again.")
    ] = None,
    thorough: Annotated[bool, typer.Option("--thorough", help="Ask the long list.")] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the random cases.")] = 0,
    time_limit: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="For one request.")
    ] = None,
    memory_limit: Annotated[
        int | None, typer.Option(metavar="MIB", min=1, help="For the solver.")
    ] = None,
    json: Annotated[Path | None, typer.Option(metavar="FILE", help="Write JSON.")] = None,
    junit: Annotated[Path | None, typer.Option(metavar="FILE", help="Write JUnit XML.")] = None,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a page.")] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Write all three, and failing cases."),
    ] = None,
    lang: Annotated[
        str | None, typer.Option(metavar="LANG", help="en or zh; else as the locale says.")
    ] = None,
    self_test: Annotated[
        bool, typer.Option("--self-test", help="Show that every known fault is found.")
    ] = False,
) -> int:
    """Judge your solver: is it right, how far off is it, and which mistake is it?

    Exit code 0 if every task is RIGHT or RIGHT BUT, 1 if not, 2 for a wrong command.
    """
    from crosscheck.child_process import one_thread

    # Solver and reference are timed beside each other on one thread, and the dense systems of the
    # search are too small for more; NumPy reads this when it is imported.
    os.environ |= {**one_thread(), **os.environ}

    from crosscheck.conformance.contestant import NoGreetingError
    from crosscheck.conformance.language import language_of
    from crosscheck.conformance.sentence import sentence

    from . import starter, tasks
    from .files import Files
    from .question import Question, ask, suited
    from .solver import ANSWERS, exported, limits, opened
    from .words import Presentation, speaker

    language = lang or language_of()
    say = speaker(language)
    words = [*(solver or ()), *context.meta.get(_PROGRAM, ())]
    if answers:
        words = [ANSWERS, str(answers), *words]
    if names:
        return _print(tasks.described(task or (), say))
    if template:
        return _print(starter.written(template, Path(), say))
    if export:
        return _print(exported(export, task or (), seed, thorough, say))
    if self_test:
        return _self_test(say)
    if time_limit is not None and not 0.0 < time_limit < float("inf"):
        raise ValueError(f"time-limit: expected seconds above 0, got {time_limit}")
    files = Files(json, junit, html, output)
    files.check()
    contestant = opened(words, limits(time_limit, memory_limit), say)
    question = suited(Question(tuple(task or ()), rerun, thorough, seed), contestant)
    try:
        report = ask(contestant, question)
    except NoGreetingError as error:
        raise ValueError(say(sentence(
            "solver: expected a greeting, got none: {why}", why=error.failure.sentence
        ))) from None  # fmt: skip
    return files.write(report, Presentation(say, language, words, files.saved(report, question)))


def _print(lines: Iterable[str]) -> int:
    print("\n".join(lines))
    return RIGHT


def _self_test(say: "Say") -> int:
    """Show that every fault is caught and named, and nobody is accused who is right."""
    from rich.console import Console
    from rich.progress import track

    from crosscheck.conformance.self_test import attempt, subjects

    from .self_test import lines

    console = Console(stderr=True)
    known = list(subjects())
    shown = track(known, "", console=console, transient=True, disable=not console.is_terminal)
    trials = [attempt(subject) for subject in shown]
    _print(lines(trials, say))
    return RIGHT if all(trial.passed for trial in trials) else WRONG
