"""Select columns and rows of a table by the names that a user gives, and order the rows."""

import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import replace

from plumbob.reference.arguments import name_list

from .table import NO_SUMMARY, Table, number_of, with_columns, with_rows, words

# The most values of a column that a message lists.
_MAX_LISTED = 12


def selected(
    table: Table, columns: Sequence[str] = (), rows: Sequence[str] = (), order: str = ""
) -> Table:
    """Return a table with some columns and rows, in the order of a column.

    The best cells are the best of the remaining rows, by all columns. A summary is of all rows.

    Raises:
        ValueError: if there is no such column, a filter is malformed, or no row passes.
    """
    part = with_rows(table, _passing(table, rows))
    places = _ordered(part, order) if order else [*range(len(part.rows))]
    positions = [j for text in columns for j in column_numbers(table, text)]
    numbers = [*dict.fromkeys(positions)] or [*range(len(table.columns))]
    summary = table.summary if len(part.rows) == len(table.rows) else NO_SUMMARY
    return replace(with_columns(with_rows(part, places), numbers), summary=summary)


def _passing(table: Table, filters: Sequence[str]) -> list[int]:
    """Return the numbers of the rows that pass a filter of each filtered column."""
    places = {-1: {*range(len(table.rows))}}  # by column; no column has number -1
    for text in filters:
        name, sign, value = (*re.split("([=~])", text, maxsplit=1), "", "")[:3]
        if not sign:
            raise ValueError(f"--rows: expected COLUMN=VALUE or COLUMN~PART, got {text!r}")
        j, value = _column(table, name, "--rows"), _plain(value)
        cells = [_plain(words(row[j])) for row in table.rows]
        matches = {i for i, c in enumerate(cells) if c == value or (sign == "~" and value in c)}
        places[j] = places.get(j, set()) | matches
    passing = sorted(set.intersection(*places.values()))
    if table.rows and not passing:
        values = [*dict.fromkeys(words(row[j]) for row in table.rows)]
        listed = name_list(values[:_MAX_LISTED]) + " ..." * (len(values) > _MAX_LISTED)
        raise ValueError(f"--rows: no row of {table.name} passes; {name.strip()} is {listed}")
    return passing


def _plain(text: str) -> str:
    """Return a text for comparison, without case and signs between words."""
    return re.sub(r"[\s_/-]+", " ", text).strip().casefold()


def _ordered(table: Table, order: str) -> list[int]:
    """Return the numbers of the rows, the best or least first, empty cells last."""
    j = _column(table, order, "--sort")
    sign = -1.0 if table.columns[j].best == "greatest" else 1.0

    def rank(i: int) -> tuple[bool, float, str]:
        cell, number = table.rows[i][j], number_of(table.rows[i][j])
        return cell is None, 0.0 if math.isnan(number) else sign * number, words(cell)

    return sorted(range(len(table.rows)), key=rank)


def column_numbers(table: Table, text: str) -> list[int]:
    """Return the columns that a text names: headings or titles with commas between.

    Raises:
        ValueError: if there is no such column; the message offers the nearest.
    """
    parts, numbers, columns = text.split(","), list[int](), _by_name(table)
    while parts:  # a heading may contain commas: the longest counts
        names = [",".join(parts[:count]) for count in range(len(parts), 0, -1)]
        name = next((name for name in names if _plain(name) in columns), names[0])
        numbers.append(_column(table, name, "--columns"))
        parts = parts[name.count(",") + 1 :]
    return numbers


def _by_name(table: Table) -> dict[str, int]:
    """Return the columns by their headings, and by unique titles."""
    titles = [_plain(column.title) for column in table.columns]
    unique = {title: j for j, title in enumerate(titles) if titles.count(title) == 1}
    return unique | {_plain(column.heading): j for j, column in enumerate(table.columns)}


def _column(table: Table, name: str, option: str) -> int:
    """Return the column of a name; else the message offers the nearest, or lists all."""
    columns = _by_name(table)
    if _plain(name) in columns:
        return columns[_plain(name)]
    names = difflib.get_close_matches(_plain(name), columns, n=1)
    near = [table.columns[columns[text]] for text in names]
    listed = name_list([column.heading for column in table.columns])
    hint = f"did you mean {near[0].heading!r}?" if near else f"expected one of {listed}"
    raise ValueError(f"{option}: {table.name} has no column {name.strip()!r}: {hint}")
