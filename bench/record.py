"""Result files: one record a line of JSON, appended as it is produced, the later of a key counts.

This is the only file of the bench that opens a result file. A record is one block: what was
solved, by what, with which settings, the arrays that came out, and where it was measured.
"""

import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

FORMAT = 1
FILE_NAME = "records.jsonl"
# The suite of the records that say of each other suite that it was gone through to its end.
FINISHED = "finished"
_FIELDS = (
    "suite",
    "problem",
    "solver",
    "settings",
    "size",
    "arrays",
    "notes",
    "stamp",
    "when",
    "seconds",
)

Key = tuple[str, str, str, str]


@dataclass(frozen=True, eq=False)
class Record:
    """One block of results.

    Attributes:
        suite: which family of problems, such as "arm".
        problem: the name of the problem.
        solver: what solved it.
        settings: numbers, words and truth values that change the answer.
        size: how much was measured, such as the number of random targets.
        arrays: what came out, each an array of numbers with one entry a target, frame or step.
        notes: words that belong to it; "failed" says why there are no arrays.
        stamp: machine, versions and digest of the sources, see `bench.machine`.
        when: the moment it was produced, ISO 8601 with time zone.
        seconds: how long it took to produce.
    """

    suite: str
    problem: str
    solver: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    size: float = 0.0
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)
    stamp: Mapping[str, Any] = field(default_factory=dict)
    when: str = ""
    seconds: float = 0.0

    @property
    def key(self) -> Key:
        """What makes two records the same measurement."""
        return key(self.suite, self.problem, self.solver, self.settings)

    @property
    def failed(self) -> str:
        """Why it could not be measured, "" if it was."""
        return self.notes.get("failed", "")


class Reading(NamedTuple):
    """What a result file holds: its records, and a sentence if its end was cut off, else ""."""

    records: list[Record]
    warning: str


def key(suite: str, problem: str, solver: str, settings: Mapping[str, Any]) -> Key:
    """Return the key of a record; the order of the settings does not matter."""
    return suite, problem, solver, json.dumps(dict(settings), sort_keys=True)


class RecordFile:
    """The result file of one report folder."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.path = Path(folder) / FILE_NAME

    def read(self) -> Reading:
        """Return the records, the later of two with the same key; none if there is no file.

        Raises:
            ValueError: naming file and line, if a line other than an unfinished last one cannot
                be read.
        """
        text = self._bytes().decode("utf-8", errors="replace")
        lines = text.split("\n")
        unfinished = lines.pop()
        records = [self._decode(line, i) for i, line in enumerate(lines, 1) if line.strip()]
        warning = ""
        if unfinished.strip():
            try:
                records.append(self._decode(unfinished, len(lines) + 1))
            except ValueError:
                warning = (
                    f"The last line of {self.path.name} was cut off and is left out; "
                    "its block is measured again by the next bench."
                )
        return Reading(list({record.key: record for record in records}.values()), warning)

    def append(self, records: Iterable[Record]) -> None:
        """Write the records to the end of the file and to the disk, in one piece.

        An unfinished last line, left by a run that was killed, is cut off first.
        """
        lines = "".join(encode(record) + "\n" for record in records).encode()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._mend()
        with self.path.open("ab") as file:
            file.write(lines)
            file.flush()
            os.fsync(file.fileno())

    def drop(self, unwanted: Callable[[Record], bool]) -> None:
        """Remove records; the old file stays whole until the new one is."""
        records = self.read().records
        kept = [record for record in records if not unwanted(record)]
        if len(kept) < len(records):
            self._replace("".join(encode(record) + "\n" for record in kept).encode())

    def _bytes(self) -> bytes:
        return self.path.read_bytes() if self.path.exists() else b""

    def _mend(self) -> None:
        content = self._bytes()
        if not content or content.endswith(b"\n"):
            return
        end = content.rfind(b"\n") + 1
        try:
            self._decode(content[end:].decode("utf-8", errors="replace"), 0)
            whole = content + b"\n"
        except ValueError:
            whole = content[:end]
        self._replace(whole)

    def _replace(self, content: bytes) -> None:
        beside = self.path.with_suffix(".new")
        beside.write_bytes(content)
        beside.replace(self.path)

    def _decode(self, line: str, number: int) -> Record:
        try:
            return decode(line)
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"{self.path}, line {number}: not a record ({error})") from None


def encode(record: Record) -> str:
    """Return the record as one line of standard JSON; NaN and infinities become words."""
    content: dict[str, Any] = {"format": FORMAT}
    content |= {name: getattr(record, name) for name in _FIELDS}
    content["arrays"] = {name: _words(np.asarray(a)) for name, a in record.arrays.items()}
    return json.dumps(content, allow_nan=False)


def decode(line: str) -> Record:
    """Return the record of a line that `encode` wrote.

    Raises:
        ValueError: if the line is not JSON, of another format, or lacks a field.
    """
    content = json.loads(line)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f"expected a record of format {FORMAT}")
    missing = [name for name in _FIELDS if name not in content]
    if missing:
        raise ValueError(f"no field {missing[0]!r}")
    fields = {name: content[name] for name in _FIELDS}
    fields["arrays"] = {name: _numbers(values) for name, values in content["arrays"].items()}
    return Record(**fields)


def _words(values: np.ndarray) -> Any:
    if values.dtype.kind not in "biuf":
        raise ValueError(f"arrays: expected numbers, got {values.dtype} values")
    if np.isfinite(values).all():
        return values.tolist()
    words = [repr(float(x)) if not np.isfinite(x) else float(x) for x in values.ravel()]
    return np.array(words, dtype=object).reshape(values.shape).tolist()


def _numbers(values: Any) -> np.ndarray:
    array = np.asarray(values)
    return array if array.dtype.kind in "biuf" else np.asarray(values, dtype=np.float64)
