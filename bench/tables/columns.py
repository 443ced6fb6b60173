"""Columns that many tables have: a heading, and how its cell is read from a record."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..harness import metrics
from ..harness.record import Record
from .results import label
from .table import INTERVAL, Cell, Column, in_unit, words

MEDIAN, P95, LARGEST = "median", "95 %", "largest"
_PLACES = {MEDIAN: 0, P95: 1, LARGEST: 2, "mean": 2}


def text(title: str, read: Callable[[Any], Cell]) -> Column:
    """Return a column of words."""
    return Column(title, words=True, read=read)


def titled(title: str) -> Column:
    """Return the column of the problem's title."""
    return text(title, lambda record: record.title)


SOLVER = text("solver", lambda record: label(record.solver))


def least(columns: Iterable[Column]) -> list[Column]:
    """Return columns in which the least number is best."""
    return [replace(column, best="least") for column in columns]


def greatest(columns: Iterable[Column]) -> list[Column]:
    """Return columns in which the greatest number or share is best."""
    return [replace(column, best="greatest") for column in columns]


def folded(columns: Iterable[Column]) -> list[Column]:
    """Return columns that are shown on demand only."""
    return [replace(column, folded=True) for column in columns]


def number(title: str, name: str = "", unit: str = "") -> Column:
    """Return the column of a number of a record, empty where a record has none."""
    return Column(title, unit, read=lambda record: record.arrays.get(name or title))


def share(title: str, hits: Callable[[Any], Any], best: str = "") -> Column:
    """Return the column of the share of true entries."""
    return Column(title, note=INTERVAL, read=lambda record: metrics.share(hits(record)), best=best)


def spread(
    title: str, name: str, unit: str = "", of: Sequence[str] = (MEDIAN, LARGEST)
) -> list[Column]:
    """Return the columns of quantiles of an array of a record."""
    return places(title, unit, of, partial(spread_of, name=name))


def spread_of(record: Record, name: str) -> Sequence[int | float]:
    """Return median, 95th percentile and maximum of an array; of counts, as whole numbers."""
    array = record.arrays[name]
    return metrics.whole(array) if array.dtype.kind in "iu" else metrics.spread(array)


def iterations_said(record: Record) -> metrics.Floats:
    """Return the iterations of the solves where the solver counts them, (solve,)."""
    counts = record.arrays["iterations"]
    return counts[~np.isnan(counts)]


def spread_of_iterations(record: Record) -> Sequence[Cell]:
    """Return median, 95th percentile and maximum of the iterations, None without any count.

    The counts of an entrant are its own claim, and marked so.
    """
    counts = iterations_said(record)
    if not counts.size:
        return (None, None, None)
    whole = metrics.whole(counts)
    return [f"{words(n)} claimed" for n in whole] if record.facts.get("entrant") else whole


def allowed() -> Column:
    """Return the column of the iteration limit."""
    return Column("iterations allowed", read=lambda record: record.settings.get("max_iterations"))


def remark() -> Column:
    """Return the column of a record's remark."""
    return text("remark", lambda record: record.notes.get("remark", ""))


def iterations(of: Sequence[str] = (MEDIAN, LARGEST)) -> list[Column]:
    """Return the columns of the iterations of a record's solves, empty where not counted."""
    return places("iterations", "", of, spread_of_iterations)


def effort(record: Record) -> metrics.Effort:
    """Return median, 95th percentile and mean of the seconds of a record's solves."""
    return metrics.effort(record.arrays["seconds"])


def places(
    title: str, unit: str, of: Sequence[str], read: Callable[[Any], Sequence[Cell]]
) -> list[Column]:
    """Return the columns of some quantiles, which `read` returns together."""
    return [
        Column(f"{title}, {name}", unit, read=at(_PLACES[name], read), group=title) for name in of
    ]


def at(i: int, read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a reader of one of several cells that are read together."""
    return lambda subject: read(subject)[i]


def words_in(value: float, unit: str) -> str:
    """Return a value in SI units as words in another unit: "1.20 ms"."""
    if math.isinf(value):
        return words(value)
    return f"{words(in_unit(value, unit))}{'' if unit == '°' else ' '}{unit}"


def lengths_of_steps(records: Sequence[Record]) -> str:
    """Return the step lengths of records, shortest first [ms]."""
    lengths = sorted({record.settings["h"] for record in records})
    return " or ".join(words(in_unit(h, "ms")) for h in lengths) or "–"
