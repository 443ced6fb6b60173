"""The programs with a single line unlike a right program's.

Whoever writes a known method down makes mistakes of few kinds: a wrong sign or index, a name for
another, a line left out or in the wrong place.
"""

import ast
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from types import FunctionType
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..task import TASKS
from .changes import (
    MODULES,
    Change,
    Scope,
    header,
    is_idle,
    of_constant,
    of_expression,
    of_statement,
    parsed,
)

T = TypeVar("T")
FILE, PASS = "right program", "_pass"
# A program is stopped after so many times the passes through loops of the right program.
MAX_PASSES = 5
UNLIMITED = 10**9
# The functions for requests.
ENTRIES = {*TASKS, "ccd", "fabrik", "tool_step"}
# What an expression raises whose names have no value yet, or not the usual one.
NO_VALUE = (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError)


class FastNumpy:
    """NumPy with a cross product of two vectors in an eighth of the time.

    Programs of mechanics spend most of their time in this product: their search is three times as
    fast.
    """

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    @staticmethod
    def cross(a: Any, b: Any, **options: Any) -> Any:
        """Return the cross product of two vectors, or of arrays of vectors like NumPy."""
        if np.shape(a) != (3,) or np.shape(b) != (3,):
            return np.cross(a, b, **options)
        (a0, a1, a2), (b0, b1, b2) = a, b
        return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


class Mutant(NamedTuple):
    """A right program with a changed line."""

    kind: str  # a key of `faults.toml`
    function: str  # the function that the line is in
    right: str  # the line, as it is in the right program
    wrong: str  # the line in its place; "" if there is none
    changed: FunctionType  # the function with the change


