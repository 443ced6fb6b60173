"""A folder of exported cases, and a solver's answers beside the cases."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from plumbob.text.printable import one_line
from plumbob.text.sentence import Sentence, did_you_mean, sentence

from .. import message
from ..case import Case
from ..exchange import Answer, Failure, FailureKind, NoGreetingError
from ..greeting import Greeting
from ..task import TASKS
from .losses import LIMITS

GREETING, SETTINGS, REQUEST, ANSWER = "greeting.json", "export.json", "request.json", "answer.json"
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
    """Return the greeting in greeting.json of a folder; raise ValueError of an invalid file."""
    path = folder / GREETING
    if not path.is_file():
        raise ValueError(f"answers: expected a folder of exported cases, got {folder}")
    return message.decode_greeting(_object(path), GREETING)


def _object(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file; raise ValueError of other content."""
    # The host of Python solvers never needs this.
    from plumbob.reference.formats.source import read_bytes

    content = read_bytes(path, largest=LIMITS.line)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = content.decode("utf-16", errors="replace").encode()
    fields = message.decode_object(content)
    if fields is None:
        text = one_line(content, 60)
        raise ValueError(f"{path.name}: expected a JSON object, got {text!r}")
    return fields


class FileConnection:
    """A solver with answers in files; `seed` and `thorough` are as of its cases.

    Raise ValueError of a folder without exported cases.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if not (folder / SETTINGS).is_file():
            raise ValueError(f"answers: expected a folder of exported cases, got {folder}")
        settings = _object(folder / SETTINGS)
        self.seed, self.thorough = int(settings.get("seed", 0)), bool(settings.get("thorough"))

    @property
    def remarks(self) -> tuple[Sentence, ...]:
        """On single answers, and on tasks without answers."""
        solved = self.greeting.tasks
        missing = ", ".join(task for task in self._offered().tasks if task not in solved)
        single = sentence(
            "Files answer once: whether equal requests have equal answers is not known."
        )
        left_out = sentence("Left out, for they have no answers: {tasks}.", tasks=missing)
        return (single, left_out) if missing else (single,)

    @property
    def greeting(self) -> Greeting:
        """The greeting in greeting.json, with the tasks of existing answers if any.

        Raise NoGreetingError of an invalid greeting.
        """
        offered = self._offered()
        solved = {
            (task, method)
            for task in offered.tasks
            for method in ("", *offered.methods)
            if self._has_answers(task, method)
        }
        tasks = tuple(task for task in offered.tasks if task in {task for task, _ in solved})
        methods = tuple(m for m in offered.methods if m in {method for _, method in solved})
        if not tasks:
            return offered
        return msgspec.structs.replace(offered, tasks=tasks, methods=methods or offered.methods)

    def _has_answers(self, task: str, method: str) -> bool:
        """Return whether a file beside the cases of a task comes from another program."""
        files = (self.folder / _folder(task, method)).glob("*/[!.]*")
        return any(path.name != REQUEST for path in files)

    def _offered(self) -> Greeting:
        try:
            return read_greeting(self.folder)
        except ValueError as error:
            words = sentence("{why}", why=str(error))
            raise NoGreetingError(Failure(FailureKind.GARBAGE, words)) from None

    def answer(self, case: Case) -> Answer | Failure:
        """Read the answer beside the case, the same for each request."""
        place = self.folder / place_of(case)
        try:
            if not _is_current(place / REQUEST, case):
                return Failure(FailureKind.ABSENT, sentence(
                    "{place} holds another case: export again, and solve it.", place=place
                ))  # fmt: skip
            return _read_answer(place, case)
        except (ValueError, OSError) as error:
            return Failure(FailureKind.GARBAGE, sentence("{why}", why=str(error)))

    def close(self) -> None:
        """Do nothing: there is no process."""


def _is_current(path: Path, case: Case) -> bool:
    """Return whether the exported request belongs to the case."""
    encoded = json.loads(message.encode_case(0, case))
    return path.is_file() and _object(path) | {"id": 0} == encoded


def _read_answer(place: Path, case: Case) -> Answer | Failure:
    """Return the answer in answer.json; raise ValueError of invalid content."""
    if not (place / ANSWER).is_file():
        return Failure(FailureKind.ABSENT, _absent(place))
    answer = message.decode_answer(_object(place / ANSWER), TASKS[case.task], case.inputs, LONGEST)
    if isinstance(answer, Answer) and answer.untimed:
        untimed = sentence('Not timed: the answers hold no valid "seconds".')
        return replace(answer, seconds=0.0, untimed=untimed)
    return answer


def _absent(place: Path) -> Sentence:
    """Return the sentence on a missing answer, with the file of a similar name."""
    for file in sorted({path.name for path in place.iterdir()} - {REQUEST}):
        if near := did_you_mean(file, [ANSWER]):
            return sentence(
                "There is no answer in {place}, but {file}{near}", place=place, file=file, near=near
            )
    return sentence("There is no answer in {place}: expected {name}", place=place, name=ANSWER)
