"""Result files: a record is a line of JSON, appended when produced; the last of a key counts.

No other file of the bench opens a result file. A record is flat: suite, problem, solver, settings,
measured values, and where and when they were measured.
"""

import contextlib
import functools
import io
import json
import mmap
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypedDict

import msgspec
import numpy as np

from plumbob.process.paths import check_folder, check_regular

from . import values
from .experiment import kind_of

FORMAT = 4  # raised when older readers would misread a record
FILE_NAME = "records.jsonl"
# Suite name of the records that mark a suite as complete.
FINISHED = "finished"
# The fact with the number of targets of a slow solver, which got the first targets only.
FIRST_TARGETS = "first_targets"
# How many invalid lines a warning lists; the others are counted.
LISTED_LINES = 5
# How numbers are written for which JSON has no sign, and the key of a single such number.
_WORDS = {"nan", "inf", "-inf"}
NUMBER = "number"

Key = tuple[str, str, str, str]

_Scalar = str | int | float | bool | None
_Moment = Annotated[
    str, msgspec.Meta(pattern=r"^(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(Z|[+-]\d\d:\d\d))?$")
]


class _Machine(TypedDict, total=False):
    processor: str
    cores: int | None
    memory_gib: float | None
    system: str


class _Stamp(TypedDict, total=False):
    machine: _Machine
    versions: dict[str, str]
    source: str


class _Line(msgspec.Struct):
    """The fields of a line."""

    format: Annotated[int, msgspec.Meta(ge=FORMAT, le=FORMAT)]
    suite: str
    problem: str
    solver: str
    settings: dict[str, _Scalar]
    measured: dict[str, Any]
    size: float
    stamp: _Stamp
    when: _Moment
    seconds: float
    conditions: dict[str, str | int | float | None]


_FIELDS = _Line.__struct_fields__[1:]
_DECODER = msgspec.json.Decoder(_Line)


@dataclass(frozen=True, eq=False)
class Record:
    """The results of a block."""

    suite: str  # the family of problems, for example "arm"
    problem: str  # the name of the problem
    solver: str  # the name of the solver
    # numbers, words and truth values that change the answer
    settings: Mapping[str, Any] = field(default_factory=dict)
    # numbers, words, truth values, lists of words and arrays of numbers, with an entry for each
    # target, frame or step; "failed" says why there are no numbers
    measured: Mapping[str, Any] = field(default_factory=dict)
    size: float = 0.0  # how much was measured, for example the number of random targets
    # machine, versions and digest of the sources, see `plumbob.bench.measure.machine`
    stamp: Mapping[str, Any] = field(default_factory=dict)
    when: str = ""  # the moment it was produced, ISO 8601 with time zone
    seconds: float = 0.0  # how long it took to produce
    # of the measurement, without effect on its validity: the commit of the sources, affinity, load,
    # pace
    conditions: Mapping[str, Any] = field(default_factory=dict)

    @functools.cached_property
    def values(self) -> Any:
        """Settings and measured values as the type declared in the experiment, None without a type.

        A record without numbers is read as the type of its facts.
        """
        kind = kind_of(self.suite, self.task)
        if kind is None:
            return None
        arrays = values.array_names(kind)  # such as the times, where a time limit is a setting
        settings = {name: v for name, v in self.settings.items() if name not in arrays}
        type_read = kind if self.has_numbers else values.facts_of(kind)
        return values.read(type_read, {**settings, **self.measured})

    @functools.cached_property
    def has_numbers(self) -> bool:
        """Whether there are numbers, not only words on why there are none."""
        if self.failed:
            return False
        return not self._number_names.isdisjoint(self.measured)

    @property
    def _number_names(self) -> set[str]:
        """The numbers that the type declares, and all arrays, of whatever revision."""
        kind = kind_of(self.suite, self.task)
        arrays = {name for name, v in self.measured.items() if isinstance(v, np.ndarray)}
        return arrays | (values.number_names(kind) if kind else set())

    def numbers(self) -> dict[str, np.ndarray]:
        """Return the arrays and the scalars measured, by name."""
        names = self._number_names
        return {
            name: np.asarray(value)
            for name, value in self.measured.items()
            if name in names and value is not None
        }

    def with_measured(self, **measured: Any) -> "Record":
        """Return the record with further or other measured values."""
        return replace(self, measured={**self.measured, **measured})

    def check(self) -> None:
        """Check the type of the record, unless superseded.

        Raises:
            ValueError: naming a missing field, or a field of another type.
        """
        if not self.superseded:
            self.values  # noqa: B018

    @property
    def task(self) -> str:
        """The kind of its numbers among the kinds of its suite, "" if there is a single kind."""
        return str(self.measured.get("task", ""))

    @property
    def remark(self) -> str:
        """A sentence on the numbers, or on why there are none."""
        return str(self.measured.get("remark", ""))

    @property
    def is_user_solver(self) -> bool:
        """Whether its solver was entered by a user."""
        return self.measured.get("entrant") is True

    @property
    def trouble(self) -> str:
        """The most frequent exception of its solver with its count, else ""."""
        return str(self.measured.get("trouble", ""))

    @property
    def title(self) -> str:
        """How the problem is written."""
        return str(self.measured.get("title", self.problem))

    @property
    def key(self) -> Key:
        """Equal for two records of the same measurement."""
        return key(self.suite, self.problem, self.solver, self.settings)

    @property
    def failed(self) -> str:
        """Why the measurement failed, "" if not."""
        return str(self.measured.get("failed", ""))

    @property
    def superseded(self) -> bool:
        """Whether its block now has other settings: the record is kept, but not shown."""
        return "superseded" in self.measured

    @property
    def commit(self) -> str:
        """The commit of the sources as shortened by git, with a plus for changed sources."""
        commit, _, changes = str(self.conditions.get("commit", "")).partition(" ")
        return commit[:7] + ("+" if changes else "")


