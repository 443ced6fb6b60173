"""Mistakes in an expression, or in a statement among its neighbours.

The kinds of changes are the keys of `faults.toml`; operators of mutation testing (DeMillo, Lipton
& Sayward 1978).
"""

import ast
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

# Functions with similar names or purposes, and comparisons.
FUNCTIONS = (
    ("sin", "cos"), ("arcsin", "arccos"), ("asin", "acos"), ("min", "max"), ("ceil", "floor"),
    ("degrees", "radians"), ("zeros", "ones"), ("sum", "mean"), ("repeat", "tile"),
)  # fmt: skip
# Functions whose second argument is the type of an array's numbers.
ALLOCATIONS = ("zeros", "empty", "ones")
MODULES = ("np", "np.linalg", "math")
COMPARISONS = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
# What values become, by the kind of change and their shape.
PATTERNS = tomllib.loads(Path(__file__).with_name("patterns.toml").read_text(encoding="utf-8"))
# Numbers below are tolerances, in the place of which stand these.
TOLERANCE, TOLERANCES = 1e-5, [10.0**-i for i in range(1, 11)]
# The parts of a list in a wrong slice or loop.
PARTS = {"loop": ("1:", ":-1", ":2", ":3", ":4", ":5", ":10"), "direction": ("::-1",)}
NUMBER, WORD = "()", re.compile(r"\w+(\.\d+)?")

# The name of a fitted number.
CONSTANT = "_constant"

Change = tuple[str, ast.expr]  # the kind, and what an expression becomes
# The kind, the line in the place of a statement, and the statements of its block.
Rearrangement = tuple[str, str, list[ast.stmt]]


class Scope(NamedTuple):
    """The expressions of a function with observed values."""

    shapes: Mapping[str, str]  # by the text of an expression: "int", "()", "(3,)", "list"
    plain: frozenset[str]  # the texts of names and of elements x[i]

    def alike(self, text: str) -> list[str]:
        """Return the other names and elements of an expression's shape."""
        shape = self.shapes.get(text)
        return [
            name for name in sorted(self.plain) if name != text and self.shapes.get(name) == shape
        ]


def of_expression(node: Any, parent: ast.AST, scope: Scope) -> Iterator[Change]:
    """Yield the mistakes in an expression."""
    is_index = isinstance(parent, ast.Subscript)
    yield from (("index" if is_index else kind, new) for kind, new in _operands(node))
    yield from _other_operators(node)
    yield from _bounds(node, parent)
    if isinstance(node, ast.Call):
        yield from _calls(node)
    if isinstance(node, ast.Constant):
        yield from _numbers(node.value, parent)
    text = ast.unparse(node)
    if isinstance(parent, ast.If | ast.While | ast.IfExp) and node is parent.test:
        yield "condition", parsed(f"not ({text})")
    if text in scope.shapes:
        yield from _names(text, scope)
        yield from _neighbours(text, parent, scope)
        yield from (("name", parsed(other)) for other in _of_one_form(text, scope))
        yield from _conversions(text, parent, scope)
        yield from _lost_factors(node, scope)


def of_constant(node: Any, parent: ast.AST, scope: Scope) -> Iterator[Change]:
    """Yield an expression times a number, and with a number added."""
    text = ast.unparse(node)
    is_number = scope.shapes.get(text, "").startswith("(") or isinstance(node, ast.Constant)
    if is_number and not isinstance(parent, ast.Subscript | ast.Call | ast.Dict | ast.Return):
        yield "factor", parsed(f"{CONSTANT} * ({text})")
        yield "number", parsed(f"{CONSTANT} + ({text})")


def _operands(node: Any) -> Iterator[Change]:
    """Yield the operands of an operation, each alone, and both exchanged."""
    if isinstance(node, ast.UnaryOp):
        yield "condition" if isinstance(node.op, ast.Not) else "sign", node.operand
    elif isinstance(node, ast.BoolOp):
        yield from (("condition", value) for value in node.values)
    elif isinstance(node, ast.IfExp):
        yield from (("condition", value) for value in (node.body, node.orelse))
    elif isinstance(node, ast.BinOp):
        kinds = {ast.Add: "term", ast.Sub: "term", ast.Pow: "power"}
        kind = kinds.get(type(node.op), "factor")
        yield from ((kind, operand) for operand in (node.left, node.right))
        yield "order", ast.BinOp(node.right, node.op, node.left)
    elif isinstance(node, ast.List | ast.Tuple):
        for elements in _exchanged(node.elts):
            yield "order", type(node)(elements, ast.Load())


