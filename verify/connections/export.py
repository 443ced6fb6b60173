"""Write cases into a folder, for a solver inside a program with windows."""

import json
from collections.abc import Sequence
from pathlib import Path

import msgspec

from .. import message
from ..case import Case
from ..disciplines import DISCIPLINES
from ..greeting import Greeting
from ..task import TASKS, Task
from ..verify import trials
from .files import GREETING, REQUEST, SETTINGS, place_of, read_greeting

README = Path(__file__).with_name("export_readme.txt").read_text(encoding="utf-8")


def export_cases(
    folder: Path, tasks: Sequence[str] | None = None, seed: int = 0, thorough: bool = False
) -> int:
    """Write all suitable cases of a solver, with instructions for the answers; return their number.

    The folder is new, empty, or from an earlier export, whose answers stay. Its greeting.json
    declares the solver; without this file all tasks suit. Raise ValueError if the folder holds
    something else, or greeting.json is not understood.
    """
    _check_is_export(folder)
    is_greeted = (folder / GREETING).is_file()
    greeting = read_greeting(folder) if is_greeted else Greeting(1, tuple(DISCIPLINES))
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
    """Write these cases, each into a folder of its own; raise ValueError of a shared folder."""
    _check_is_export(folder)
    places: dict[str, Case] = {}
    for case in cases:
        if place_of(case) in places:
            raise ValueError(f"cases: expected different names, got {place_of(case)} twice")
        places[place_of(case)] = case
    tasks = dict.fromkeys(case.task for case in cases)
    texts = {
        SETTINGS: json.dumps({"seed": seed, "thorough": thorough}) + "\n",
        GREETING: msgspec.json.format(msgspec.json.encode(greeting), indent=2).decode() + "\n",
        "cases.txt": "".join(f"{place}\n" for place in places),
        "README.txt": README + "\n".join(_description(TASKS[task]) for task in tasks),
    }
    for number, (place, case) in enumerate(places.items(), 1):
        texts[f"{place}/{REQUEST}"] = message.encode_case(number, case).decode()
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def _check_is_export(folder: Path) -> None:
    """Raise ValueError if a folder is a file, or holds anything but an earlier export."""
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"folder: expected a folder, got the file {folder}")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / SETTINGS).is_file():
        raise ValueError(
            f"folder: expected a new folder, or one of exported cases, got {folder}, which holds "
            "other files"
        )


def _description(task: Task) -> str:
    """Return a task in words, with a line for each input and output."""
    lines = [f"{task.name}: {task.about}"]
    for title, definitions in (("in", task.inputs), ("out", task.outputs)):
        for definition in definitions:
            shape = " x ".join(map(str, definition.shape)) or "one value"
            lines.append(f"  {title:3} {definition.name} {shape}: {definition.about}")
    return "\n".join(lines) + "\n"
