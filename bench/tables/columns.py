"""Cells and columns that many tables have."""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..measure import metrics
from ..measure.record import Record
from .table import Cell, Column, in_unit, words

# The names of the quantiles of a spread, in its order.
QUANTILES = ("median", "95 %", "largest")


def text(title: str, read: Callable[[Any], Cell], folded: bool = False) -> Column:
    """Return a column of words."""
    return Column(title, words=True, read=read, folded=folded)


def folded(*columns: Column) -> tuple[Column, ...]:
    """Return columns that are shown on demand only."""
    return tuple(replace(column, folded=True) for column in columns)


def number(value: float) -> float | None:
    """Return the cell of a number, None of NaN."""
    return None if math.isnan(value) else value


def extent_in_words(sizes: Collection[int]) -> str:
    """Return the least and the greatest number: "20 to 200", "20" if equal, "" without any."""
    ends = sorted({min(sizes), max(sizes)}) if sizes else []
    return " to ".join(map(words, ends))


def of_numbers(read: Callable[[Any], Cell]) -> Callable[[Record], Cell]:
    """Return what reads a cell from the values of a record, None without numbers."""
    return lambda record: read(record.values) if record.has_numbers else None


def quantiles(
    title: str, names: Iterable[str], read: Callable[[Any], Sequence[Cell]], unit: str = ""
) -> tuple[Column, ...]:
    """Return columns of the named quantiles of a spread, which is read from the row's subject."""

    def cell(name: str, subject: Any) -> Cell:
        return read(subject)[QUANTILES.index(name)]

    return tuple(
        Column(f"{title}, {name}", unit, group=title, read=partial(cell, name)) for name in names
    )


def spread_of(record: Record, name: str) -> Sequence[int | float]:
    """Return median, 95th percentile and maximum of an array; of counts, as whole numbers."""
    array = record.measured[name]
    return metrics.whole(array) if array.dtype.kind in "iu" else metrics.spread(array)


def reported_iterations(record: Record) -> metrics.Floats:
    """Return the iterations of the solves whose solver counts them, (solve,)."""
    counts = record.measured["iterations"]
    return counts[~np.isnan(counts)]


def spread_of_iterations(record: Record) -> Sequence[Cell]:
    """Return median, 95th percentile and maximum of the iterations, None without any count.

    The counts of a user's solver are its own claim, and marked so.
    """
    counts = reported_iterations(record)
    if not counts.size:
        return (None, None, None)
    whole = metrics.whole(counts)
    return [f"{words(n)} claimed" for n in whole] if record.measured.get("entrant") else whole


def words_in(value: float, unit: str) -> str:
    """Return a value in SI units as words in another unit: "1.20 ms"."""
    if math.isinf(value):
        return words(value)
    return f"{words(in_unit(value, unit))}{'' if unit == '°' else ' '}{unit}"
