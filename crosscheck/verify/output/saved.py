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
from ..judgement import CaseJudgement, TaskReport
from ..message import plain
from ..sentence import Sentence, sentence

FORMAT, VERSION = "plumbob failing case", 1
# A case with the longest answer that is read, written anew with indentation, has fewer bytes.
_LARGEST = 1 << 28


class Saved(msgspec.Struct, frozen=True):
    """What finds a case again: its task, method, seed and name, and which list it is from."""

    task: str
    method: str
    seed: int
    thorough: bool
    name: str


class _File(Saved, frozen=True, kw_only=True):
    """A saved case with all that is there to be read."""

    format: str
    version: int
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
    path = folder / f"{_plain(f'{report.task} {report.method}')}.json"
    content = _File(
        report.task, report.method, seed, thorough, failure.case.name,
        format=FORMAT, version=VERSION, about=str(failure.case.about),
        request={"id": 1, "task": report.task, **failure.case.inputs},
        answer=_answer(failure), expected=failure.expected,
    )  # fmt: skip
    text = msgspec.json.format(msgspec.json.encode(content, enc_hook=plain), indent=1)
    path.write_bytes(text + b"\n")
    return path


def _plain(name: str) -> str:
    """Return a name fit for a file: letters, digits and hyphens."""
    return re.sub(r"[^A-Za-z0-9_]+", "-", name).strip("-")[:100]


def _answer(failure: CaseJudgement) -> Any:
    if isinstance(failure.answer, Answer):
        return failure.answer.values
    return {"error": str(failure.answer.sentence)}


def load(path: Path) -> Saved:
    """Return what was saved.

    Raises:
        ValueError: if the file holds something else or cannot be read.
    """
    try:
        found = msgspec.json.decode(read_bytes(path, largest=_LARGEST), type=_File)
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
