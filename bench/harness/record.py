"""Result files: one record a line of JSON, appended as it is produced, the later of a key counts.

This is the only file of the bench that opens a result file. A record is one block: what was
solved, by what, with which settings, the arrays that came out, and where it was measured.
"""

import contextlib
import functools
import io
import json
import mmap
import os
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypedDict

import msgspec
import numpy as np

from . import values

FORMAT = 3
FILE_NAME = "records.jsonl"
# Reading a file takes several times its size of memory; the whole bench writes a hundredth of this.
LARGEST = 1 << 30
# The suite of the records that say of each other suite that it was gone through to its end.
FINISHED = "finished"

# So many lines that are no records are named; of the others only how many there are.
NAMED = 5
# What a number that JSON has no sign for is written as.
_WORDS = {"nan", "inf", "-inf"}

Key = tuple[str, str, str, str]

_Single = str | int | float | bool | None
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
    """What a line has to hold."""

    format: Literal[3]
    suite: str
    problem: str
    solver: str
    settings: dict[str, _Single]
    size: float
    arrays: dict[str, Any]
    notes: dict[str, str]
    stamp: _Stamp
    when: _Moment
    seconds: float
    facts: dict[str, _Single | list[str]]
    conditions: dict[str, str | int | float | None]


_FIELDS = _Line.__struct_fields__[1:]
_DECODER = msgspec.json.Decoder(_Line)


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
        stamp: machine, versions and digest of the sources, see `plumbob.bench.harness.machine`.
        when: the moment it was produced, ISO 8601 with time zone.
        seconds: how long it took to produce.
        facts: what tables select and sort by: numbers, words, truth values and lists of words.
        conditions: what it was measured under that makes it no other measurement: the commit of
            the sources, affinity, load, pace.
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
    facts: Mapping[str, Any] = field(default_factory=dict)
    conditions: Mapping[str, Any] = field(default_factory=dict)

    @property
    def _kind(self) -> values.Kind | None:
        return values.kind_of(self.suite, str(self.facts.get("task", "")))

    @functools.cached_property
    def values(self) -> Any:
        """The arrays as the type that the experiment declares; None if there are none."""
        kind = self._kind
        return values.read(kind.values, self.arrays) if kind and self.arrays else None

    @functools.cached_property
    def details(self) -> Any:
        """Settings, notes and facts as the type that the experiment declares; None without one."""
        kind = self._kind
        return kind and values.read(kind.details, {**self.settings, **self.notes, **self.facts})

    def check(self) -> None:
        """Make sure that the record is of its type, unless nothing shows it any more.

        Raises:
            ValueError: naming a field that is missing, or of another type.
        """
        if not self.superseded:
            self.values, self.details  # noqa: B018

    @property
    def trouble(self) -> str:
        """What its solver raised, and how often; "" if nothing."""
        return str(self.facts.get("trouble", ""))

    @property
    def title(self) -> str:
        """How the problem is written."""
        return str(self.facts.get("title", self.problem))

    @property
    def key(self) -> Key:
        """What makes two records the same measurement."""
        return key(self.suite, self.problem, self.solver, self.settings)

    @property
    def failed(self) -> str:
        """Why it could not be measured, "" if it was."""
        return self.notes.get("failed", "")

    @property
    def superseded(self) -> bool:
        """Whether its block is now asked for under other settings: it is kept, but not shown."""
        return "superseded" in self.notes

    @property
    def commit(self) -> str:
        """The commit of the sources as git shortens it, with a plus where they were changed."""
        commit, _, changes = str(self.conditions.get("commit", "")).partition(" ")
        return commit[:7] + ("+" if changes else "")


class Reading(NamedTuple):
    """What a result file holds: its records, and a sentence on the lines that are none, else ""."""

    records: list[Record]
    warning: str


def key(suite: str, problem: str, solver: str, settings: Mapping[str, Any]) -> Key:
    """Return the key of a record; the order of the settings does not matter."""
    return suite, problem, solver, json.dumps(dict(settings), sort_keys=True)


