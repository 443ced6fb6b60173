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
    """Return the column of what a record's problem is called."""
    return text(title, lambda record: record.title)


SOLVER = text("solver", lambda record: label(record.solver))


def least(columns: Iterable[Column]) -> list[Column]:
    """Return columns in which the least number is best."""
    return [replace(column, best="least") for column in columns]


def greatest(columns: Iterable[Column]) -> list[Column]:
    """Return columns in which the greatest number or share is best."""
    return [replace(column, best="greatest") for column in columns]


def folded(columns: Iterable[Column]) -> list[Column]:
    """Return columns that are shown only to those who ask for them."""
    return [replace(column, folded=True) for column in columns]


def number(title: str, name: str = "", unit: str = "") -> Column:
    """Return the column of one number of a record, empty where a record has none."""
    return Column(title, unit, read=lambda record: record.arrays.get(name or title))


def share(title: str, hits: Callable[[Any], Any], best: str = "") -> Column:
    """Return the column of how many of some truth values hold."""
    return Column(title, note=INTERVAL, read=lambda record: metrics.share(hits(record)), best=best)


def spread(
    title: str, name: str, unit: str = "", of: Sequence[str] = (MEDIAN, LARGEST)
) -> list[Column]:
    """Return the columns of where an array of a record lies: counts as whole numbers."""
    return places(title, unit, of, partial(spread_of, name=name))


def spread_of(record: Record, name: str) -> Sequence[int | float]:
    """Return median, 95th percentile and maximum of an array; of counts, as whole numbers."""
    values = record.arrays[name]
    return metrics.whole(values) if values.dtype.kind in "iu" else metrics.spread(values)


def iterations_said(record: Record) -> metrics.Floats:
    """Return the iterations of those solves whose solver says them, (solve,)."""
    values = record.arrays["iterations"]
    return values[~np.isnan(values)]


def spread_of_iterations(record: Record) -> Sequence[Cell]:
    """Return median, 95th percentile and maximum of the iterations, None where all are unsaid."""
    said = iterations_said(record)
    return [claimed(n, record) for n in metrics.whole(said)] if said.size else (None, None, None)


def claimed(count: Cell, record: Record) -> Cell:
    """Return a count with "claimed" behind it if it is an entrant's own: nobody else counts it."""
    return f"{words(count)} claimed" if record.facts.get("entrant") else count


def allowed() -> Column:
    """Return the column of the most iterations that a solver may make."""
    return Column("iterations allowed", read=lambda record: record.settings.get("max_iterations"))


def remark() -> Column:
    """Return the column of what is to be said of a record."""
    return text("remark", lambda record: record.notes.get("remark", ""))


def iterations(of: Sequence[str] = (MEDIAN, LARGEST)) -> list[Column]:
    """Return the columns of the iterations of a record's solves, empty where they are unsaid."""
    return places("iterations", "", of, spread_of_iterations)


def effort(record: Record) -> metrics.Effort:
    """Return where the seconds of a record's solves lie."""
    return metrics.effort(record.arrays["seconds"])


def places(
    title: str, unit: str, of: Sequence[str], read: Callable[[Any], Sequence[Cell]]
) -> list[Column]:
    """Return the columns of some places in a sample, which `read` returns together."""
    return [
        Column(f"{title}, {which}", unit, read=at(_PLACES[which], read), group=title)
        for which in of
    ]


def at(i: int, read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return what reads one of several cells that are read together."""
    return lambda subject: read(subject)[i]


def words_in(value: float, unit: str) -> str:
    """Return a value in SI units as words in another unit, with that: "1.20 ms"."""
    if math.isinf(value):
        return words(value)
    separator = "" if unit == "°" else " "
    return f"{words(in_unit(value, unit))}{separator}{unit}"


def lengths_of_steps(records: Sequence[Record]) -> str:
    """Return the steps of records as words, shortest first [ms]."""
    lengths = sorted({record.settings["h"] for record in records})
    return " or ".join(words(in_unit(h, "ms")) for h in lengths) or "–"
