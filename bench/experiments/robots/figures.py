"""Shares of targets that solvers solve against time and the fastest, and a map of all robots."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...figures.chart import GREATER, Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...figures.style import COLOURS, written
from ...harness import metrics
from ...harness.metrics import Floats
from ...tables.layout import Figure
from ...tables.results import Results
from .readings import STARTS, Score, fields_of, profiles, within_budgets

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# So many times the least time is drawn as the palest, and the least time as the fullest.
SLOWEST = 1000.0
# Maps of more robots than this stand below each other.
MOST_BESIDE = 5


# Shares of targets by solver, at places along an axis.
Curves = Callable[[Sequence[Score], Floats], list[tuple[Score, Floats]]]


def _curves(
    name: str,
    title: str,
    shows: str,
    axis: str,
    read: Curves,
    along: Floats,
    start: str,
    results: Results,
) -> Sketch | None:
    """Return a panel of curves for each robot; None if there are no solvers with this start."""
    panels = tuple(
        Panel(robot, tuple(_share(score, along, rates) for score, rates in read(field, along)))
        for robot, field in fields_of(results, start).items()
    )
    chart = Chart(
        f"{name}_{_stem(start)}",
        f"Robots, {start}: {title}",
        shows,
        panels,
        Axis(axis, log=True),
        Axis("targets [%]", limits=(-3, 103)),
        better=GREATER,
        entrants=results.entrants,
    )
    return chart_sketch(chart) if panels else None


def _stem(start: str) -> str:
    return start.replace(" ", "_")


def _share(score: Score, along: Floats, rates: Floats) -> Series:
    """Return a share with the interval that holds the true one in 95 % of samples [%]."""
    low, high = metrics.wilson(rates, max(1, score.total))
    return series(score.solver, along, 100 * rates, (100 * low, 100 * high))


budgets = partial(
    _curves,
    "budget",
    "targets solved within a time",
    "Share of the targets within reach that are solved within so much time for each; the "
    "band is the 95 % interval (Wilson).",
    "time for each target [s]",
    within_budgets,
    np.logspace(-6, 0, 121),
)
performance_profiles = partial(
    _curves,
    "profile",
    "performance profiles",
    "Share of the targets that a solver solves within so many times the time of the "
    "fastest on that target (Dolan and Moré 2002); where a line ends is what it solves at all.",
    "times the fastest on a target",
    profiles,
    np.logspace(0, 4, 121),
)


# What a cell of a map is: how full it is drawn, from 0 to 1, and what is written on it.
MapCell = tuple[float, str]


class Map(NamedTuple):
    """Maps of the same solvers and robots: by title a cell for each, None where it has none."""

    solvers: tuple[str, ...]
    robots: tuple[str, ...]
    panels: dict[str, list[list[MapCell | None]]]


def heat_map(start: str, results: Results) -> Sketch | None:
    """Return the map of solvers of one start and robots, in two panels; None if there are none."""
    fields = fields_of(results, start)
    scores = {(s.solver, robot): s for robot, field in fields.items() for s in field}
    solvers = tuple(dict.fromkeys(solver for solver, _ in scores))

    def panel(read: Callable[[Score], MapCell]) -> list[list[MapCell | None]]:
        rows = ([scores.get((solver, robot)) for robot in fields] for solver in solvers)
        return [[score and read(score) for score in row] for row in rows]

    if not scores:
        return None
    return Sketch(
        f"robots_map_{_stem(start)}",
        f"Robots, {start}: who is good at what",
        "Left: targets solved of all given. Right: the geometric mean of times over the "
        "least on that robot, unsolved targets with their penalty. Fuller is better; a star "
        "where a budget of time cut the solver short, no field where it does not take the "
        "robot.",
        Map(
            solvers,
            tuple(fields),
            {"solved [%]": panel(_success), "times the least time": panel(_slowness)},
        ),
        draw_map,
    )


def _success(score: Score) -> MapCell:
    rate = score.share.hits / max(score.share.total, 1)
    return rate**2, f"{100 * rate:.3g}{_star(score)}"  # squared, for most rates are near to 1


def _slowness(score: Score) -> MapCell:
    ratio = score.times_the_least
    fullness = 1.0 - np.log(max(ratio, 1.0)) / np.log(SLOWEST)
    size, unit = (ratio, "") if ratio < 999.5 else (ratio / 1e3, "k")  # as wide as a cell
    text = f"{size:.{1 if size < 10 else 0}f}{unit}{_star(score)}"
    return float(np.clip(fullness, 0.0, 1.0)), text


def _star(score: Score) -> str:
    return "" if score.is_ranked else "*"


def draw_map(data: Map) -> "Canvas":
    """Return the maps as a figure of matplotlib's."""
    from ...figures.drawing import canvas

    rows = 1 if len(data.robots) <= MOST_BESIDE else len(data.panels)
    height = rows * (1.3 + 0.27 * len(data.solvers))
    figure, axes = canvas(height, len(data.panels) // rows, rows, sharey=True)
    for ax, (title, cells) in zip(axes, data.panels.items(), strict=True):
        _draw_panel(ax, title, cells, data.robots)
    axes[0].set_yticks(range(len(data.solvers)), [written(solver) for solver in data.solvers])
    axes[0].invert_yaxis()
    return figure


def _draw_panel(
    ax: "Axes", title: str, rows: Sequence[Sequence[MapCell | None]], robots: Sequence[str]
) -> None:
    for i, row in enumerate(rows):
        for j, cell in enumerate(row):
            if cell is not None:
                _draw_cell(ax, i, j, cell)
    ax.set(title=title, xlim=(-0.5, len(robots) - 0.5), ylim=(-0.5, len(rows) - 0.5))
    names = [written(robot) for robot in robots]
    ax.set_xticks(range(len(robots)), names, rotation=25, ha="right", rotation_mode="anchor")
    ax.tick_params(length=0)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


def _draw_cell(ax: "Axes", i: int, j: int, cell: MapCell) -> None:
    from matplotlib.patches import Rectangle

    fullness, text = cell
    box = Rectangle((j - 0.48, i - 0.46), 0.96, 0.92, color=COLOURS["blue"], linewidth=0)
    box.set_alpha(0.06 + 0.5 * fullness)
    ax.add_patch(box)
    ax.text(j, i, text, ha="center", va="center", fontsize=8)


FIGURES: tuple[Figure, ...] = tuple(
    partial(draw, start) for draw in (heat_map, budgets, performance_profiles) for start in STARTS
)