def _other_operators(node: Any) -> Iterator[Change]:
    """Yield an operation with another operator."""
    opposite: dict[type, ast.operator] = {
        ast.Add: ast.Sub(), ast.Sub: ast.Add(), ast.Mult: ast.Div(), ast.Div: ast.Mult(),
    }  # fmt: skip
    if isinstance(node, ast.Compare):
        for comparison in COMPARISONS:
            others = [comparison(), *node.ops[1:]]
            yield "condition", ast.Compare(node.left, others, node.comparators)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield from (("condition", ast.Constant(value)) for value in (True, False))
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
        yield "function", parsed(f"np.linalg.norm({ast.unparse(node.left)})")
        yield "function", ast.BinOp(node.left, ast.Mult(), node.right)
    elif isinstance(node, ast.BinOp) and type(node.op) in opposite:
        kind = "sign" if isinstance(node.op, ast.Add | ast.Sub) else "factor"
        yield kind, ast.BinOp(node.left, opposite[type(node.op)], node.right)
        if isinstance(node.op, ast.Div):
            yield "whole numbers", ast.BinOp(node.left, ast.FloorDiv(), node.right)


def _bounds(node: Any, parent: ast.AST) -> Iterator[Change]:
    """Yield a slice without its bounds, with other bounds, or a shorter or reversed loop."""
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Slice):
        yield "loop", node.value
        items = f"({ast.unparse(node.value)})"
    elif isinstance(parent, ast.For):
        items = f"list({ast.unparse(node)})"
    else:
        return
    for kind, parts in PARTS.items():
        yield from ((kind, parsed(f"{items}[{part}]")) for part in parts)


def _calls(node: ast.Call) -> Iterator[Change]:
    """Yield a call with two arguments exchanged, an argument alone, or another function."""
    for args in _exchanged(node.args):
        yield "order", ast.Call(node.func, args, node.keywords)
    yield from (("call", arg) for arg in node.args)
    if isinstance(node.func, ast.Attribute):
        if ast.unparse(node.func.value) not in MODULES:
            yield "call", node.func.value
        if node.func.attr == "arctan2":
            y, x = map(ast.unparse, node.args)
            yield "function", parsed(f"np.arctan({y} / {x})")
        if node.func.attr in ALLOCATIONS:
            yield "whole numbers", ast.Call(node.func, [*node.args, parsed("int")], node.keywords)
        for names in (names for names in FUNCTIONS if node.func.attr in names):
            other = names[names[0] == node.func.attr]
            func = ast.Attribute(node.func.value, other, ast.Load())
            yield "function", ast.Call(func, node.args, node.keywords)


def _exchanged(nodes: list[ast.expr]) -> Iterator[list[ast.expr]]:
    """Yield a list with each two neighbours exchanged."""
    for i in range(len(nodes) - 1):
        yield [*nodes[:i], nodes[i + 1], nodes[i], *nodes[i + 2 :]]


def _numbers(value: object, parent: ast.AST) -> Iterator[Change]:
    """Yield other numbers in the place of a number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    operator = getattr(parent, "op", None)
    is_power = isinstance(operator, ast.Pow)
    without = {0} if isinstance(operator, ast.Add | ast.Sub) else set()  # is an operand alone
    is_index = isinstance(parent, ast.Subscript | ast.Call)
    kind = "power" if is_power else "index" if is_index else "number"
    tolerances = TOLERANCES if 0 < value < TOLERANCE else ()
    others = (0, 1, -value, 2 * value, value / 2, value + 1, value - 1, *tolerances)
    for number in map(type(value), others):
        if number not in {value, *without}:
            yield kind, parsed(repr(number))


def _names(text: str, scope: Scope) -> Iterator[Change]:
    """Yield the names of values of the same shape; of an index, also its neighbours."""
    if text not in scope.plain:
        return
    kind = "index" if scope.shapes[text] == "int" else "name"
    counted = [text, *(name for name in scope.alike(text) if name.isidentifier())]
    steps = [f"{name} {step} 1" for name in counted for step in "+-"]
    if "parents" in scope.shapes and scope.shapes[text] == "int":
        steps.append(f"max(parents[{text}], 0)")
    near = ("0", "-1", *steps) if kind == "index" else ()
    yield from ((kind, parsed(other)) for other in (*scope.alike(text), *near))


def _neighbours(text: str, parent: Any, scope: Scope) -> Iterator[Change]:
    """Yield an index of the next or the last item, and of the item before or the first."""
    if isinstance(parent, ast.Subscript) and scope.shapes[text] == "int":
        yield "index", parsed(f"min({text} + 1, len({ast.unparse(parent.value)}) - 1)")
        yield "index", parsed(f"max({text} - 1, 0)")


def _of_one_form(text: str, scope: Scope) -> Iterator[str]:
    """Yield sums and products with other names or numbers than a text's."""
    form = WORD.sub("", text)
    for other, shape in scope.shapes.items():
        is_alike = shape == scope.shapes[text] and WORD.sub("", other) == form
        if is_alike and other != text and isinstance(parsed(other), ast.BinOp):
            yield other


