"""A folder of exported cases, and the answers that a solver has written beside them."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from .. import message
from ..case import Case
from ..contestant import Answer, Failure, FailureKind, NoGreetingError
from ..greeting import Greeting
from ..sentence import Sentence, did_you_mean, sentence
from ..task import TASKS, Task
from .line_process import LIMITS
from .tables import read_table

GREETING, SETTINGS, REQUEST, ANSWER = "greeting.json", "export.json", "request.json", "answer.json"
# A table that answers has this before the name of the output: some are named as inputs are.
PREFIX = "answer_"
# A solver's own time is less: thirty years [s].
LONGEST = 1e9


def place_of(case: Case) -> str:
    """Return the folder of a case among all, as a relative path of plain letters."""
    return f"{_folder(case.task, case.inputs.get('method', ''))}/{_plain(case.name)}"


def _folder(task: str, method: str) -> str:
    return _plain(f"{task} {method}")


def _plain(name: str) -> str:
    return re.sub(r"[^\w.+-]+", "_", name, flags=re.ASCII).strip("_.") or "case"


def read_greeting(folder: Path) -> Greeting:
    """Return what greeting.json of a folder says.

    Raises:
        ValueError: if it is not there, or not understood.
    """
    path = folder / GREETING
    if not path.is_file():
        raise ValueError(f"answers: expected a folder of exported cases, got {folder}")
    return message.decode_greeting(_object(_content(path), GREETING), GREETING)


def _object(data: bytes, name: str) -> dict[str, Any]:
    """Return the JSON object of a file.

    Raises:
        ValueError: if it holds something else.
    """
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", errors="replace").encode()
    fields = message.decode_object(data)
    if fields is None:
        raise ValueError(f"{name}: expected a JSON object, got {message.shown(data, 60)!r}")
    return fields


class FileContestant:
    """A solver that answers by files; they are read when they are asked for.

    Attributes:
        folder: of the export.
        seed, thorough: of its cases, to be passed to `verify`.

    Raises:
        ValueError: if it is no folder of exported cases.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if not (folder / SETTINGS).is_file():
            raise ValueError(f"answers: expected a folder of exported cases, got {folder}")
        settings = _object(_content(folder / SETTINGS), SETTINGS)
        self.seed, self.thorough = int(settings.get("seed", 0)), bool(settings.get("thorough"))

    @property
    def remarks(self) -> tuple[Sentence, ...]:
        """That an answer is never given twice, and which tasks have none."""
        once = sentence(
            "Files answer once: whether equal requests have equal answers is not known."
        )
        left_out = [task for task in self._offered().tasks if task not in self.greeting.tasks]
        if not left_out:
            return (once,)
        return once, sentence(
            "Left out, for they have no answers: {tasks}.", tasks=", ".join(left_out)
        )

    @property
    def greeting(self) -> Greeting:
        """What greeting.json says, of the tasks that have answers if there are any.

        Raises:
            NoGreetingError: if it is not understood.
        """
        offered = self._offered()
        every = ("", *offered.methods)
        tasks = tuple(t for t in offered.tasks if any(self._answers(t, one) for one in every))
        methods = tuple(
            one for one in offered.methods if any(self._answers(task, one) for task in tasks)
        )
        if not tasks:
            return offered
        return msgspec.structs.replace(offered, tasks=tasks, methods=methods or offered.methods)

    def _answers(self, task: str, method: str) -> bool:
        """Return whether anything stands beside the cases of a task that was not exported."""
        exported = {REQUEST, *(f"{field.name}.csv" for field in TASKS[task].inputs)}
        files = (self.folder / _folder(task, method)).glob("*/[!.]*")
        return any(path.name not in exported for path in files)

    def _offered(self) -> Greeting:
        try:
            return read_greeting(self.folder)
        except ValueError as error:
            words = sentence("{why}", why=str(error))
            raise NoGreetingError(Failure(FailureKind.GARBAGE, words)) from None

    def answer(self, case: Case) -> Answer | Failure:
        """Read what stands beside the case, the same each time it is asked."""
        place = self.folder / place_of(case)
        try:
            if not _is_asked(place, case):
                return Failure(
                    FailureKind.ABSENT,
                    sentence(
                        "{place} holds another case: export again, and solve it.", place=place
                    ),
                )
            return _read_answer(place, case)
        except (ValueError, OSError) as error:
            return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))

    def close(self) -> None:
        """Do nothing: there is no process."""


def _is_asked(place: Path, case: Case) -> bool:
    """Return whether the request that was exported is the same as that of now."""
    path = place / REQUEST
    if not path.is_file():
        return False
    then, now = _object(_content(path), REQUEST), json.loads(message.encode_case(0, case))
    return then | {"id": 0} == now


def _read_answer(place: Path, case: Case) -> Answer | Failure:
    task = TASKS[case.task]
    fields = _fields(place, task, case)
    if not fields:
        return Failure(FailureKind.ABSENT, _absent(place, task))
    answer = message.decode_answer(fields, task, case.inputs, LONGEST)
    if isinstance(answer, Answer) and answer.untimed:
        untimed = sentence('Not timed: the answers hold no valid "seconds".')
        return replace(answer, seconds=0.0, untimed=untimed)
    return answer


def _fields(place: Path, task: Task, case: Case) -> Mapping[str, Any]:
    """Return the outputs that stand in a folder, those of answer.json first.

    Raises:
        ValueError: if they are not understood.
    """
    if (place / ANSWER).is_file():
        return _object(_content(place / ANSWER), ANSWER)
    counts = task.counts(case.inputs)
    paths = {field: place / f"{PREFIX}{field.name}.csv" for field in task.outputs}
    return {
        field.name: read_table(field, counts, _content(path))
        for field, path in paths.items()
        if path.is_file()
    }


def _content(path: Path) -> bytes:
    from plumbob.reference.formats.source import (
        read_bytes,  # which the host of Python solvers never needs
    )

    return read_bytes(path, largest=LIMITS.line)


def _absent(place: Path, task: Task) -> Sentence:
    """Return that there is no answer, and which file was perhaps meant as one."""
    names = [ANSWER, *(f"{PREFIX}{field.name}.csv" for field in task.outputs)]
    inputs = {REQUEST, *(f"{field.name}.csv" for field in task.inputs)}
    for path in sorted(place.iterdir()):
        if path.name not in inputs and (near := did_you_mean(path.name, names)):
            return sentence(
                "There is no answer in {place}, but {file}{near}",
                place=place,
                file=path.name,
                near=near,
            )
    return sentence(
        "There is no answer in {place}: expected {names}", place=place, names=" or ".join(names)
    )
