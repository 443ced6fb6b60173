"""The output of `--list`, `--template`, `--export-cases` and `--self-test`."""

import shlex
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from plumbob.text.sentence import Say, Sentence, sentence

from ..connections.export import export_cases
from ..fault_programs import FAMILIES
from ..task import TASKS, Field, Task
from .terminal import paragraphs, wrapped

if TYPE_CHECKING:
    from ..self_test import Trial


def described(names: Sequence[str], say: Say) -> Iterator[str]:
    """Yield a paragraph a task, or every field of the named tasks; raise ValueError if unknown."""
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
    yield f"{task.name}({', '.join(map(_name, task.inputs))})"
    returned = ", ".join(field.name for field in task.outputs)
    about = Sentence(task.about, {}), sentence("Returns some of: {names}", names=returned)
    yield from paragraphs(about, say, "  ")


def _name(field: Field) -> str:
    return f"[{field.name}]" if field.optional else field.name


def _long(task: Task, say: Say) -> Iterator[str]:
    takes = sentence(
        "Arguments, passed by keyword; those in brackets only if the function names them:"
    )
    returns = sentence("Returns some of these, as a dict, or as a tuple in this order:")
    yield from (task.name, *paragraphs([Sentence(task.about, {})], say, "  "))
    for heading, fields in ((takes, task.inputs), (returns, task.outputs)):
        yield from ("", *paragraphs([heading], say, "  "))
        for field in fields:
            shape, about = ", ".join(map(str, field.shape)), say(Sentence(field.about, {}))
            yield from wrapped(f"{_name(field)} ({shape}): {about}", "    ")


def starter(language: str, folder: Path, say: Say) -> list[str]:
    """Write the files of a starter and return the next steps; raise ValueError if a file exists."""
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
    starter = LANGUAGES[language]
    program = starter.files[0]
    run = program if language == "python" else f"-- {starter.run}"
    steps = [
        sentence("Written: {files}", files=", ".join(texts)),
        sentence("Put your code into {file}; delete what you do not have.", file=program),
        *([sentence("Build: {command}", command=starter.build)] if starter.build else []),
        sentence("Then: {command}", command=f"plumbob verify {run}"),
    ]
    return paragraphs(steps, say)


def exported(folder: Path, tasks: Sequence[str], seed: int, thorough: bool, say: Say) -> list[str]:
    """Write cases into a folder and return what to do next."""
    count = export_cases(folder, tasks or None, seed, thorough)
    place = shlex.quote(str(folder))
    steps = (
        sentence("{count} cases are in {folder}; README.txt there says how to answer them.",
                 count=count, folder=place),
        sentence("Then: {command}", command=f"plumbob verify --answers {place}"),
    )  # fmt: skip
    return paragraphs(steps, say)


def self_test(trials: Iterable["Trial"], say: Say) -> Iterator[str]:
    """Yield a line a family of solvers, then the failed trials, then their number."""
    families: dict[str, list[Trial]] = {}
    for trial in trials:
        families.setdefault(trial.subject.family, []).append(trial)
    for family, members in families.items():
        about = Sentence(FAMILIES[family]["about"], {}) if family in FAMILIES else family
        yield say(_sum(about, members))
    failed = [trial for members in families.values() for trial in members if not trial.passed]
    for trial in failed:
        yield say(sentence(
            "Not passed: {family}, {name}. Verdict {verdict}, laws broken: {laws}.",
            family=trial.subject.family, name=trial.subject.name, verdict=trial.verdict.name,
            laws=", ".join(sorted(trial.laws)) or "0",
        ))  # fmt: skip
    yield say(
        sentence("{n} trials failed.", n=len(failed))
        if failed
        else sentence("Every fault is caught and named, and no honest solver is accused.")
    )


def _sum(family: str | Sentence, members: list["Trial"]) -> Sentence:
    from ..self_test import HONEST

    n, accused = len(members), sum(not trial.passed for trial in members)
    if family == HONEST:
        return sentence("{n} honest solvers tried, {accused} accused.", n=n, accused=accused)
    return sentence(
        "{family}: {n} faults planted, {caught} caught by a law, {named} named.",
        family=family, n=n, caught=sum(trial.caught for trial in members),
        named=sum(trial.is_named for trial in members),
    )  # fmt: skip