def _conversions(text: str, parent: Any, scope: Scope) -> Iterator[Change]:
    """Yield a value with a wrong unit, factor or power, inverted, or read or written wrongly."""
    shape = scope.shapes[text]
    is_input = isinstance(parent, ast.Assign) and is_idle(parent)
    is_output = isinstance(parent, ast.Dict | ast.Return)
    alike = {"*" if shape.startswith("(") else "", shape, re.sub(r"\d+", "n", shape, count=1)}
    alike |= {"(n, n)"} if re.fullmatch(r"\((\d+), \1\)", shape) else set()
    for kind, patterns in PATTERNS.items():
        if {"reading": is_input, "writing": is_output}.get(kind, not is_input):
            for pattern in (p for key in alike & patterns.keys() for p in patterns[key]):
                yield kind, parsed(pattern.replace("{}", f"({text})"))
    if shape == NUMBER and text in scope.plain:
        for other in scope.alike(text):
            yield from (("factor", parsed(f"({text}) {sign} {other}")) for sign in "*/")


def _lost_factors(node: Any, scope: Scope) -> Iterator[Change]:
    """Yield a product of arrays without its first or second factor, in the shape of both."""
    if not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.Mult):
        return
    shape = scope.shapes[ast.unparse(node)]
    for factor, product in ((node.left, node.right), (node.right, node.left)):
        if scope.shapes.get(ast.unparse(product), shape) != shape:
            yield "factor", parsed(f"np.ones_like({ast.unparse(factor)}) * {ast.unparse(product)}")


def of_statement(statements: list[ast.stmt], i: int) -> Iterator[Rearrangement]:
    """Yield a block without statement i, with another statement there, or with a later place."""
    statement, before, after = statements[i], statements[:i], statements[i + 1 :]
    if is_idle(statement):
        return
    if not isinstance(statement, ast.Return | ast.FunctionDef):
        yield "missing line", "", [*before, ast.Pass(), *after]
    if isinstance(statement, ast.AugAssign):
        assigned = ast.Assign([statement.target], statement.value, lineno=0)
        yield "accumulation", header(assigned), [*before, assigned, *after]
        operator = ast.Sub() if isinstance(statement.op, ast.Add) else ast.Add()
        other = ast.AugAssign(statement.target, operator, statement.value)
        yield "sign", header(other), [*before, other, *after]
    if isinstance(statement, ast.Assign | ast.AugAssign):
        for k in range(1, len(after) + 1):
            line = f"{header(statement)}  # after {header(after[k - 1])}"
            yield "moved line", line, [*before, *after[:k], statement, *after[k:]]
        for k in range(i - 1):  # the line before may move as well
            line = f"{header(statement)}  # before {header(before[k])}"
            yield "moved line", line, [*before[:k], statement, *before[k:], *after]
    if isinstance(statement, ast.Assign):
        for lines in _in_place(statement):
            text = "; ".join(map(ast.unparse, lines))
            yield "shared array", text, [*before, *lines, *after]
    if isinstance(statement, ast.For | ast.While):
        yield from _around_loop(statement, before, after)


def _in_place(statement: ast.Assign) -> Iterator[list[ast.stmt]]:
    """Yield x[j] = f(x[p]) as lines with the result in x[p], shared by x[j]."""
    target = statement.targets[0]
    if not isinstance(target, ast.Subscript):
        return
    for node in ast.walk(statement.value):
        if isinstance(node, ast.Subscript) and ast.unparse(node.value) == ast.unparse(target.value):
            text = ast.unparse(node)
            value, name = ast.unparse(statement.value), ast.unparse(target)
            if text != name:
                yield ast.parse(f"{text}[...] = {value}\n{name} = {text}").body


def _around_loop(
    loop: ast.For | ast.While, before: list[ast.stmt], after: list[ast.stmt]
) -> Iterator[Rearrangement]:
    """Yield a loop with its first pass alone, and lines moved into or out of a loop."""

    def with_body(body: list[ast.stmt]) -> Any:
        values = {**dict(ast.iter_fields(loop)), "body": body, "lineno": 0}
        return type(loop)(**values)

    single_pass = with_body([*loop.body, ast.Break()])
    once = header(loop).replace("while", "if", 1) if isinstance(loop, ast.While) else ""
    yield "loop", once or f"{header(loop)}  # once", [*before, single_pass, *after]
    for k in range(1, len(loop.body)):  # the first counts the passes
        line, rest = loop.body[k], with_body([*loop.body[:k], *loop.body[k + 1 :]])
        for place, lines in (("before", [line, rest]), ("after", [rest, line])):
            text = f"{header(line)}  # {place} the loop: {header(loop)}"
            yield "moved line", text, [*before, *lines, *after]
    if before and isinstance(before[-1], ast.Assign):
        text = f"{header(before[-1])}  # in the loop: {header(loop)}"
        body = [*loop.body[:1], before[-1], *loop.body[1:]]
        yield "moved line", text, [*before, with_body(body), *after]


def is_idle(statement: ast.stmt) -> bool:
    """Return whether a statement is `x = x`, which stands for the reading of an input."""
    return isinstance(statement, ast.Assign) and ast.unparse(statement.targets[0]) == ast.unparse(
        statement.value
    )


def parsed(text: str) -> ast.expr:
    """Return the expression of a text."""
    return ast.parse(text, mode="eval").body


def header(statement: ast.stmt) -> str:
    """Return the first line of a statement, without the lines of its block."""
    return ast.unparse(statement).splitlines()[0]
