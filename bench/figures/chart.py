"""A chart as data: panels of curves or of marks in rows, which of them are labelled, their looks.

Nothing here draws, so that a chart is made in no time and compared with what was drawn before.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..peers import registry
from ..tables.results import label

Floats = NDArray[np.float64]

# So many curves are labelled; the others are grey.
MOST = 6
LINE, MARKS, SPAN = "line", "marks", "span"
LESS, GREATER = "less", "greater"
# Where curves are compared: so many places along their axis.
_PLACES = 64


class Look(NamedTuple):
    """A colour by its name in `style.COLOURS`, a line and a marker of matplotlib's."""

    colour: str
    line: Any
    marker: str


# Any two differ in all three, so that they are told apart without colour.
LOOKS = (
    Look("orange", "-", "o"),
    Look("blue", (0, (5, 1.6)), "s"),
    Look("green", (0, (4, 1.2, 1, 1.2)), "^"),
    Look("purple", (0, (1, 1.1)), "v"),
    Look("brass", (0, (4, 1, 1, 1, 1, 1)), "D"),
    Look("ink", (0, (9, 2)), "X"),
)
GREY = Look("faint", "-", ".")


class Series(NamedTuple):
    """A curve, or marks.

    Attributes:
        solver: whose it is, as records call it.
        x, y: where it goes; in a chart of rows y is the number of a row.
        low, high: what it lies between, along y, or along x in a chart of rows; () if unknown.
        form: a line, marks, or spans from a hollow mark to a filled one, a pair of points each.
    """

    solver: str
    x: Floats
    y: Floats
    low: Floats | tuple[()] = ()
    high: Floats | tuple[()] = ()
    form: str = LINE


def series(
    solver: str, x: Any, y: Any, between: tuple[Any, Any] = ((), ()), form: str = LINE
) -> Series:
    """Return a curve of finite floats: points that are none are left out.

    Raises:
        ValueError: if lengths differ, or a value is no number.
    """
    rows = [np.asarray(values, dtype=float) for values in (x, y, *between) if np.size(values)]
    if any(row.ndim != 1 or len(row) != len(rows[0]) for row in rows) or len(rows) not in (0, 2, 4):
        raise ValueError(f"x, y: expected rows of one length, got {[row.shape for row in rows]}")
    if not rows:
        return Series(solver, np.empty(0), np.empty(0), form=form)
    whole = np.isfinite(rows[0]) & np.isfinite(rows[1])
    valid = [row[whole] for row in rows]
    low, high = valid[2:] or ((), ())
    return Series(solver, valid[0], valid[1], low, high, form)


class Axis(NamedTuple):
    """What an axis is called, whether it is logarithmic, and between what it is drawn."""

    label: str = ""
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)


NO_AXIS = Axis()


