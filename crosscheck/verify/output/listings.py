"""What `verify` prints for `--list`, `--template`, `--export-cases` and `--self-test`."""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..sentence import Sentence, sentence
from ..solvers.export import export_cases
from ..task import TASKS, Field, Task
from .terminal import paragraphs, wrapped
from .words import Say

if TYPE_CHECKING:
    from ..self_test import Trial


def described(names: Sequence[str], say: Say) -> Iterator[str]:
    """Yield a paragraph a task; of tasks that are named, every input and output.

    Raises:
        ValueError: if there is no task of a name.
    """
    for name in names:
        if name not in TASKS:
            raise ValueError(f"task: expected one of {', '.join(TASKS)}, got {name!r}")
    for task in TASKS.values():
        if not names or task.name in names:
            yield from (_long if names else _short)(task, say)
            yield ""
    if not names:
        every = sentence("plumbob verify --list --task NAME describes every argument of a task.")
        yield from paragraphs([every], say)


def _short(task: Task, say: Say) -> Iterator[str]:
    yield f"{task.name}({', '.join(_name(one) for one in task.inputs)})"
    returned = ", ".join(one.name for one in task.outputs)
    about = Sentence(task.about, {}), sentence("Returns some of: {names}", names=returned)
    yield from paragraphs(about, say, "  ")


def _name(field: Field) -> str:
    return f"[{field.name}]" if field.optional else field.name


def _long(task: Task, say: Say) -> Iterator[str]:
    takes = sentence("Takes (all by keyword, those in brackets only where it asks for them):")
    returns = sentence("Returns some of these, as a dict, or as a tuple in this order:")
    yield from (task.name, *paragraphs([Sentence(task.about, {})], say, "  "))
    for heading, fields in ((takes, task.inputs), (returns, task.outputs)):
        yield from ("", *paragraphs([heading], say, "  "))
        for field in fields:
            shape, about = ", ".join(map(str, field.shape)), say(Sentence(field.about, {}))
            yield from wrapped(f"{_name(field)} ({shape}): {about}", "    ")


def starter(language: str, folder: Path, say: Say) -> list[str]:
    """Write the files of a starter and return what to do next; nothing is overwritten.

    Raises:
        ValueError: if there is none in this language, or one of its files is there already.
    """
    from ..templates import LANGUAGES, template

    texts = template(language)
    for name in texts:
        if (folder / name).exists():
            raise ValueError(say(sentence(
                "template: {name} is here already and stays as it is; go to an empty folder",
                name=name,
            )))  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    known = LANGUAGES[language]
    run = known.files[0] if language == "python" else f"-- {known.run}"
    steps = [
        sentence("Written: {files}", files=", ".join(texts)),
        sentence("Put your code into {file}; delete what you do not have.", file=known.files[0]),
        *([sentence("Build: {command}", command=known.build)] if known.build else []),
        sentence("Then: {command}", command=f"plumbob verify {run}"),
    ]
    return paragraphs(steps, say)


def exported(folder: Path, tasks: Sequence[str], seed: int, thorough: bool, say: Say) -> list[str]:
    """Write cases into a folder and return what to do next.

    Raises:
        ValueError: if the folder holds something else.
    """
    count = export_cases(folder, None, tasks or None, seed, thorough)
    place = shlex.quote(str(folder))
    steps = (
        sentence("{count} cases are in {folder}; README.txt there says how to answer them.",
                 count=count, folder=place),
        sentence("Then: {command}", command=f"plumbob verify --answers {place}"),
    )  # fmt: skip
    return paragraphs(steps, say)


def self_test(trials: Iterable["Trial"], say: Say) -> Iterator[str]:
    """Yield a line a family of solvers, then what did not pass, then the sum."""
    families: dict[str, list[Trial]] = {}
    for trial in trials:
        families.setdefault(trial.subject.family, []).append(trial)
    for family, members in families.items():
        yield say(_sum(family, members))
    failed = [one for members in families.values() for one in members if not one.passed]
    for one in failed:
        yield say(sentence(
            "Not passed: {family}, {name}. Verdict {verdict}, laws broken: {laws}.",
            family=one.subject.family, name=one.subject.name, verdict=one.verdict.name,
            laws=", ".join(sorted(one.laws)) or "0",
        ))  # fmt: skip
    yield say(
        sentence("{n} of all did not pass.", n=len(failed))
        if failed
        else sentence("Every fault is caught and named, and nobody right is accused.")
    )


def _sum(family: str, members: list["Trial"]) -> Sentence:
    from ..self_test import HONEST  # which loads all engines

    n, accused = len(members), sum(not one.passed for one in members)
    if family == HONEST:
        return sentence("{n} honest solvers tried, {accused} accused.", n=n, accused=accused)
    caught, named = sum(one.caught for one in members), sum(one.named for one in members)
    return sentence(
        "{family}: {n} faults planted, {caught} caught by a law, {named} named.",
        family=family, n=n, caught=caught, named=named,
    )  # fmt: skip
