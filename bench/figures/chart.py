"""A chart as data: panels of curves or of marks in rows, the labelled solvers, and their looks.

Sketches of charts import the drawing only when drawn.
"""

import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray

from ..peers import catalogue
from .sketch import Sketch
from .style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Labelled curves; the others are grey.
MAX_LABELLED = 6
LINE, MARKS, SPAN = "line", "marks", "span"
LESS, GREATER = "less", "greater"


# Any two differ in all three, and so without colour too.
LOOKS = (
    Style("orange", "-", "o"),
    Style("blue", (0, (5, 1.6)), "s"),
    Style("green", (0, (4, 1.2, 1, 1.2)), "^"),
    Style("purple", (0, (1, 1.1)), "v"),
    Style("brass", (0, (4, 1, 1, 1, 1, 1)), "D"),
    Style("ink", (0, (9, 2)), "X"),
)
GREY = Style("faint", "-", ".")


class Series(NamedTuple):
    """A curve, or marks.

    Attributes:
        solver: by its name in records.
        x, y: coordinates; in a chart of rows y is the number of a row.
        low, high: bounds along y, or along x in a chart of rows; () if unknown.
        form: a line, marks, or spans from a hollow mark to a filled one, a pair of points each.
    """

    solver: str
    x: FloatArray
    y: FloatArray
    low: FloatArray | tuple[()] = ()
    high: FloatArray | tuple[()] = ()
    form: str = LINE


def series(
    solver: str, x: Any, y: Any, between: tuple[Any, Any] = ((), ()), form: str = LINE
) -> Series:
    """Return the finite points of a curve.

    Raises:
        ValueError: if lengths differ, or an entry is no number.
    """
    rows = [np.asarray(row, dtype=float) for row in (x, y, *between) if np.size(row)]
    if any(row.ndim != 1 or len(row) != len(rows[0]) for row in rows) or len(rows) not in (0, 2, 4):
        raise ValueError(f"x, y: expected rows of one length, got {[row.shape for row in rows]}")
    if not rows:
        return Series(solver, np.empty(0), np.empty(0), form=form)
    finite = np.isfinite(rows[0]) & np.isfinite(rows[1])
    x, y, *bounds = (row[finite] for row in rows)
    low, high = bounds or ((), ())
    return Series(solver, x, y, low, high, form)


class Axis(NamedTuple):
    """Label, scale and limits of an axis."""

    label: str = ""
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)


NO_AXIS = Axis()


class Panel(NamedTuple):
    """A diagram of a chart: title, curves, a line across (such as a tolerance), y label.

    An empty label stands for the chart's.
    """

    title: str
    series: tuple[Series, ...]
    across: float | None = None
    label: str = ""


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels of curves, or of marks in named rows.

    Attributes:
        name: the stem of its files.
        title: heading.
        shows: a sentence on its contents.
        panels: row by row.
        x, y: axes of all panels.
        columns: number of panels beside each other.
        rows: names of rows from above; () if y is a quantity.
        better: whether lower or higher curves are better.
        user_solvers: solvers that are always labelled.
        hollow, filled: meaning of the two marks of a span.
    """

    name: str
    title: str
    shows: str
    panels: tuple[Panel, ...]
    x: Axis
    y: Axis = NO_AXIS
    columns: int = 3
    rows: tuple[str, ...] = ()
    better: str = LESS
    user_solvers: frozenset[str] = frozenset()
    hollow: str = ""
    filled: str = ""

    @cached_property
    def solvers(self) -> list[str]:
        """All solvers in the order of the panels."""
        return list(dict.fromkeys(curve.solver for panel in self.panels for curve in panel.series))

    @cached_property
    def labelled(self) -> list[str]:
        """The labelled solvers: all, or the user’s, the best of each side, and the next best.

        The sides are Plumbob's solvers and all others.
        """
        names = self.solvers
        if len(names) <= MAX_LABELLED:
            return names
        costs = self.costs()
        ranked = sorted(names, key=lambda name: costs[name])
        firsts = [name for name in ranked if name in self.user_solvers]
        for side in (True, False):
            peers = [name for name in ranked if name not in self.user_solvers]
            firsts += [name for name in peers if catalogue.is_ours(name) == side][:1]
        labelled = list(dict.fromkeys([*firsts, *ranked]))[:MAX_LABELLED]
        return [name for name in names if name in labelled]

    @cached_property
    def unlabelled(self) -> list[str]:
        """The grey solvers."""
        return [name for name in self.solvers if name not in self.labelled]

    @property
    def caption(self) -> str:
        """The sentence on its contents, and how the grey solvers are named."""
        grey = " Point at a grey curve for its name."
        return self.shows + grey * bool(self.unlabelled)

    def costs(self) -> dict[str, float]:
        """Return the places of each solver, added over the panels, by the mean of its curve."""
        totals = dict.fromkeys(self.solvers, 0.0)
        for panel in self.panels:
            means = {curve.solver: self._mean(curve) for curve in panel.series}
            finite = [name for name in means if np.isfinite(means[name])]
            order = sorted(finite, key=lambda name: means[name])
            places = dict(zip(order, range(len(order)), strict=True))
            for name in totals:
                totals[name] += places.get(name, len(totals))
        return totals

    def _mean(self, curve: Series) -> float:
        """Return the mean of a curve as drawn, lower for better; NaN without points."""
        numbers, axis = (curve.x, self.x) if self.rows else (curve.y, self.y)
        with np.errstate(divide="ignore", invalid="ignore"):
            scaled = np.log10(numbers) if axis.log else numbers
        finite = scaled[np.isfinite(scaled)]
        sign = -1.0 if self.better == GREATER else 1.0
        return sign * float(finite.mean()) if finite.size else np.nan


def looks(names: Sequence[str]) -> Mapping[str, Style]:
    """Return the look of each of a few solvers, the same in every chart if free.

    Solvers with a colour of their own choose first.
    """
    styled = [name for name in names if catalogue.find(name).colour]
    assigned: dict[str, Style] = {}
    for name in dict.fromkeys([*styled, *names]):
        assigned[name] = next(look for look in _preferred(name) if look not in assigned.values())
    return assigned


def _preferred(name: str) -> tuple[Style, ...]:
    """Return all looks, the solver's own colour first, else by a hash of its name."""
    colours = [look.colour for look in LOOKS]
    own = catalogue.find(name).colour
    first = colours.index(own) if own in colours else zlib.crc32(name.encode()) % len(LOOKS)
    return LOOKS[first:] + LOOKS[:first]


def chart_sketch(chart: Chart) -> Sketch | None:
    """Return the sketch of a chart, None if the chart has no curves."""
    if not any(panel.series for panel in chart.panels):
        return None
    return Sketch(chart.name, chart.title, chart.caption, chart, _draw_chart)


def _draw_chart(chart: Chart) -> "Figure":
    from .drawing import draw_chart

    return draw_chart(chart)


def declared_chart(
    declared: Mapping[str, Any],
    panels: Iterable[Panel],
    user_solvers: frozenset[str],
    **fields: Any,
) -> Sketch | None:
    """Return the sketch of a chart declared in a file of captions; None without panels.

    `fields` are the undeclared or different fields of `Chart`.
    """
    chart = {"panels": tuple(panels), "user_solvers": user_solvers, **declared, **fields}
    for name in ("x", "y"):
        axis = {"limits": (), **chart.get(name, {})}
        chart[name] = Axis(**{**axis, "limits": (*axis["limits"], None, None)[:2]})
    return chart_sketch(Chart(**chart)) if chart["panels"] else None
