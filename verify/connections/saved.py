"""Failing cases as files for `--rerun`, generated from their names and the seed."""

import re
import shlex
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec

from plumbob.reference.formats.source import read_bytes
from plumbob.text.sentence import Sentence, sentence

from ..case import Case
from ..exchange import Answer
from ..judgement import TaskReport
from ..message import plain

FORMAT, VERSION = "plumbob failing case", 1
# A case with the longest readable answer, with indentation, has fewer bytes.
_LARGEST = 1 << 28


class SavedCase(msgspec.Struct, frozen=True):
    """The task, seed and name of a case; its request and answers are for a reader."""

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
    """Write the smallest failing case into a folder; return its path, None if no case fails."""
    failure = report.smallest_failure
    if failure is None:
        return None
    folder.mkdir(parents=True, exist_ok=True)
    case, answer = failure.case, failure.answer
    content = SavedCase(
        report.task, report.method, seed, thorough, case.name, FORMAT, VERSION, str(case.about),
        {"id": 1, "task": report.task, **case.inputs},
        answer.values if isinstance(answer, Answer) else {"error": str(answer.sentence)},
        failure.expected,
    )  # fmt: skip
    text = msgspec.json.format(msgspec.json.encode(content, enc_hook=plain), indent=1)
    path = folder / f"{_file_name(report)}.json"
    path.write_bytes(text + b"\n")
    return path


def _file_name(report: TaskReport) -> str:
    """Return the task and the method in letters of any file system, a name for each method.

    A method of other or capital letters has a digest.
    """
    name = re.sub(r"[^A-Za-z0-9_]+", "-", f"{report.task} {report.method}").strip("-")[:100]
    if name == f"{report.task}-{report.method}".strip("-").lower():
        return name
    return f"{name}-{sha256(report.method.encode(errors='replace')).hexdigest()[:8]}"


def load(path: Path) -> SavedCase:
    """Return the case in a file; raise ValueError of an unreadable file or other content."""
    try:
        saved = msgspec.json.decode(read_bytes(path, largest=_LARGEST), type=SavedCase)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        saved = None
    if saved is None or saved.format != FORMAT or saved.version != VERSION:
        raise ValueError(f"--rerun: expected a case that verify saved, got {path}")
    return saved


def cases_of(saved: SavedCase, cases: Sequence[Case]) -> list[Case]:
    """Return a saved case after its references; raise ValueError of an unknown case."""
    by_name = {case.name: case for case in cases}
    if saved.name not in by_name:
        raise ValueError(
            f"--rerun: the case {saved.name!r} of {saved.task} is not asked of this solver any "
            "more: run verify without --rerun"
        )
    needed, queue = set[str](), [saved.name]
    while queue:
        case = by_name[queue.pop()]
        needed.add(case.name)
        references = [
            fact for fact in (case.follows, *case.facts.values()) if isinstance(fact, str)
        ]
        queue += [name for name in references if name in by_name and name not in needed]
    return [case for case in cases if case.name in needed]


def command(solver: Sequence[str], path: Path) -> Sentence:
    """Return the shell command to repeat a saved case."""
    return sentence(
        "plumbob verify --rerun {path} {solver}",
        path=shlex.quote(str(path)),
        solver=shlex.join(solver),
    )