def key(suite: str, problem: str, solver: str, settings: Mapping[str, Any]) -> Key:
    """Return the key of a record; the order of the settings does not matter."""
    return suite, problem, solver, json.dumps(dict(settings), sort_keys=True)


class Reading(NamedTuple):
    """The records of a result file, and a sentence on its invalid lines, "" if there are none."""

    records: list[Record]
    warning: str


class _DecodedLine(NamedTuple):
    """A line of a result file: its record or None, and why invalid."""

    number: int
    text: bytes
    record: Record | None
    error: str


class RecordFile:
    """The result file of a report folder."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.path = Path(folder) / FILE_NAME

    def read(self, typed: bool = True) -> Reading:
        """Return the records, the later of two with the same key; none if there is no file.

        Lines without a record are left out and listed in the warning. So are records with fields of
        another type than in their experiment, unless `typed` is false.

        Raises:
            ValueError: naming the file, if it is no regular file, or no line of it is a record.
        """
        lines, unfinished = self._lines()
        records, invalid = {}, []
        for line in lines:
            if line.record and not (typed and line.error):
                records[line.record.key] = line.record
            else:
                invalid.append(line)
        invalid = [line for line in invalid if not line.record or line.record.key not in records]
        warnings = [
            f"The last line of {self.path.name} was cut off and is left out; "
            "its block is measured again by the next bench."
        ] * bool(unfinished)
        if invalid:
            reasons = [f"line {line.number} ({line.error})" for line in invalid[:LISTED_LINES]]
            if len(invalid) > LISTED_LINES:
                reasons.append(f"{len(invalid) - LISTED_LINES} more")
            warnings.append(
                f"Left out of {self.path.name}, for they are no records: {'; '.join(reasons)}."
            )
        return Reading(list(records.values()), " ".join(warnings))

    def append(self, records: Iterable[Record]) -> None:
        """Write the records to the end of the file and to the disk: all of them, or none.

        An unfinished record, left by a killed run, is cut off first; all else in the file stays.

        Raises:
            OSError: naming the file, if writing fails, as on a full disk.
        """
        text = "".join(encode(record) + "\n" for record in records).encode()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        check_regular(self.path)
        with _write_errors_named(self.path), self.path.open("ab", buffering=0) as file:
            begin, last_line = self._last_line()
            if _is_unfinished(last_line):
                file.truncate(begin)
            elif last_line:
                text = b"\n" + text
            end = self.path.stat().st_size
            try:
                _write(file, text)
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(end)
                raise

    def drop(self, is_unwanted: Callable[[Record], bool]) -> None:
        """Remove records; the old file stays until the new file is complete, with all other lines.

        Raises:
            ValueError: as `read` does.
        """
        lines, _ = self._lines()
        valid_last = sorted(lines, key=lambda line: not line.error)
        latest = {line.record.key: line.record for line in valid_last if line.record}
        if any(map(is_unwanted, latest.values())):
            remaining = {id(record) for record in latest.values() if not is_unwanted(record)}
            self._replace(
                line.text for line in lines if not line.record or id(line.record) in remaining
            )

    def replace(self, records: Iterable[Record]) -> None:
        """Write records in place of all lines; the old file stays until the new file is complete.

        Raises:
            ValueError: as `read` does.
            OSError: naming the file, if it cannot be written to.
        """
        self._lines()  # raises if the file is of something else
        self._replace(encode(record).encode() for record in records)

    def arrange(self, order: Iterable[Key]) -> None:
        """Sort the records of these keys among their lines.

        Tables show rows in the order of the file, and blocks measured at the same time end in any
        order. All other lines keep their place, and the old file stays until the new file is
        complete.

        Raises:
            ValueError: as `read` does.
        """
        lines, _ = self._lines()
        rank = {key: i for i, key in enumerate(order)}
        ranks = {
            i: rank[line.record.key]
            for i, line in enumerate(lines)
            if line.record and line.record.key in rank
        }
        firsts = list(dict.fromkeys(ranks.values()))
        if firsts != sorted(firsts):
            texts = [line.text for line in lines]
            for place, source in zip(ranks, sorted(ranks, key=ranks.__getitem__), strict=True):
                texts[place] = lines[source].text
            self._replace(texts)

    def _lines(self) -> tuple[list[_DecodedLine], bytes]:
        """Return all lines with text, and the last line if its record was cut off."""
        check_regular(self.path)
        content = self.path.read_bytes() if self.path.exists() else b""
        *texts, last_line = content.split(b"\n")
        unfinished = last_line if _is_unfinished(last_line) else b""
        texts += [] if unfinished else [last_line]
        lines = [
            _DecodedLine(i, *_decoded(text)) for i, text in enumerate(texts, 1) if text.strip()
        ]
        if lines and not any(line.record for line in lines):
            first = lines[0]
            raise ValueError(f"{self.path}, line {first.number}: not a record ({first.error})")
        return lines, unfinished

    def _last_line(self) -> tuple[int, bytes]:
        """Return where the text after the last end of a line begins, and the text."""
        if not self.path.stat().st_size:
            return 0, b""
        with (
            self.path.open("rb") as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content,
        ):
            begin = content.rfind(b"\n") + 1
            return begin, content[begin:]

    def _replace(self, lines: Iterable[bytes]) -> None:
        new = self.path.with_suffix(".new")
        check_regular(new)
        try:
            with _write_errors_named(self.path), new.open("wb", buffering=0) as file:
                _write(file, b"".join(line + b"\n" for line in lines))
            new.replace(self.path)
        finally:
            new.unlink(missing_ok=True)


def on_record(folder: Path, typed: bool = True) -> Reading:
    """Return the records of a folder; see `RecordFile.read`.

    Raises:
        ValueError: if there are none, or they cannot be read.
    """
    check_folder(folder)
    reading = RecordFile(folder).read(typed)
    if not reading.records:
        why = reading.warning or "run `plumbob bench` first"
        raise ValueError(f"no records in {folder}: {why}")
    return reading


def _write(file: io.FileIO, content: bytes) -> None:
    """Write all of the content to the disk."""
    unwritten = memoryview(content)
    while unwritten:
        unwritten = unwritten[file.write(unwritten) :]
    os.fsync(file.fileno())


@contextlib.contextmanager
def _write_errors_named(path: Path) -> Iterator[None]:
    """Let a failure to write name the file, and say that earlier records are safe."""
    try:
        yield
    except OSError as error:
        why = f"{error.strerror}; what was finished before is on record"
        raise OSError(error.errno, why, str(path)) from None


def _is_unfinished(line: bytes) -> bool:
    """Return whether a line is the beginning of a record, but not complete."""
    begin = f'{{"format": {FORMAT}, "suite": '.encode()
    is_ours = bool(line) and (line.startswith(begin) or begin.startswith(line))
    return is_ours and _decoded(line)[1] is None


# A run reads its file again and again; each line is decoded once.
@functools.lru_cache(maxsize=4096)
def _decoded(text: bytes) -> tuple[bytes, Record | None, str]:
    """Return a line, its record or None, and why the record is missing or of the wrong type."""
    record = None
    try:
        record = untyped(text)
        record.check()
    except ValueError as error:
        return text, record, str(error)[:100]
    return text, record, ""


def encode(record: Record) -> str:
    """Return the record as a line of standard JSON; NaN and infinities become words."""
    content = {"format": FORMAT} | {name: getattr(record, name) for name in _FIELDS}
    content["measured"] = {name: _plain(value) for name, value in record.measured.items()}
    return json.dumps(content, allow_nan=False)


def decode(line: bytes | str) -> Record:
    """Return the record of a line written by `encode`.

    Raises:
        ValueError: if the line is not JSON, of another format, lacks a field, or has a
            field of another type.
    """
    record = untyped(line)
    record.check()
    return record


def untyped(line: bytes | str) -> Record:
    """Return the record of a line, also of an experiment that had other fields.

    Raises:
        ValueError: if the line is not JSON, or no record of this format.
    """
    try:
        content = _DECODER.decode(line)
    except RecursionError:
        raise ValueError("nested too deeply") from None
    fields = {name: getattr(content, name) for name in _FIELDS}
    fields["measured"] = {name: _read(name, value) for name, value in content.measured.items()}
    return Record(**fields)


def _plain(value: Any) -> Any:
    """Return a measured value as JSON has it; numbers that JSON has not become words."""
    if isinstance(value, str):  # names of files may bring halves of surrogate pairs along
        return value.encode(errors="replace").decode()
    if value is None or _is_words(value):
        return value
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"measured: expected numbers, got {array.dtype} values")
    if np.isfinite(array).all():
        return array.tolist()
    words = [repr(float(x)) if not np.isfinite(x) else float(x) for x in array.ravel()]
    nested = np.array(words, dtype=object).reshape(array.shape)
    return nested.tolist() if array.ndim else {NUMBER: words[0]}


def _read(name: str, value: Any) -> Any:
    """Return a value of JSON: a scalar or words as they are, nested lists of numbers as an array.

    Raises:
        ValueError: if the value is something else.
    """
    if isinstance(value, dict) and value.keys() == {NUMBER} and value[NUMBER] in _WORDS:
        return float(value[NUMBER])
    if _is_words(value) and not (value and {*value} <= _WORDS):  # an empty list stays empty
        return value
    return _array(name, value) if isinstance(value, list | dict) else value


def _is_words(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(part, str) for part in value)


def _array(name: str, numbers: Any) -> np.ndarray:
    """Return nested lists as an array: of truth values, of integers, or of floating point."""
    leaves = np.array(numbers, dtype=object).ravel().tolist()
    kinds = set(map(type, leaves))
    words = {leaf for leaf in leaves if isinstance(leaf, str)}
    if (kinds <= {int, float, str} or kinds == {bool}) and words <= _WORDS:
        array = np.array(numbers, dtype=np.float64 if words else None)
        if array.dtype.kind in "biuf":  # and no integers of more than 64 bits
            return array
    raise ValueError(f"measured: expected numbers or words in {name[:40]!r}")
