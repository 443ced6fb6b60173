"""Arrays as CSV files, written plainly, and read as spreadsheets and C write them."""

import math
import re
from collections.abc import Iterator, Mapping
from itertools import accumulate
from operator import mul
from typing import Any

import numpy as np

from plumbob.text.printable import one_line

from ..functions import checked
from ..message import plain
from ..task import Field

_BOMS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
# As C, JavaScript and spreadsheets write what is no number.
_NO_NUMBER = re.compile(r"[+-]?(nan(\(\w*\))?|1\.#(ind|qnan|snan)\d*|n/a|null)", re.IGNORECASE)
_WORDS = {"true": 1.0, "false": 0.0}
# What separates cells, None for white space, and the other decimal sign that it allows.
_DIALECTS = ((";", ","), ("\t", ","), (",", "."), (None, ","))


def write_table(value: Any) -> str:
    """Return an array as CSV: the last axis along a row, the others down; vectors in a column."""
    if isinstance(value, str):
        return value + "\n"
    array = np.asarray(value)
    rows = array.reshape(-1, array.shape[-1] if array.ndim > 1 else 1)
    return "".join(",".join(_digits(cell) for cell in plain(row)) + "\n" for row in rows)


def _digits(cell: float | bool) -> str:
    return str(int(cell)) if isinstance(cell, bool) else repr(cell)


def read_table(field: Field, counts: Mapping[str, int], data: bytes) -> Any:
    """Return an array, or a single number, from CSV; raise ValueError if it is not understood.

    Cells stand between commas, semicolons, tabs or spaces; the decimal sign may be a comma where
    that is clear. Names in the first line, a comma at the end of each line, lines that begin with
    # and empty ones are left aside. The numbers run along rows, the last index fastest, and a row
    holds the last axis, the last few axes, or a number. `counts` are the numbers that the words of
    the field's shape stand for; a word may be missing.
    """
    lines = [
        (number, line.strip()) for number, line in enumerate(_text(field, data).splitlines(), 1)
    ]
    lines = [(i, line) for i, line in lines if line.strip(";,\t ") and not line.startswith("#")]
    if not lines:
        return checked(field, counts, [])
    errors = []
    for separator, decimal in _DIALECTS:
        if separator is None or any(separator in line for _, line in lines):
            try:
                rows = list(_rows(field, lines, separator, decimal))
                return checked(field, counts, _shaped(field, counts, rows))
            except ValueError as error:
                errors.append(error)
    raise errors[0]


def _text(field: Field, data: bytes) -> str:
    encoding = next((name for bom, name in _BOMS.items() if data.startswith(bom)), "utf-8")
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        raise ValueError(f"{field.name}: expected a text file in UTF-8, got other bytes") from None


def _rows(
    field: Field, lines: list[tuple[int, str]], separator: str | None, decimal: str
) -> Iterator[list[float]]:
    cells = [
        (number, [cell.strip(' "') for cell in line.split(separator)]) for number, line in lines
    ]
    if all(row[-1] == "" for _, row in cells):
        cells = [(number, row[:-1]) for number, row in cells]
    if len(cells) > 1 and all(_number(cell, decimal) is None for cell in cells[0][1]):
        cells = cells[1:]
    width = len(cells[0][1])
    for line, row in cells:
        numbers = [_number(cell, decimal) for cell in row]
        if len(row) != width:
            raise ValueError(
                f"{field.name}: expected {width} numbers in line {line} as before, got {len(row)}"
            )
        if None in numbers:
            wrong = row[numbers.index(None)]
            raise ValueError(
                f"{field.name}: expected a number in line {line}, got {one_line(repr(wrong), 40)}"
            )
        yield [number for number in numbers if number is not None]


def _number(cell: str, decimal: str) -> float | None:
    """Return the number of a cell, or None."""
    if decimal in cell and "." not in cell:
        cell = cell.replace(decimal, ".")
    if cell.lower() in _WORDS:
        return _WORDS[cell.lower()]
    if _NO_NUMBER.fullmatch(cell):
        return math.nan
    try:
        return float(cell) if "_" not in cell else None
    except ValueError:
        return None


def _shaped(field: Field, counts: Mapping[str, int], rows: list[list[float]]) -> Any:
    """Return rows in the shape that is expected, or as they are if they cannot have it."""
    shape = [
        counts.get(length, -1) if isinstance(length, str) else length for length in field.shape
    ]
    widths = sorted({1, *(abs(length) for length in accumulate(reversed(shape), mul))})
    array = np.array(rows)
    if array.shape[1] not in widths:
        raise ValueError(
            f"{field.name}: expected {' or '.join(map(str, widths))} numbers a line, "
            f"got {array.shape[1]}"
        )
    try:
        return array.reshape(shape)
    except ValueError:
        return array