class RecordFile:
    """The result file of one report folder."""

    def __init__(self, folder: str | os.PathLike[str]):
        self.path = Path(folder) / FILE_NAME

    def read(self, typed: bool = True) -> Reading:
        """Return the records, the later of two with the same key; none if there is no file.

        A line that is no record costs itself and a part of the sentence; so does one whose fields
        are not of the type that its experiment declares, unless `typed` is false.

        Raises:
            ValueError: naming the file, if it is no regular file, or no line of it is a record.
        """
        lines, unfinished = self._lines()
        valid = [line for line in lines if line.record and not (typed and line.why)]
        records = {line.record.key: line.record for line in valid if line.record}
        wrong = [line for line in lines if line.why and (typed or not line.record)]
        left_out = [one for one in wrong if not one.record or one.record.key not in records]
        sentences = [_cut_off(self.path)] * bool(unfinished)
        sentences += [_no_records(self.path, left_out)] * bool(left_out)
        return Reading(list(records.values()), " ".join(sentences))

    def append(self, records: Iterable[Record]) -> None:
        """Write the records to the end of the file and to the disk: all of them, or none.

        An unfinished record, left by a run that was killed, is cut off first; whatever else is in
        the file stays.

        Raises:
            OSError: naming the file, if it cannot be written to, as on a full disk.
        """
        text = "".join(encode(record) + "\n" for record in records).encode()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        check_regular(self.path)
        with _naming(self.path), self.path.open("ab", buffering=0) as file:
            text = self._mend() + text
            end = file.tell()
            try:
                _write(file, text)
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(end)
                raise

    def drop(self, unwanted: Callable[[Record], bool]) -> None:
        """Remove records; the old file stays whole until the new one is, and all else stays in it.

        Raises:
            ValueError: as `read` does.
        """
        lines, _ = self._lines()
        of_their_type_last = sorted(lines, key=lambda line: not line.why)
        latest = {line.record.key: line.record for line in of_their_type_last if line.record}
        if any(map(unwanted, latest.values())):
            kept = {id(record) for record in latest.values() if not unwanted(record)}
            self._replace(line.text for line in lines if not line.record or id(line.record) in kept)

    def arrange(self, order: Iterable[Key]) -> None:
        """Bring the records of these keys into order, each in the place of one of them.

        Tables show rows as they are on record, and blocks that are measured at the same time may
        end in any order. All else keeps its place, and the old file stays whole until the new one
        is.

        Raises:
            ValueError: as `read` does.
        """
        lines, _ = self._lines()
        rank = {key: i for i, key in enumerate(order)}
        places = [i for i, line in enumerate(lines) if line.record and line.record.key in rank]
        ranks = [rank[record.key] for i in places if (record := lines[i].record)]
        if (firsts := list(dict.fromkeys(ranks))) != sorted(firsts):
            texts = [line.text for line in lines]
            for place, (_, source) in zip(
                places, sorted(zip(ranks, places, strict=True)), strict=True
            ):
                texts[place] = lines[source].text
            self._replace(texts)

    def _lines(self) -> tuple[list["_Decoded"], bytes]:
        """Return all lines with text, and the last one if it is a record that was cut off."""
        check_regular(self.path)
        content = self.path.read_bytes() if self.path.exists() else b""
        *texts, last = content.split(b"\n")
        unfinished = last if _is_begun(last) else b""
        texts += [] if unfinished else [last]
        decoded = enumerate(map(_record_of, texts), 1)
        lines = [_Decoded(i, *one) for i, one in decoded if one[0].strip()]
        if lines and not any(line.record for line in lines):
            raise ValueError(f"{self.path}, line {lines[0].number}: not a record ({lines[0].why})")
        return lines, unfinished

    def _mend(self) -> bytes:
        """Cut off an unfinished record; return what ends the last line if it is something else."""
        begin, last = self._last_line()
        if _is_begun(last):
            os.truncate(self.path, begin)
            return b""
        return b"\n" if last else b""

    def _last_line(self) -> tuple[int, bytes]:
        """Return where the line after the last end of a line begins, and what it holds."""
        if not self.path.stat().st_size:
            return 0, b""
        with (
            self.path.open("rb") as file,
            mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content,
        ):
            begin = content.rfind(b"\n") + 1
            return begin, content[begin:]

    def _replace(self, lines: Iterable[bytes]) -> None:
        beside = self.path.with_suffix(".new")
        check_regular(beside)
        try:
            with _naming(self.path), beside.open("wb", buffering=0) as file:
                _write(file, b"".join(line + b"\n" for line in lines))
            beside.replace(self.path)
        finally:
            beside.unlink(missing_ok=True)


def on_record(folder: Path, typed: bool = True) -> Reading:
    """Return what a folder has on record; see `RecordFile.read`.

    Raises:
        ValueError: if that is nothing, or cannot be read.
    """
    check_folder(folder)
    reading = RecordFile(folder).read(typed)
    if not reading.records:
        why = reading.warning or "run `plumbob bench` first"
        raise ValueError(f"no records in {folder}: {why}")
    return reading


