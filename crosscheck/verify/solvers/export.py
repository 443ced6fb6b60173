"""Write cases into a folder, for a solver that is locked inside a program with windows."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from .. import message
from ..case import Case
from ..greeting import Greeting
from ..task import TASKS, Task
from ..verify import DISCIPLINES, trials
from .files import GREETING, REQUEST, SETTINGS, place_of, read_greeting
from .tables import write_table

README = """\
Cases for a solver, exported by Plumbob
=======================================
cases.txt lists one folder a line, in the order in which to solve them. Each folder holds a case:

  request.json   the whole case, one JSON object: the task, then its inputs by name
  NAME.csv       the same, one file an input: the last index runs along a line, between commas;
                 a list of numbers has one a line. Indices count from 0. Numbers have the shortest
                 digits that give the same double back.

Write the answers beside them, in each folder either

  answer.json          one JSON object with some of the task's outputs by name, or
  answer_OUTPUT.csv    one file an output, laid out like the inputs; an output of several frames
                       has the lines of the first frame, then those of the second, and so on.

What there is no number for is null in JSON and nan in CSV. Semicolons, tabs or spaces between
numbers, decimal commas where that is clear, a line of names at the top and a byte order mark are
understood. A solver that cannot do a case leaves it out, or writes answer.json with
{"error": "why"}; its own time may stand there as "seconds".

greeting.json says what the solver is: its precision, its model, its limits. Change it before the
export, for the cases are made to suit it: export again into this folder after a change. Answers
stay, and those to cases that have changed are told.

Then judge them:  plumbob verify --answers THIS_FOLDER

Tasks
-----
"""


def export_cases(
    folder: Path,
    greeting: Greeting | None = None,
    tasks: Sequence[str] | None = None,
    seed: int = 0,
    thorough: bool = False,
) -> int:
    """Write all cases that suit a solver into a folder, with word of what to write where.

    Args:
        folder: a new one, an empty one, or one of an earlier export, whose answers stay.
        greeting: what the solver is; if not given, what the folder's greeting.json says, else one
            that offers all tasks.
        tasks: only these of those that it offers.
        seed: of the random cases.
        thorough: whether to write the long list of cases.

    Returns:
        the number of cases.

    Raises:
        ValueError: if the folder holds something else, or greeting.json is not understood.
    """
    _check_is_ours(folder)
    if greeting is None and (folder / GREETING).is_file():
        greeting = read_greeting(folder)
    greeting = greeting or Greeting(1, tuple(DISCIPLINES))
    cases = [
        case
        for task, method in trials(greeting, tasks)
        for case in DISCIPLINES[task].cases(greeting, method, seed, thorough)
    ]
    if tasks:  # no other is judged then
        greeting = msgspec.structs.replace(greeting, tasks=tuple(tasks))
    write_cases(folder, cases, greeting, seed, thorough)
    return len(cases)


def write_cases(
    folder: Path, cases: Sequence[Case], greeting: Greeting, seed: int = 0, thorough: bool = False
) -> None:
    """Write these cases, each into a folder of its own.

    Raises:
        ValueError: if two would share a folder, or the folder holds something else.
    """
    _check_is_ours(folder)
    places = [place_of(case) for case in cases]
    twice = next((place for place in places if places.count(place) > 1), None)
    if twice:
        raise ValueError(f"cases: expected different names, got {twice} twice")
    texts = {
        SETTINGS: json.dumps({"seed": seed, "thorough": thorough}) + "\n",
        GREETING: msgspec.json.format(msgspec.json.encode(greeting), indent=2).decode() + "\n",
        "cases.txt": "".join(f"{one}\n" for one in places),
        "README.txt": README + _about_tasks(cases),
    }
    for number, (place, case) in enumerate(zip(places, cases, strict=True), 1):
        texts[f"{place}/{REQUEST}"] = message.encode_case(number, case).decode()
        for name, value in case.inputs.items():
            if value is not None:
                texts[f"{place}/{name}.csv"] = write_table(value)
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def _check_is_ours(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"folder: expected a folder, got the file {folder}")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / SETTINGS).is_file():
        raise ValueError(
            f"folder: expected a new folder, or one of exported cases, got {folder}, which holds "
            "other files"
        )


def _about_tasks(cases: Iterable[Case]) -> str:
    return "\n".join(_about(TASKS[name]) for name in dict.fromkeys(case.task for case in cases))


def _about(task: Task) -> str:
    lines = [f"{task.name}: {task.about}"]
    for title, fields in (("in", task.inputs), ("out", task.outputs)):
        for field in fields:
            shape = " x ".join(map(str, field.shape)) or "one value"
            lines.append(f"  {title:3} {field.name} {shape}: {field.about}")
    return "\n".join(lines) + "\n"
