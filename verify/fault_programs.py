"""The known faults by code, each with a short wrong and a right program.

`programs.toml` lists the right programs. The entry of a fault in a `faults.toml` has pairs of a
right and a wrong text, `lines`. The wrong texts in place of the right texts make the wrong
program.
"""

import ast
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import chain, product
from pathlib import Path
from typing import Any, NamedTuple

from plumbob.text.sentence import Sentence

from .connections.host import PythonSolver
from .functions import FunctionConnection
from .message import decode_greeting

FOLDER = Path(__file__).parent
# The files with faults, kinematics first.
FILES = sorted(FOLDER.rglob("faults.toml"))
_TABLE = tomllib.loads((FOLDER / "programs.toml").read_text(encoding="utf-8"))


def _in_forms(name: str, entry: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the program of an entry, or a program for each of its forms."""
    forms = entry.get("forms", {})
    for number, texts in enumerate(zip(*forms.values(), strict=True) if forms else [()], 1):
        replaced = (*entry.get("replaced", ()), *zip(forms, texts, strict=True))
        yield f"{name} {number}" if forms else name, {**entry, "replaced": replaced}


PROGRAMS: Mapping[str, Any] = dict(
    chain.from_iterable(_in_forms(name, entry) for name, entry in _TABLE["programs"].items())
)
FAMILIES: Mapping[str, Any] = _TABLE["families"]
NOTES: Mapping[str, Any] = _TABLE["notes"]
# The names of the programs with a dictionary of answers, by task or method.
IN_DICTIONARY: Mapping[str, Any] = _TABLE["dictionary"]


class TextChange(NamedTuple):
    """A right program with texts in the place of others, of a table in `programs.toml`."""

    kind: str  # a key of `one_line/faults.toml`
    source: str  # the wrong program
    function: str  # that the texts are in
    right: str  # what is shown of the right program
    wrong: str  # what is shown of the wrong one


def changes_of(program: str) -> Iterator[TextChange]:
    """Yield the wrong programs of a right program's tables: each combination of their texts."""
    source = source_of(program)
    for table in (table for table in _TABLE["tables"] if program in table["programs"]):
        for texts in product(*table["texts"].values()):
            wrong = source
            for right, text in table["lines"]:
                wrong = wrong.replace(right, _filled(text, table["texts"], texts))
            wrong_text = _filled(table["shown"][1], table["texts"], texts)
            right = table["shown"][0]
            yield TextChange(table["kind"], wrong, table["function"], right, wrong_text)


def _filled(text: str, names: Iterable[str], texts: Sequence[str]) -> str:
    """Return a text with others in the place of their names; these may hold later names."""
    for name, part in zip(names, texts, strict=True):
        text = text.replace(f"<{name}>", part)
    return text


class CodedFault(NamedTuple):
    """A known fault, and the change of the right program to a wrong program."""

    code: str
    name: str  # its key in the catalogue
    sentence: Sentence  # the mistake, and its correction
    program: str  # the name of the right program
    lines: tuple[tuple[str, str], ...]  # texts of the right program, and what replaces them

    @property
    def family(self) -> str:
        """The middle of the code: FK, CCD, STEP ..."""
        return self.code.split("-")[1]

    @property
    def task(self) -> str:
        """The task of its programs."""
        return str(PROGRAMS[self.program]["task"])

    @property
    def right_program(self) -> str:
        """The source of the right program."""
        return source_of(self.program)

    @property
    def wrong_program(self) -> str:
        """The source of the program with the fault; raise ValueError if a line is not replaced."""
        return self.planted_in(self.right_program)

    def planted_in(self, program: str) -> str:
        """Return a right program with the fault; raise ValueError unless each line is there once.

        A replaced line may stand deeper than in the fault's own program: its replacement is
        indented likewise.
        """
        own = self.right_program
        for right, wrong in self.lines:
            if program.count(right) != 1:
                raise ValueError(
                    f"{self.code}: expected {right!r} once in the program, "
                    f"got it {program.count(right)} times"
                )
            depth = _indentation(program, right) - _indentation(own, right)
            program = _replaced(program, right, wrong, " " * depth)
            own = own.replace(right, wrong)
        return program


def _indentation(program: str, text: str) -> int:
    """Return the number of spaces before the first line of a text."""
    line = program[: program.index(text)].rpartition("\n")[2] + text
    return len(line) - len(line.lstrip(" "))


def _replaced(program: str, right: str, wrong: str, margin: str) -> str:
    """Return a program with a replaced text; the lines of the new text get a further margin."""
    before, after = program.split(right)
    first, *remaining_lines = wrong.splitlines(keepends=True) or [""]
    if right.startswith(" "):  # whole lines, whose margin stands before them
        before, first = before.removesuffix(margin), first and margin + first
    return before + first + "".join(margin + line for line in remaining_lines) + after


@cache
def source_of(program: str) -> str:
    """Return the source of a right program, given its name: imports, its parts, its functions."""
    entry = PROGRAMS[program]
    name = re.sub(r"\W+", "_", program.lower().replace("'", ""))
    imports, bodies = dict[str, None](), dict[str, str]()
    _collect(entry.get("file", name), entry["replaced"], imports, bodies)
    return "\n".join(imports) + "\n\n\n" + "\n\n\n".join(bodies.values()) + "\n"


def _collect(
    module: str,
    replaced: Sequence[tuple[str, str]],
    imports: dict[str, None],
    bodies: dict[str, str],
) -> None:
    """Add the imports and the body of a module, after the imports and bodies of its parts."""
    path = FOLDER / "programs" / f"{module.replace('.', '/')}.py"
    text = path.read_text(encoding="utf-8")
    for old, new in replaced:
        text = text.replace(old, new)
    nodes = ast.parse(text).body[1:]  # without the docstring
    is_import = [isinstance(node, ast.Import | ast.ImportFrom) for node in nodes]
    start = nodes[is_import.index(False)].lineno - 1
    for node in nodes[: is_import.index(False)]:
        if isinstance(node, ast.ImportFrom) and node.level:
            part = node.module or ""
            _collect(part if "." in part else f"parts.{part}", replaced, imports, bodies)
        else:
            imports[ast.unparse(node)] = None
    bodies.setdefault(module, "\n".join(text.splitlines()[start:]))


@cache
def coded_faults() -> dict[str, CodedFault]:
    """Return all known faults by code, sorted."""
    tables = (tomllib.loads(path.read_text(encoding="utf-8")) for path in FILES)
    parts = chain.from_iterable(table.values() for table in tables)
    faults = {fault.code: fault for part in parts for fault in _faults_of(part)}
    families = list(FAMILIES)
    return dict(sorted(faults.items(), key=lambda item: (families.index(item[1].family), item[0])))


def _faults_of(part: Any) -> Iterator[CodedFault]:
    """Yield the faults in a table of a file: entries by their keys, or a list of entries."""
    for key, entry in part.items() if isinstance(part, dict) else ((None, entry) for entry in part):
        values = {name: numbers[0] for name, numbers in entry.get("each", {}).items()}
        for field, value in entry.get("example", {}).items():
            values[field] = Sentence(value, {}) if isinstance(value, str) else value
        family, name = entry["code"].split("-")[1], key or entry.get("key", entry.get("value", ""))
        program = entry.get("program", FAMILIES[family]["program"])
        lines = tuple((right, wrong) for right, wrong in entry.get("lines", ()))
        words = Sentence(entry["sentence"], values)
        yield CodedFault(entry["code"], name.format(**values), words, program, lines)


def connection_to(program: str) -> FunctionConnection:
    """Return the functions of a program's source as a connection of this process."""
    names: dict[str, Any] = {}
    exec(compile(program, "program", "exec"), names)
    solver = PythonSolver(names, "program", names.get("PLUMBOB", {}))
    return FunctionConnection(solver.functions, decode_greeting(solver.greeting, "program"))