def _write(file: io.FileIO, content: bytes) -> None:
    """Write all of the content to the disk."""
    rest = memoryview(content)
    while rest:
        rest = rest[file.write(rest) :]
    os.fsync(file.fileno())


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Let a failure to write name the file, and say that nothing is lost."""
    try:
        yield
    except OSError as error:
        why = f"{error.strerror}; what was finished before is on record"
        raise OSError(error.errno, why, str(path)) from None


class _Decoded(NamedTuple):
    """A line of a result file: its record, and why it is none, or not of its type."""

    number: int
    text: bytes
    record: Record | None
    why: str = ""


def check_regular(path: Path) -> None:
    """Make sure that a file is one that can be read to its end, or is not there.

    Raises:
        ValueError: if it is a folder, a pipe or a device, or larger than `LARGEST`.
    """
    try:
        mode, size = path.stat().st_mode, path.stat().st_size
    except (FileNotFoundError, NotADirectoryError):
        return
    if not stat.S_ISREG(mode):
        raise ValueError(f"{path}: expected a file, got a {_kind_of_file(mode)}")
    if size > LARGEST:
        raise ValueError(f"{path}: expected at most {LARGEST} bytes, got {size}")


def check_folder(path: Path) -> None:
    """Make sure that a folder is one, or is not there.

    Raises:
        ValueError: if it is a file, a pipe or a device.
    """
    if path.exists() and not path.is_dir():
        raise ValueError(f"{path}: expected a folder, got a {_kind_of_file(path.stat().st_mode)}")


def _kind_of_file(mode: int) -> str:
    kinds = {stat.S_IFDIR: "folder", stat.S_IFIFO: "pipe", stat.S_IFREG: "file"}
    kinds |= {stat.S_IFCHR: "device", stat.S_IFBLK: "device", stat.S_IFSOCK: "socket"}
    return kinds.get(stat.S_IFMT(mode), "special file")


def _is_begun(line: bytes) -> bool:
    """Return whether a line is the beginning of a record, and not a whole one."""
    begin = f'{{"format": {FORMAT}, "suite": '.encode()
    is_ours = bool(line) and (line.startswith(begin) or begin.startswith(line))
    return is_ours and _record_of(line)[1] is None


# A run reads its file again and again: so many lines are decoded once.
@functools.lru_cache(maxsize=4096)
def _record_of(text: bytes) -> tuple[bytes, Record | None, str]:
    """Return a line, its record, or None and why it is none; or why it is not of its type."""
    record = None
    try:
        record = untyped(text)
        record.check()
    except ValueError as error:
        return text, record, str(error)[:100]
    return text, record, ""


def _cut_off(path: Path) -> str:
    return (
        f"The last line of {path.name} was cut off and is left out; "
        "its block is measured again by the next bench."
    )


def _no_records(path: Path, damaged: Sequence[_Decoded]) -> str:
    """Return a sentence that names lines that are no records, and why the first few are none."""
    numbers = [f"line {line.number} ({line.why})" for line in damaged[:NAMED]]
    numbers += [f"{len(damaged) - NAMED} more"] * (len(damaged) > NAMED)
    return f"Left out of {path.name}, for they are no records: {'; '.join(numbers)}."


def encode(record: Record) -> str:
    """Return the record as one line of standard JSON; NaN and infinities become words."""
    content = {"format": FORMAT} | {name: getattr(record, name) for name in _FIELDS}
    content["arrays"] = {name: _words(np.asarray(a)) for name, a in record.arrays.items()}
    content["notes"] = {name: _in_unicode(text) for name, text in record.notes.items()}
    return json.dumps(content, allow_nan=False)


def decode(line: bytes | str) -> Record:
    """Return the record of a line that `encode` wrote.

    Raises:
        ValueError: if the line is not JSON, of another format, lacks a field, or has one of
            another type.
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
    fields["arrays"] = {name: _numbers(name, values) for name, values in content.arrays.items()}
    return Record(**fields)


def _in_unicode(text: str) -> str:
    """Return text without halves of surrogate pairs, which names of files may bring along."""
    return text.encode(errors="replace").decode()


def _words(values: np.ndarray) -> Any:
    if values.dtype.kind not in "biuf":
        raise ValueError(f"arrays: expected numbers, got {values.dtype} values")
    if np.isfinite(values).all():
        return values.tolist()
    words = [repr(float(x)) if not np.isfinite(x) else float(x) for x in values.ravel()]
    return np.array(words, dtype=object).reshape(values.shape).tolist()


def _numbers(name: str, values: Any) -> np.ndarray:
    """Return nested lists as an array: of truth values, of integers, or of floating point."""
    leaves = np.array(values, dtype=object).ravel().tolist()
    kinds = set(map(type, leaves))
    words = {leaf for leaf in leaves if isinstance(leaf, str)}
    if (kinds <= {int, float, str} or kinds == {bool}) and words <= _WORDS:
        array = np.array(values, dtype=np.float64 if words else None)
        if array.dtype.kind in "biuf":  # and no integers of more than 64 bits
            return array
    raise ValueError(f"arrays: expected numbers in {name[:40]!r}")
