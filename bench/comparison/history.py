"""A quantity over many runs: a table with lines of blocks, and a figure."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..harness.record import Record, on_record
from ..tables.columns import text
from ..tables.results import counted, printable
from ..tables.table import Column, Table, cells
from ..text import visible
from .rows import RowKey, by_row, distinguishing, is_meant

BLOCKS = "▁▂▃▄▅▆▇█"
# Rows on a terminal; curves of a figure that are labelled, the others are grey.
LINES, LABELLED = 20, 6


class Run(NamedTuple):
    """The rows of a folder, and what it is called: its name and the commit of the sources."""

    name: str
    when: str
    rows: dict[RowKey, Record]


class Course(NamedTuple):
    """The medians of a quantity of a row over runs, NaN where it was not measured."""

    problem: str
    solver: str
    settings: str
    values: np.ndarray

    @property
    def title(self) -> str:
        """Problem, solver, and what tells the row from others of theirs."""
        return ", ".join(filter(None, (self.problem, self.solver, self.settings)))

    @property
    def finite(self) -> np.ndarray:
        """The values that are numbers."""
        return self.values[np.isfinite(self.values)]

    @property
    def change(self) -> float:
        """The last value over the first, as a logarithm; 0 if there is but one."""
        known = self.finite[self.finite > 0]
        return math.log(known[-1] / known[0]) if len(known) > 1 else 0.0


def read_runs(folders: Iterable[Path]) -> list[Run]:
    """Return the runs of folders, the oldest first.

    Raises:
        ValueError: if a folder has no records, or they cannot be read.
    """
    return sorted((_read(folder) for folder in folders), key=lambda run: run.when)


def _read(folder: Path) -> Run:
    records = on_record(folder, typed=False).records
    newest = max(records, key=lambda record: record.when)
    commit = newest.commit or newest.stamp.get("source", "")
    return Run(
        visible(f"{folder.name} {commit}".strip()), newest.when, by_row(map(printable, records))
    )


def courses(runs: Sequence[Run], quantity: str, words: Sequence[str] = ()) -> list[Course]:
    """Return the course of a quantity in each row, the greatest change first.

    Only problems or solvers that contain one of the words are followed; all if there are none.

    Raises:
        ValueError: if no row has it; the message lists what rows have.
    """
    keys = list(dict.fromkeys(key for run in runs for key in run.rows if is_meant(key, words)))
    if not keys:
        raise ValueError(f"only: expected part of a problem or solver, got {' '.join(words)!r}")
    settings = distinguishing(keys)
    every = [_course(runs, key, quantity, settings[key]) for key in keys]
    known = [course for course in every if len(course.finite)]
    if not known:
        names = {n for run in runs for key in keys if key in run.rows for n in run.rows[key].arrays}
        if quantity in names:
            raise ValueError(f"quantity: expected finite numbers of {quantity!r}, got none")
        raise ValueError(f"quantity: expected one of {', '.join(sorted(names))}, got {quantity!r}")
    return sorted(known, key=lambda course: -abs(course.change))


def _course(runs: Sequence[Run], key: RowKey, quantity: str, settings: str) -> Course:
    values = [_median(run.rows.get(key), quantity) for run in runs]
    return Course(*key[1:3], settings, np.array(values))


def _median(record: Record | None, quantity: str) -> float:
    values = None if record is None else record.arrays.get(quantity)
    return float(np.median(values)) if values is not None and values.size else math.nan


def sparkline(values: np.ndarray) -> str:
    """Return a block for each value, the least lowest and a dot for none."""
    known = values[np.isfinite(values)]
    low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
    span = (high - low) or 1.0
    return "".join(
        BLOCKS[int((value - low) / span * (len(BLOCKS) - 1) + 0.5)] if np.isfinite(value) else "·"
        for value in values
    )


def table(runs: Sequence[Run], courses: Sequence[Course], quantity: str) -> Table:
    """Return a row for each of the courses that changed most."""
    columns = (
        text("problem", lambda course: course.problem),
        text("solver", lambda course: course.solver),
        text("settings", lambda course: course.settings),
        Column("first", read=lambda course: course.finite[0]),
        Column("last", read=lambda course: course.finite[-1]),
        Column("ratio", read=lambda course: math.exp(course.change)),
        text("course", lambda course: sparkline(course.values)),
    )
    more = f"; {len(courses) - LINES} more rows changed less" if len(courses) > LINES else ""
    title = f"{quantity}, {counted(len(runs), 'run')}: {', '.join(run.name for run in runs)}{more}"
    return Table("history", title, columns, cells(columns, courses[:LINES]))


def draw(runs: Sequence[Run], made: Sequence[Course], quantity: str) -> str:
    """Return the courses as SVG: those that changed most in colour, the others grey."""
    from ..figures.chart import LOOKS
    from ..figures.drawing import canvas, styled, svg_of
    from ..figures.style import COLOURS, written

    with styled():
        figure, (ax,) = canvas(4.2, 1)
        for i, course in reversed(list(enumerate(made))):
            grey = {"color": COLOURS["rule"], "linewidth": 0.8, "zorder": 1, "marker": "."}
            look = LOOKS[i % len(LOOKS)]
            named = {"color": COLOURS[look.colour], "linestyle": look.line, "marker": look.marker}
            style = {**named, "label": written(course.title)} if i < LABELLED else grey
            ax.plot(range(len(runs)), course.values, **style)
        if all((c.values[np.isfinite(c.values)] > 0).all() for c in made):
            ax.set_yscale("log")
        ax.set_xticks(range(len(runs)), [written(run.name) for run in runs], rotation=30)
        ax.set_ylabel(written(quantity))
        handles, labels = ax.get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside lower center")
        return svg_of(figure, f"{quantity} over {counted(len(runs), 'run')}")
