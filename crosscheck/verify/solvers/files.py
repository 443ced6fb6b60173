"""A folder of exported cases, and the answers that a solver has written beside them."""

import json
import re
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
from .losses import LIMITS
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
    return message.decode_greeting(_object(path), GREETING)


def _object(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file; raise ValueError if it holds something else."""
    data = _content(path)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        data = data.decode("utf-16", errors="replace").encode()
    fields = message.decode_object(data)
    if fields is None:
        raise ValueError(f"{path.name}: expected a JSON object, got {message.shown(data, 60)!r}")
    return fields


def _content(path: Path) -> bytes:
    # The host of Python solvers never needs this.
    from plumbob.reference.formats.source import read_bytes

    return read_bytes(path, largest=LIMITS.line)


def _exported(task: Task) -> set[str]:
    """Return the names of the files that an export writes for a case."""
    return {REQUEST, *(f"{field.name}.csv" for field in task.inputs)}


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
        settings = _object(folder / SETTINGS)
        self.seed, self.thorough = int(settings.get("seed", 0)), bool(settings.get("thorough"))

    @property
    def remarks(self) -> tuple[Sentence, ...]:
        """That an answer is never given twice, and which tasks have none."""
        answered = self.greeting.tasks
        without = ", ".join(task for task in self._offered().tasks if task not in answered)
        once = sentence(
            "Files answer once: whether equal requests have equal answers is not known."
        )
        left_out = sentence("Left out, for they have no answers: {tasks}.", tasks=without)
        return (once, left_out) if without else (once,)

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
        files = (self.folder / _folder(task, method)).glob("*/[!.]*")
        return any(path.name not in _exported(TASKS[task]) for path in files)

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
                return Failure(FailureKind.ABSENT, sentence(
                    "{place} holds another case: export again, and solve it.", place=place
                ))  # fmt: skip
            return _read_answer(place, case)
        except (ValueError, OSError) as error:
            return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))

    def close(self) -> None:
        """Do nothing: there is no process."""


def _is_asked(place: Path, case: Case) -> bool:
    """Return whether the request that was exported is the same as that of now."""
    if not (place / REQUEST).is_file():
        return False
    return _object(place / REQUEST) | {"id": 0} == json.loads(message.encode_case(0, case))


def _read_answer(place: Path, case: Case) -> Answer | Failure:
    """Return what answer.json of a folder says, or the tables.

    Raises:
        ValueError: if they are not understood.
    """
    task = TASKS[case.task]
    counts = task.counts(case.inputs)
    paths = {field: place / f"{PREFIX}{field.name}.csv" for field in task.outputs}
    fields = _object(place / ANSWER) if (place / ANSWER).is_file() else {
        field.name: read_table(field, counts, _content(path))
        for field, path in paths.items() if path.is_file()
    }  # fmt: skip
    if not fields:
        return Failure(FailureKind.ABSENT, _absent(place, task))
    answer = message.decode_answer(fields, task, case.inputs, LONGEST)
    if isinstance(answer, Answer) and answer.untimed:
        untimed = sentence('Not timed: the answers hold no valid "seconds".')
        return replace(answer, seconds=0.0, untimed=untimed)
    return answer


def _absent(place: Path, task: Task) -> Sentence:
    """Return that there is no answer, and which file was perhaps meant as one."""
    names = [ANSWER, *(f"{PREFIX}{field.name}.csv" for field in task.outputs)]
    for file in sorted({path.name for path in place.iterdir()} - _exported(task)):
        if near := did_you_mean(file, names):
            return sentence(
                "There is no answer in {place}, but {file}{near}", place=place, file=file, near=near
            )
    return sentence(
        "There is no answer in {place}: expected {names}", place=place, names=" or ".join(names)
    )
