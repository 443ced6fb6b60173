"""Follow a quantity over many runs: a table with sparklines, and a figure."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.text.printable import visible

from ..harness.record import Record, on_record
from ..tables.columns import text
from ..tables.results import counted, printable
from ..tables.table import Column, Table, cells
from .rows import RowKey, by_row, contains_any, distinguishing

BLOCKS = "▁▂▃▄▅▆▇█"
# Rows of the table; curves of the figure that are labelled, the others are grey.
MAX_ROWS, LABELLED = 20, 6


class RecordedRun(NamedTuple):
    """The rows of a folder, its name with the commit of the sources, and its latest time."""

    name: str
    latest: str
    rows: dict[RowKey, Record]


class Course(NamedTuple):
    """Medians of a quantity of a row over the runs, NaN where it was not measured."""

    problem: str
    solver: str
    settings: str
    medians: np.ndarray

    @property
    def finite(self) -> np.ndarray:
        """The medians that are numbers."""
        return self.medians[np.isfinite(self.medians)]

    @property
    def change(self) -> float:
        """Logarithm of the last positive median over the first; 0 with fewer than two."""
        positive = self.finite[self.finite > 0]
        return math.log(positive[-1] / positive[0]) if len(positive) > 1 else 0.0


def read_runs(folders: Iterable[Path]) -> list[RecordedRun]:
    """Return the runs of folders, the oldest first.

    Raises:
        ValueError: if a folder has no records, or they cannot be read.
    """
    runs = []
    for folder in folders:
        records = on_record(folder, typed=False).records
        newest = max(records, key=lambda record: record.when)
        name = f"{folder.name} {newest.commit or newest.stamp.get('source', '')}"
        rows = by_row(map(printable, records))
        runs.append(RecordedRun(visible(name.strip()), newest.when, rows))
    return sorted(runs, key=lambda run: run.latest)


def courses(runs: Sequence[RecordedRun], quantity: str, words: Sequence[str] = ()) -> list[Course]:
    """Return the course of a quantity in each row, the largest change first.

    With words, only rows whose problem or solver contains one of them.

    Raises:
        ValueError: if no row has the quantity; the message lists those that rows have.
    """
    keys = list(dict.fromkeys(key for run in runs for key in run.rows if contains_any(key, words)))
    if not keys:
        raise ValueError(f"only: expected part of a problem or solver, got {' '.join(words)!r}")
    settings = distinguishing(keys)
    rows = {key: [run.rows.get(key) for run in runs] for key in keys}
    medians = {key: np.array([_median(r, quantity) for r in rows[key]]) for key in keys}
    every = [Course(*key[1:3], settings[key], medians[key]) for key in keys]
    measured = [course for course in every if len(course.finite)]
    if not measured:
        names = {name for key in keys for record in rows[key] if record for name in record.arrays}
        if quantity in names:
            raise ValueError(f"quantity: expected finite numbers of {quantity!r}, got none")
        raise ValueError(f"quantity: expected one of {', '.join(sorted(names))}, got {quantity!r}")
    return sorted(measured, key=lambda course: -abs(course.change))


def _median(record: Record | None, quantity: str) -> float:
    array = record.arrays.get(quantity) if record else None
    return float(np.median(array)) if array is not None and array.size else math.nan


def sparkline(numbers: np.ndarray) -> str:
    """Return a block for each number, as high as it is between the extremes; a dot for NaN."""
    finite = numbers[np.isfinite(numbers)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
    scale = (len(BLOCKS) - 1) / ((high - low) or 1.0)
    return "".join(
        BLOCKS[int((number - low) * scale + 0.5)] if np.isfinite(number) else "·"
        for number in numbers
    )


def table(runs: Sequence[RecordedRun], rows: Sequence[Course], quantity: str) -> Table:
    """Return a table of the courses that changed most."""
    columns = (
        text("problem", lambda course: course.problem),
        text("solver", lambda course: course.solver),
        text("settings", lambda course: course.settings),
        Column("first", read=lambda course: course.finite[0]),
        Column("last", read=lambda course: course.finite[-1]),
        Column("ratio", read=lambda course: math.exp(course.change)),
        text("trend", lambda course: sparkline(course.medians)),
    )
    hidden = len(rows) - MAX_ROWS
    more = f"; {counted(hidden, 'more row')} changed less" if hidden > 0 else ""
    title = f"{quantity}, {counted(len(runs), 'run')}: {', '.join(run.name for run in runs)}{more}"
    return Table("history", title, columns, cells(columns, rows[:MAX_ROWS]))


def draw(runs: Sequence[RecordedRun], rows: Sequence[Course], quantity: str) -> str:
    """Return the courses as SVG: the largest changes in colour, the others grey."""
    from ..figures.canvas import canvas, styled, svg_of
    from ..figures.chart import LOOKS
    from ..figures.style import COLOURS, plain_label

    with styled():
        figure, (ax,) = canvas(4.2, 1)
        for i, course in reversed(list(enumerate(rows))):
            look = LOOKS[i % len(LOOKS)]
            style: dict[str, Any] = {"color": COLOURS["rule"], "linewidth": 0.8, "marker": "."}
            if i < LABELLED:
                title = ", ".join(filter(None, course[:3]))
                style = {"color": COLOURS[look.colour], "label": plain_label(title)}
                style |= {"linestyle": look.line, "marker": look.marker}
            ax.plot(range(len(runs)), course.medians, zorder=1 + (i < LABELLED), **style)
        if all((course.finite > 0).all() for course in rows):
            ax.set_yscale("log")
        ax.set_xticks(range(len(runs)), [plain_label(run.name) for run in runs], rotation=30)
        ax.set_ylabel(plain_label(quantity))
        handles, labels = ax.get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside lower center")
        return svg_of(figure, f"{quantity} over {counted(len(runs), 'run')}")
