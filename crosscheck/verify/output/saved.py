"""Failing cases as files that `--rerun` asks again.

A case is made anew from its name and the seed: laws may need more of it than a file can hold. The
request stands in the file as the solver got it, with the answer and the reference's, for a reader.
"""

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from plumbob.reference.formats.source import read_bytes

from ..case import Case
from ..contestant import Answer
from ..judgement import TaskReport
from ..message import plain
from ..sentence import Sentence, sentence

FORMAT, VERSION = "plumbob failing case", 1
# A case with the longest answer that is read, written anew with indentation, has fewer bytes.
_LARGEST = 1 << 28


class Saved(msgspec.Struct, frozen=True):
    """What finds a case again: its task, method, seed and name, and which list it is from.

    The request, the answer and what was expected stand beside it to be read.
    """

    task: str
    method: str
    seed: int
    thorough: bool
    name: str
    format: str = ""
    version: int = 0
    about: str = ""
    request: Any = None
    answer: Any = None
    expected: Any = None


def save(report: TaskReport, folder: Path, seed: int, thorough: bool) -> Path | None:
    """Write the smallest failing case into a folder and return where, or None if there is none."""
    failure = report.smallest_failure
    if failure is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    name = re.sub(r"[^A-Za-z0-9_]+", "-", f"{report.task} {report.method}").strip("-")[:100]
    case, answer = failure.case, failure.answer
    content = Saved(
        report.task, report.method, seed, thorough, case.name, FORMAT, VERSION, str(case.about),
        {"id": 1, "task": report.task, **case.inputs},
        answer.values if isinstance(answer, Answer) else {"error": str(answer.sentence)},
        failure.expected,
    )  # fmt: skip
    text = msgspec.json.format(msgspec.json.encode(content, enc_hook=plain), indent=1)
    path = folder / f"{name}.json"
    path.write_bytes(text + b"\n")
    return path


def load(path: Path) -> Saved:
    """Return what was saved.

    Raises:
        ValueError: if the file holds something else or cannot be read.
    """
    try:
        found = msgspec.json.decode(read_bytes(path, largest=_LARGEST), type=Saved)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        found = None
    if found is None or found.format != FORMAT or found.version != VERSION:
        raise ValueError(f"--rerun: expected a case that verify saved, got {path}")
    return found


def cases_of(saved: Saved, cases: Sequence[Case]) -> list[Case]:
    """Return a saved case among those of its task, after those that it follows or refers to.

    Raises:
        ValueError: if there is none of its name.
    """
    by_name = {case.name: case for case in cases}
    if saved.name not in by_name:
        raise ValueError(
            f"--rerun: the case {saved.name!r} of {saved.task} is not asked of this solver any "
            "more: run verify without --rerun"
        )
    wanted = {saved.name}
    while more := {name for one in wanted for name in _mentioned(by_name[one], by_name)} - wanted:
        wanted |= more
    return [case for case in cases if case.name in wanted]


def _mentioned(case: Case, by_name: dict[str, Case]) -> set[str]:
    facts = [fact for fact in case.facts.values() if isinstance(fact, str)]
    return {name for name in (case.follows, *facts) if name in by_name}


def command(solver: Sequence[str], path: Path) -> Sentence:
    """Return what asks a saved case again, as a shell takes it."""
    return sentence(
        "plumbob verify --rerun {path} {solver}",
        path=shlex.quote(str(path)),
        solver=shlex.join(solver),
    )