class Program:
    """A right program, to run with any changed function."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.choices: Mapping[str, Any] = {}  # the values of constants that were chosen
        self.names: dict[str, Any] = {PASS: self._pass}
        self._passes, self._max_passes = 0, UNLIMITED
        self.mutant_count = 0  # of those that were made
        self._scopes: dict[str, Scope] = {}  # of the functions that were observed
        self._lines = set[int]()  # that were executed
        exec(_code_of(source), self.names)
        if "np" in self.names:
            self.names["np"] = FastNumpy()

    @cached_property
    def _tree(self) -> ast.Module:
        return _tree_of(self.source)

    def choose(self, constants: Mapping[str, Any]) -> None:
        """Give constants of the program other values."""
        self.choices = constants
        self.names |= constants

    def with_source(self, source: str) -> "Program":
        """Return another program with the same choices; raise SyntaxError of invalid source."""
        program = Program(source)
        program.choose(self.choices)
        return program

    def _pass(self) -> None:
        self._passes += 1
        if self._passes > self._max_passes:
            raise ArithmeticError("a loop without end")

    def count_passes(self, run: Callable[[], T]) -> tuple[T, int]:
        """Run the right program and return its answer and the passes through its loops."""
        self._passes = 0
        return run(), self._passes

    def text_of(self, function: str) -> str:
        """Return the source of a function, with the change of the yielded mutant."""
        return next(ast.unparse(part) for part in self._functions if part.name == function)

    def mutant_of(self, kind: str, function: str, right: str, wrong: str, text: str) -> Mutant:
        """Return a change, given the text of the function with it."""
        names = dict[str, Any]()
        exec(_compiled(ast.parse(text)), self.names, names)
        return Mutant(kind, function, right, wrong, names[function])

    @property
    def texts(self) -> dict[str, str]:
        """The sources of all functions."""
        return {part.name: ast.unparse(part) for part in self._functions}

    @contextmanager
    def within(self, passes: int) -> Iterator[None]:
        """Run the program, or stop long after the passes of the right program."""
        self._passes, self._max_passes = 0, MAX_PASSES * (passes + 1)
        try:
            yield
        finally:
            self._max_passes = UNLIMITED

    @contextmanager
    def changed(self, mutant: Mutant, passes: int) -> Iterator[None]:
        """Run the program with a change, given the passes of the right program."""
        right = self.names[mutant.function]
        self.names[mutant.function] = mutant.changed
        try:
            with self.within(passes):
                yield
        finally:
            self.names[mutant.function] = right

    @property
    def _functions(self) -> list[ast.FunctionDef]:
        return [part for part in self._tree.body if isinstance(part, ast.FunctionDef)]

    def observe(self, run: Callable[[], Any]) -> None:
        """Run the right program and note the shapes of its values."""
        texts = {function.name: _texts(function) for function in self._functions}
        codes = {text: compile(text, FILE, "eval") for text in set().union(*texts.values())}
        shapes: dict[str, dict[str, str]] = {}

        def trace(frame: Any, event: str, _: Any) -> Any:
            function = frame.f_code.co_qualname.partition(".")[0]  # a function in it is a part
            if frame.f_code.co_filename != FILE or function not in texts:
                return None
            self._lines.add(frame.f_lineno)
            shapes_here = shapes.setdefault(function, {})
            for text in texts[function].keys() - shapes_here.keys() if event != "call" else ():
                with suppress(*NO_VALUE):
                    shapes_here[text] = _shape(eval(codes[text], frame.f_globals, frame.f_locals))
            return trace

        before = sys.gettrace()
        sys.settrace(trace)
        try:
            self.count_passes(run)
        finally:
            sys.settrace(before)
        for function, shapes_here in shapes.items():
            plain = frozenset(text for text, is_plain in texts[function].items() if is_plain)
            self._scopes[function] = Scope(shapes_here, plain)

    def mutants(self, functions: set[str]) -> Iterator[Mutant]:
        """Yield each change of a line of the observed functions.

        Functions in `functions` are left out: programs with the same functions had these changes.
        """
        for function in self._functions:
            text = ast.unparse(function)
            if function.name in self._scopes and text not in functions:
                functions.add(text)
                yield from self._of_block(function, function, of_expression)

    def with_constants(self) -> Iterator[Mutant]:
        """Yield each expression with a factor or a term `CONSTANT`, whose value `names` holds."""
        for function in self._functions:
            if function.name in self._scopes:
                yield from self._of_block(function, function, of_constant)

    def _of_block(
        self, function: ast.FunctionDef, block: Any, changes: Callable[..., Iterator[Change]]
    ) -> Iterator[Mutant]:
        """Yield the changes of the statements of a block, and of inner statements."""
        for name in ("body", "orelse"):
            statements = getattr(block, name, [])
            for i, statement in enumerate(statements):
                if isinstance(statement, ast.Expr) or not self._is_executed(statement):
                    continue  # a docstring, the count of passes, or without effect
                yield from self._of_expressions(function, statement, changes)
                for kind, wrong, changed in (
                    of_statement(statements, i) if changes is of_expression else ()
                ):
                    change = kind, header(statement), wrong
                    yield from self._mutant(function, change, (block, name), changed)
                yield from self._of_block(function, statement, changes)

    def _is_executed(self, statement: Any) -> bool:
        end = statement.body[0].lineno if hasattr(statement, "body") else statement.end_lineno + 1
        lines = range(statement.lineno, max(end, statement.lineno + 1))
        return is_idle(statement) or not self._lines.isdisjoint(lines)

    def _of_expressions(
        self,
        function: ast.FunctionDef,
        statement: ast.stmt,
        changes: Callable[..., Iterator[Change]],
    ) -> Iterator[Mutant]:
        """Yield the changes of a statement's expressions."""
        right, scope = header(statement), self._scopes[function.name]
        for parent, field, node in list(_expressions(statement)):
            for kind, new in changes(node, parent, scope):
                with _replaced(parent, field, new):
                    wrong = header(statement)
                if wrong != right:
                    change = kind, right, wrong
                    yield from self._mutant(function, change, (parent, field), new)

    def _mutant(
        self, function: ast.FunctionDef, change: tuple[str, str, str], place: Any, new: Any
    ) -> Iterator[Mutant]:
        """Yield a change, unless Python refuses the line: a `break` outside of its loop."""
        kind, right, wrong = change
        names = dict[str, Any]()
        for node in new if isinstance(new, list) else [new]:
            if not hasattr(node, "col_offset"):
                ast.fix_missing_locations(node)
        with _replaced(place[0], place[1], new), suppress(SyntaxError):
            exec(_compiled(ast.Module([function], [])), self.names, names)
            self.mutant_count += 1
            yield Mutant(kind, function.name, right, wrong, names[function.name])