class Panel(NamedTuple):
    """One of the diagrams of a chart: its title, curves, and a line across (such as a tolerance).

    The label stands at its y axis if that is not the one of the chart.
    """

    title: str
    series: tuple[Series, ...]
    across: float | None = None
    label: str = ""


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels of curves, or of marks in rows that have names.

    Attributes:
        name: the stem of its files.
        title: what it is called.
        shows: what can be read off.
        panels: row by row.
        x, y: its axes, the same for all panels.
        columns: how many panels stand beside each other.
        rows: the names of rows, from above; () if y is a quantity.
        better: whether a curve is better if its values are less or greater.
        entrants: solvers that are always labelled.
        hollow, filled: what the two marks of a span mean.
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
    entrants: frozenset[str] = frozenset()
    hollow: str = ""
    filled: str = ""

    @cached_property
    def solvers(self) -> list[str]:
        """The solvers that are drawn, in the order of the panels."""
        return list(dict.fromkeys(one.solver for panel in self.panels for one in panel.series))

    @cached_property
    def labelled(self) -> list[str]:
        """The solvers that are labelled: all if they are few.

        Otherwise the entrants, the best of ours, the best of all others, and then the best.
        """
        names = self.solvers
        if len(names) <= MOST:
            return names
        cost = self.costs()
        ranked = sorted(names, key=lambda name: cost[name])
        firsts = [name for name in ranked if name in self.entrants]
        for mine in (True, False):
            firsts += [n for n in ranked if is_ours(n) == mine and n not in self.entrants][:1]
        chosen = list(dict.fromkeys([*firsts, *ranked]))[:MOST]
        return [name for name in names if name in chosen]

    @cached_property
    def others(self) -> list[str]:
        """The solvers that are grey."""
        labelled = self.labelled
        return [name for name in self.solvers if name not in labelled]

    @property
    def caption(self) -> str:
        """What can be read off, and who is grey."""
        if not self.others:
            return self.shows
        names = "; ".join(label(name) for name in self.others)
        return f"{self.shows} Grey, named when pointed at: {names}."

    def costs(self) -> dict[str, float]:
        """Return for each solver how far its curve is from the best, the mean over the panels.

        That is the area under the best it has reached so far, on the axes as they are drawn, from 0
        (the best of the panel from the start) to 1 (absent, or the worst throughout).
        """
        total = dict.fromkeys(self.solvers, 0.0)
        for panel in self.panels:
            found = self._areas(panel)
            for name in total:
                total[name] += found.get(name, 1.0)
        return total

    def _areas(self, panel: Panel) -> dict[str, float]:
        if self.rows:
            return self._behind(panel)
        points = {one.solver: self._on_axes(one) for one in panel.series if len(one.x)}
        if not points:
            return {}
        every = np.concatenate(list(points.values()), axis=1)
        low, high = every.min(axis=1), every.max(axis=1)
        size = np.where(high > low, high - low, 1.0)
        places = np.linspace(0.0, 1.0, _PLACES)
        return {
            name: _area((xy - low[:, None]) / size[:, None], places) for name, xy in points.items()
        }

    def _on_axes(self, one: Series) -> Floats:
        """Return the points as they are drawn, a better one below."""
        x, y = (_scaled(v, axis) for v, axis in ((one.x, self.x), (one.y, self.y)))
        valid = np.isfinite(x) & np.isfinite(y)
        return np.stack([x, -y if self.better == GREATER else y])[:, valid]

    def _behind(self, panel: Panel) -> dict[str, float]:
        """Return how far each solver is behind the best of the rows, from 0 to 1, absent ones 1."""
        values = {
            (one.solver, int(row)): _scaled(x, self.x)
            for one in panel.series
            for x, row in zip(one.x, one.y, strict=True)
        }
        costs = {one.solver: 0.0 for one in panel.series}
        for row in range(len(self.rows)):
            here = {name: v for (name, r), v in values.items() if r == row and np.isfinite(v)}
            least, most = min(here.values(), default=0.0), max(here.values(), default=0.0)
            for name in costs:
                size = (most - least) or 1.0
                costs[name] += (here[name] - least) / size if name in here else 1.0
        return {name: float(cost) / max(1, len(self.rows)) for name, cost in costs.items()}


def _scaled(values: Any, axis: Axis) -> Any:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log10(values) if axis.log else np.asarray(values, dtype=float)


def _area(points: Floats, places: Floats) -> float:
    """Return the mean over some places of the least y so far, 1 before the first point."""
    x, y = points
    order = np.argsort(x, kind="stable")
    least = np.minimum.accumulate(y[order])
    reached = np.searchsorted(x[order], places, side="right") - 1
    return float(np.where(reached < 0, 1.0, least[np.maximum(reached, 0)]).mean())


def is_ours(solver: str) -> bool:
    """Return whether a solver is one of the reference."""
    return registry.find(solver).engine.casefold() == registry.PLUMBOB.casefold()


def looks(names: Sequence[str]) -> Mapping[str, Look]:
    """Return how each of a few solvers is drawn, those first that have a style of their own.

    A solver gets the same in every chart, if those beside it leave it free.
    """
    own = [name for name in names if registry.find(name).style is not registry.OTHER]
    found: dict[str, Look] = {}
    for name in (*own, *(name for name in names if name not in own)):
        found[name] = next(look for look in _preferred(name) if look not in found.values())
    return found


def _preferred(name: str) -> tuple[Look, ...]:
    """Return all looks, beginning with that of the solver's own colour, or of its name."""
    colours = [look.colour for look in LOOKS]
    own = registry.find(name).style.colour
    first = colours.index(own) if own in colours else zlib.crc32(name.encode()) % len(LOOKS)
    return LOOKS[first:] + LOOKS[:first]
