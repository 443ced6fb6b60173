"""An entry of a dictionary, and the files of dictionaries."""

import json
import lzma
from collections.abc import Mapping
from difflib import SequenceMatcher
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..fault_programs import coded_faults, source_of
from ..one_line.mutants import Program
from ..one_line.right_programs import KINDS

FOLDER = Path(__file__).parent
NO_CHOICES: Mapping[str, Any] = {}


class Entry(NamedTuple):
    """A change of a right program: known faults, or another line of a function."""

    program: str  # the name of the right program
    codes: tuple[str, ...]  # of the known faults; () of a changed line
    kind: str = ""  # of a changed line, a key of `one_line/faults.toml`
    function: str = ""  # that the line is in
    right: str = ""  # the line
    wrong: str = ""  # the line in its place
    text: str = ""  # the changed function
    equal_count: int = 1  # of the changed lines that answer alike

    def changed_program(self, choices: Mapping[str, Any] = NO_CHOICES) -> Program:
        """Return the program with the change; raise ValueError or SyntaxError if it has no place.

        The function has the passes of `Program` in its loops: it was written by one. Constants of
        the program may be chosen.
        """
        source, faults = source_of(self.program), coded_faults()
        for code in self.codes:
            if code not in faults:
                raise ValueError(f"{code}: expected a known fault: is the dictionary out of date?")
            source = faults[code].planted_in(source)
        program = Program(source)
        program.choose(choices)
        if self.text:
            exec(compile(self.text, self.program, "exec"), program.names)
        return program

    def texts(self) -> dict[str, str]:
        """Return the functions that the change has made, by their names."""
        if self.text:
            return {self.function: self.text}
        right = Program(source_of(self.program)).texts
        return {k: t for k, t in self.changed_program().texts.items() if right.get(k) != t}


class ChangePair(NamedTuple):
    """Two changes of a right program at once."""

    first: Entry
    second: Entry

    def changed_program(self, choices: Mapping[str, Any] = NO_CHOICES) -> Program:
        """Return the program with both changes; raise ValueError if they share a line."""
        program = Program(source_of(self.first.program))
        program.choose(choices)
        right, texts = program.texts, self.first.texts()
        for name, text in self.second.texts().items():
            texts[name] = merged(right[name], texts[name], text) if name in texts else text
        for text in texts.values():
            exec(compile(text, self.first.program, "exec"), program.names)
        return program


def merged(right: str, first: str, second: str) -> str:
    """Return a text with the lines that two others change; raise ValueError if they share one."""
    lines, changes = right.splitlines(), list[tuple[int, int, list[str]]]()
    for text in (first, second):
        new = text.splitlines()
        for tag, i, j, m, n in SequenceMatcher(None, lines, new, autojunk=False).get_opcodes():
            if tag != "equal":
                changes.append((i, j, new[m:n]))
    changes.sort(key=lambda change: change[:2])
    if any(before[1] > after[0] for before, after in pairwise(changes)):
        raise ValueError("both changes are in one line")
    for i, j, replacement in reversed(changes):
        lines[i:j] = replacement
    return "\n".join(lines)


def likelihood(entry: Entry) -> tuple[Any, ...]:
    """Return what to sort entries by: known faults first, fewer, then likely kinds, short lines."""
    kind = KINDS.index(entry.kind) if entry.kind else -1
    length = abs(len(entry.right) - len(entry.wrong))
    return not entry.codes, len(entry.codes), kind, length, len(entry.wrong), entry.program


class Dictionary(NamedTuple):
    """The entries of a task and a method, with a row of keys for each."""

    digest: str  # of what it was computed from
    entries: list[Entry]
    keys: FloatArray  # (entry, request, output)

    def write(self, path: Path) -> None:
        """Write a file: a line of JSON, and the keys in single precision, compressed."""
        keys = self.keys.astype("<f4")
        columns = list(map(list, zip(*self.entries, strict=True)))
        head = {"digest": self.digest, "shape": keys.shape, "columns": columns}
        data = json.dumps(head, separators=(",", ":"), ensure_ascii=False).encode()
        path.write_bytes(lzma.compress(data + b"\n" + _planes(keys), preset=9))


def _planes(keys: Any) -> bytes:
    """Return the bytes of numbers, all first bytes, then all second ones: they compress better."""
    return np.ascontiguousarray(keys.reshape(-1, 1).view("u1").T).tobytes()


def read(path: Path) -> Dictionary:
    """Return the dictionary in a file.

    Raises:
        OSError: if the file is missing or cannot be read.
        ValueError: if it is no dictionary, as a file that was not fetched or copied whole.
    """
    try:
        text = lzma.decompress(path.read_bytes())
    except (lzma.LZMAError, EOFError) as error:
        raise ValueError(f"{path}: expected a compressed dictionary: {error}") from error
    line, _, data = text.partition(b"\n")
    head = json.loads(line)
    planes = np.frombuffer(data, "u1").reshape(4, -1)
    keys = np.ascontiguousarray(planes.T).view("<f4").reshape(head["shape"]).astype(float)
    entries = [
        Entry(program, tuple(codes), *values)
        for program, codes, *values in zip(*head["columns"], strict=True)
    ]
    return Dictionary(head["digest"], entries, keys)


def file_of(task: str, method: str) -> Path:
    """Return the file of a task and a method."""
    return FOLDER / f"{method or task}.xz"