def _tree_of(source: str) -> ast.Module:
    """Return a program that counts the passes through its loops, and reads its inputs in lines."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.For | ast.While):
            node.body.insert(0, ast.Expr(parsed(f"{PASS}()")))
    for part in tree.body:
        if isinstance(part, ast.FunctionDef) and part.name in ENTRIES:
            names = [arg.arg for arg in part.args.args]
            part.body[:0] = ast.parse("\n".join(f"{n} = {n}" for n in names)).body
    return ast.fix_missing_locations(tree)


@cache  # programs are run in many choices
def _code_of(source: str) -> Any:
    return _compiled(_tree_of(source))


def _expressions(node: ast.AST) -> Iterator[tuple[ast.AST, Any, Any]]:
    """Yield the expressions of a statement, each after its parent node and its place there."""
    for name, value in ast.iter_fields(node):
        for key, part in enumerate(value) if isinstance(value, list) else [(None, value)]:
            if not isinstance(part, ast.AST) or isinstance(part, ast.stmt | ast.arguments):
                continue
            is_read = isinstance(getattr(part, "ctx", ast.Load()), ast.Load) and name != "func"
            if isinstance(part, ast.expr) and is_read:
                yield node, (name if key is None else (name, key)), part
            if isinstance(part, ast.Subscript) and not is_read:
                yield part, "slice", part.slice  # of x[i] that is assigned
                yield from _expressions(part.slice)
            elif not isinstance(part, ast.Name):
                yield from _expressions(part)


@contextmanager
def _replaced(parent: Any, field: Any, new: Any) -> Iterator[None]:
    """Put something else in the field of a node, or at a place of a list in a field."""
    holder, key = (getattr(parent, field[0]), field[1]) if isinstance(field, tuple) else (
        vars(parent), field
    )  # fmt: skip
    before, holder[key] = holder[key], new
    try:
        yield
    finally:
        holder[key] = before


def _texts(function: ast.FunctionDef) -> dict[str, bool]:
    """Return the expressions of a function, and whether each is a name or an element x[i]."""
    texts = {
        ast.unparse(node): isinstance(node, ast.Name) or _is_element(node)
        for node in ast.walk(function)
        if isinstance(node, ast.BinOp | ast.Call | ast.Name | ast.Subscript | ast.UnaryOp)
        and not any(map(_is_method, ast.walk(node)))
    }
    return {text: is_plain for text, is_plain in texts.items() if PASS not in text}


def _is_method(node: ast.AST) -> bool:
    """Return whether a node is a method, which may change its object, and no function of NumPy."""
    return isinstance(node, ast.Attribute) and ast.unparse(node.value) not in MODULES


def _is_element(node: ast.AST) -> bool:
    """Return whether a node is x[i], and not x[0], of which there are many."""
    return isinstance(node, ast.Subscript) and any(
        isinstance(part, ast.Name) for part in ast.walk(node.slice)
    )


def _shape(value: Any) -> str:
    """Return the kind of a value: "int", the shape of an array or a number, or the type's name."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        return "int"
    is_array = isinstance(value, float | np.ndarray | np.floating)
    return str(np.shape(value)) if is_array else type(value).__name__


def _compiled(tree: ast.Module) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)
        return compile(tree, FILE, "exec")
