"""Select columns and rows of a table by the names that a user gives, and order the rows."""

import difflib
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from plumbob.reference.arguments import name_list

from ..harness.metrics import Share
from .table import NO_SUMMARY, Cell, Table, best_cells, with_rows, words

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_FILTER = re.compile(r"(.*?)(!=|!~|<=|>=|=|~|<|>)(.*)", re.DOTALL)
_NUMBERS = re.compile(r"\d+(-\d+)?(\s*,\s*\d+(-\d+)?)*")
# The most values of a column that a message lists.
_MAX_LISTED = 12


def selected(
    table: Table, columns: Sequence[str] = (), rows: Sequence[str] = (), order: str = ""
) -> Table:
    """Return a table with some columns and rows, in the order of a column.

    The best cells are the best of the remaining rows, by all columns of the table. The summary is
    of all rows, and so left out if a row is.

    Raises:
        ValueError: if there is no such column, a filter is malformed, or no row passes.
    """
    part = filtered(table, rows)
    places = _ordered(part, order) if order else list(range(len(part.rows)))
    numbers = [j for text in columns for j in column_numbers(table, text)]
    numbers = list(dict.fromkeys(numbers)) or list(range(len(table.columns)))
    best = best_cells(part)
    if columns:
        part = replace(part, columns=tuple(replace(c, folded=False) for c in part.columns))
    ordered = with_rows(part, places)
    return replace(
        ordered,
        columns=tuple(part.columns[j] for j in numbers),
        rows=tuple(tuple(row[j] for j in numbers) for row in ordered.rows),
        summary=table.summary if len(part.rows) == len(table.rows) else NO_SUMMARY,
        best=frozenset((places.index(i), numbers.index(j)) for i, j in best if j in numbers),
    )


def filtered(table: Table, rows: Sequence[str]) -> Table:
    """Return a table with the rows that pass one filter of each column that has any.

    Raises:
        ValueError: if a filter is malformed, or no row passes.
    """
    tests: dict[int, list[Callable[[Cell], bool]]] = {}
    for text in rows:
        column, test = _test(table, text)
        tests.setdefault(column, []).append(test)
    places = [
        i
        for i, row in enumerate(table.rows)
        if all(any(test(row[j]) for test in group) for j, group in tests.items())
    ]
    if table.rows and not places:
        values = (f"{table.columns[j].title} is {_listed(table, j)}" for j in tests)
        raise ValueError(f"--rows: no row of {table.name} passes; {'; '.join(values)}")
    return with_rows(table, places)


def _listed(table: Table, j: int) -> str:
    texts = list(dict.fromkeys(words(row[j]) for row in table.rows))
    more = " or another" if len(texts) > _MAX_LISTED else ""
    return " or ".join(map(repr, texts[:_MAX_LISTED])) + more


def _test(table: Table, text: str) -> tuple[int, Callable[[Cell], bool]]:
    """Return the number of a column and the condition on its cells."""
    match = _FILTER.fullmatch(text)
    if not match:
        raise ValueError(
            "--rows: expected COLUMN and one of = != ~ !~ < > <= >= and a value, such as "
            f"solver=Newton, got {text!r}"
        )
    name, sign, target = (part.strip() for part in match.groups())
    (column,) = column_numbers(table, name, "--rows", several=False)
    if sign not in _COMPARE:
        return column, lambda cell: _matches(words(cell), sign, target)
    bound, compare = _number(target), _COMPARE[sign]
    if bound is None:
        raise ValueError(f"--rows: expected a number behind {name}{sign}, got {target!r}")
    return column, lambda cell: (x := _number(cell)) is not None and compare(x, bound)


def _matches(text: str, sign: str, target: str) -> bool:
    """Return whether a text equals the target or, with a tilde, contains it; "!" negates."""
    text, target = _plain(text), _plain(target)
    return (target in text if "~" in sign else target == text) != sign.startswith("!")


def _plain(text: str) -> str:
    """Return a text for comparison, without case and signs between words."""
    return re.sub(r"[\s_/-]+", " ", text).strip().casefold()


def _number(cell: Cell) -> float | None:
    """Return a cell as a number in the unit of its column, a share in percent."""
    if isinstance(cell, Share):
        return 100.0 * cell.hits / cell.total if cell.total else None
    try:
        return None if cell is None else float(str(cell).replace(",", ""))
    except ValueError:
        return None


def _ordered(table: Table, order: str) -> list[int]:
    """Return the numbers of the rows, the best or least first, empty cells last."""
    (j,) = column_numbers(table, order, "--sort", several=False)
    sign = -1.0 if table.columns[j].best == "greatest" else 1.0

    def rank(i: int) -> tuple[bool, float, str]:
        cell = table.rows[i][j]
        return cell is None, sign * (_number(cell) or 0.0), words(cell)

    return sorted(range(len(table.rows)), key=rank)


def column_numbers(
    table: Table, text: str, option: str = "--columns", several: bool = True
) -> list[int]:
    """Return the columns that a text names: headings or titles with commas between, or numbers.

    Raises:
        ValueError: if there is no such column; the message offers the nearest.
    """
    if _NUMBERS.fullmatch(text.strip()) and _column_of(table, text) is None:
        return _by_number(table, text, option)
    parts = text.split(",")
    numbers: list[int] = []
    while parts:
        for count in range(len(parts), 0, -1):  # a heading may contain commas: the longest counts
            number = _column_of(table, ",".join(parts[:count]))
            if number is not None:
                break
        if number is None or (numbers and not several):
            raise ValueError(_unknown(table, ",".join(parts).strip(), option))
        numbers.append(number)
        parts = parts[count:]
    return numbers


def _column_of(table: Table, name: str) -> int | None:
    """Return the only column of this heading, or else of this title."""
    for attribute in ("heading", "titled", "title"):
        texts = [_plain(getattr(column, attribute)) for column in table.columns]
        if texts.count(_plain(name)) == 1:
            return texts.index(_plain(name))
    return None


def _by_number(table: Table, text: str, option: str) -> list[int]:
    numbers: list[int] = []
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        low, high = int(first), int(last or first)
        if not 1 <= low <= high <= len(table.columns):
            raise ValueError(
                f"{option}: expected numbers from 1 to {len(table.columns)}, got {part.strip()}"
            )
        numbers += range(low - 1, high)
    return numbers


def _unknown(table: Table, name: str, option: str) -> str:
    """Return a message that offers the nearest heading, or lists all."""
    headings = {_plain(text): c.heading for c in table.columns for text in (c.heading, c.title)}
    headings = {text[: len(_plain(name))]: h for text, h in headings.items()} | headings
    near = difflib.get_close_matches(_plain(name), list(headings), n=1)
    listed = name_list([column.heading for column in table.columns])
    hint = f"did you mean {headings[near[0]]!r}?" if near else f"expected one of {listed}"
    return f"{option}: {table.name} has no column {name!r}: {hint}"
