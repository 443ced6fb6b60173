"""What `plumbob verify --list` prints: the tasks and what they ask."""

from collections.abc import Iterator, Sequence

from ..sentence import Sentence, sentence
from ..task import TASKS, Field, Task
from .terminal import WIDTH, wrapped
from .words import Say


def described(names: Sequence[str], say: Say) -> Iterator[str]:
    """Yield a paragraph a task; of tasks that are named, every input and output.

    Raises:
        ValueError: if there is no task of a name.
    """
    for name in names:
        if name not in TASKS:
            raise ValueError(f"task: expected one of {', '.join(TASKS)}, got {name!r}")
    for task in TASKS.values():
        if not names:
            yield from _short(task, say)
        elif task.name in names:
            yield from _long(task, say)
    if not names:
        yield from wrapped(say(sentence(
            "plumbob verify --list --task NAME describes every argument of a task."
        )), WIDTH)  # fmt: skip


def _short(task: Task, say: Say) -> Iterator[str]:
    yield f"{task.name}({', '.join(_name(one) for one in task.inputs)})"
    yield from wrapped(say(Sentence(task.about, {})), WIDTH, "  ")
    returned = ", ".join(one.name for one in task.outputs)
    yield from wrapped(say(sentence("Returns some of: {names}", names=returned)), WIDTH, "  ")
    yield ""


def _name(field: Field) -> str:
    return f"[{field.name}]" if field.optional else field.name


def _long(task: Task, say: Say) -> Iterator[str]:
    yield from (task.name, *wrapped(say(Sentence(task.about, {})), WIDTH, "  "))
    for heading, fields in (
        (sentence("Takes (all by keyword, those in brackets only where it asks for them):"),
         task.inputs),
        (sentence("Returns some of these, as a dict, or as a tuple in this order:"), task.outputs),
    ):  # fmt: skip
        yield from ("", *wrapped(say(heading), WIDTH, "  "))
        for field in fields:
            shape = ", ".join(map(str, field.shape))
            about = say(Sentence(field.about, {}))
            yield from wrapped(f"{_name(field)} ({shape}): {about}", WIDTH, "    ")
    yield ""
