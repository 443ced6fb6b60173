"""Columns and rows of a table, chosen by what a user calls them, and an order of the rows."""

import difflib
import operator
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from plumbob.reference.arguments import name_list

from ..harness.metrics import Share
from .table import NO_SUMMARY, Cell, Table, best_cells, words

_COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_FILTER = re.compile(r"(.*?)(!=|!~|<=|>=|=|~|<|>)(.*)", re.DOTALL)
_NUMBERS = re.compile(r"\d+(-\d+)?(\s*,\s*\d+(-\d+)?)*")


def selected(
    table: Table, columns: Sequence[str] = (), rows: Sequence[str] = (), order: str = ""
) -> Table:
    """Return a table with only some columns and rows, in the order of one of its columns.

    The best are the best of the rows that are left, by all columns that the table had. The summary
    is of all rows, and so left out where one is.

    Raises:
        ValueError: if there is no such column, a filter is none, or no row is left.
    """
    left = filtered(table, rows)
    ordered = list(_ordered(left, order)) if order else list(range(len(left.rows)))
    chosen = [i for text in columns for i in column_numbers(table, text)] or range(
        len(left.columns)
    )
    chosen = list(dict.fromkeys(chosen))
    best = best_cells(left)
    asked = (lambda column: replace(column, folded=False)) if columns else (lambda column: column)
    return replace(
        left,
        columns=tuple(asked(left.columns[j]) for j in chosen),
        rows=tuple(tuple(left.rows[i][j] for j in chosen) for i in ordered),
        sources=tuple(left.sources[i] for i in ordered) if left.sources else (),
        summary=table.summary if len(left.rows) == len(table.rows) else NO_SUMMARY,
        best=frozenset(
            (row, column)
            for row, i in enumerate(ordered)
            for column, j in enumerate(chosen)
            if (i, j) in best
        ),
    )


def filtered(table: Table, rows: Sequence[str]) -> Table:
    """Return a table with the rows that pass: one filter of each column that has any.

    Raises:
        ValueError: if a filter is none, or no row passes.
    """
    tests: dict[int, list[Callable[[Cell], bool]]] = {}
    for text in rows:
        column, test = _test(table, text)
        tests.setdefault(column, []).append(test)
    left = [
        i
        for i, row in enumerate(table.rows)
        if all(any(test(row[j]) for test in those) for j, those in tests.items())
    ]
    if table.rows and not left:
        known = (f"{table.columns[j].title} is {_listed(table, j)}" for j in tests)
        raise ValueError(f"--rows: no row of {table.name} passes; {'; '.join(known)}")
    return replace(
        table,
        rows=tuple(table.rows[i] for i in left),
        unranked=frozenset(new for new, i in enumerate(left) if i in table.unranked),
        sources=tuple(table.sources[i] for i in left) if table.sources else (),
    )


def _listed(table: Table, j: int, most: int = 12) -> str:
    values = list(dict.fromkeys(words(row[j]) for row in table.rows))
    return " or ".join(map(repr, values[:most])) + (" or another" if values[most:] else "")


def _test(table: Table, text: str) -> tuple[int, Callable[[Cell], bool]]:
    """Return the number of a column and what its cell has to fulfil."""
    found = _FILTER.fullmatch(text)
    if not found:
        raise ValueError(
            "--rows: expected COLUMN and one of = != ~ !~ < > <= >= and a value, such as "
            f"solver=Newton, got {text!r}"
        )
    name, sign, value = (part.strip() for part in found.groups())
    (column,) = column_numbers(table, name, "--rows", several=False)
    if sign in _COMPARE:
        number = _number(value)
        if number is None:
            raise ValueError(f"--rows: expected a number behind {name}{sign}, got {value!r}")
        return column, lambda cell: _holds(_COMPARE[sign], _number(cell), number)
    wanted, is_part, negated = _plain(value), "~" in sign, sign.startswith("!")

    def passes(cell: Cell) -> bool:
        text = _plain(words(cell))
        return ((wanted in text) if is_part else wanted == text) != negated

    return column, passes


def _holds(compare: Callable[[float, float], bool], a: float | None, b: float) -> bool:
    return a is not None and compare(a, b)


def _plain(text: str) -> str:
    """Return a text for comparison: case and the signs between words do not count."""
    return re.sub(r"[\s_/-]+", " ", text).strip().casefold()


def _number(value: Cell) -> float | None:
    """Return a cell as a number in the unit of its column; a share in percent."""
    if isinstance(value, Share):
        return 100.0 * value.hits / value.total if value.total else None
    try:
        return None if value is None else float(str(value).replace(",", ""))
    except ValueError:
        return None


def _ordered(table: Table, order: str) -> Iterator[int]:
    """Yield the numbers of the rows, the best or least first, those without a value last."""
    (j,) = column_numbers(table, order, "--sort", several=False)
    sign = -1.0 if table.columns[j].best == "greatest" else 1.0

    def rank(i: int) -> tuple[bool, float, str]:
        cell = table.rows[i][j]
        number = _number(cell)
        return cell is None, 0.0 if number is None else sign * number, words(cell)

    yield from sorted(range(len(table.rows)), key=rank)


def column_numbers(
    table: Table, text: str, option: str = "--columns", several: bool = True
) -> list[int]:
    """Return the columns that a text names: headings or titles with commas between, or numbers.

    Raises:
        ValueError: if there is no such column; the message offers the nearest.
    """
    if _NUMBERS.fullmatch(text.strip()) and not _named(table, text):
        return _by_number(table, text, option)
    pieces = text.split(",")
    found: list[int] = []
    while pieces:
        taken, exact = _longest(table, pieces)
        if exact is None or (found and not several):
            raise ValueError(_unknown(table, ",".join(pieces).strip(), option))
        found.append(exact)
        pieces = pieces[taken:]
    return found


def _longest(table: Table, pieces: Sequence[str]) -> tuple[int, int | None]:
    """Return how many pieces make the longest name of a column, and which that is."""
    for count in range(len(pieces), 0, -1):
        if found := _named(table, ",".join(pieces[:count])):
            return count, found[0]
    return 0, None


def _named(table: Table, name: str) -> list[int]:
    """Return the columns of this heading, or else of this title."""
    for read in (lambda c: c.heading, lambda c: c.titled, lambda c: c.title):
        found = [j for j, c in enumerate(table.columns) if _plain(read(c)) == _plain(name)]
        if len(found) == 1:
            return found
    return []


def _by_number(table: Table, text: str, option: str) -> list[int]:
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        low, high = int(first), int(last or first)
        if not 1 <= low <= high <= len(table.columns):
            raise ValueError(
                f"{option}: expected numbers from 1 to {len(table.columns)}, got {part.strip()}"
            )
        found += range(low - 1, high)
    return found


def _unknown(table: Table, name: str, option: str) -> str:
    headings = [column.heading for column in table.columns]
    known = {_plain(word): c.heading for c in table.columns for word in (c.heading, c.title)}
    known = {word[: len(_plain(name))]: heading for word, heading in known.items()} | known
    near: list[Any] = difflib.get_close_matches(_plain(name), known, n=1)
    hint = f"did you mean {known[near[0]]!r}?" if near else f"expected one of {name_list(headings)}"
    return f"{option}: {table.name} has no column {name!r}: {hint}"
