"""Shares of targets that solvers solve against time and the fastest, and a map of all robots."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...figures.chart import Panel, Series, declared_chart, series
from ...figures.sketch import Sketch
from ...figures.style import COLOURS, plain_label
from ...harness import metrics
from ...harness.metrics import Floats
from ...problems.evaluate import AGREEMENT
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Figure
from ...tables.results import Results
from ...tables.table import words
from .readings import PENALTY, SHIFT, STARTS, Score, fields_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

CAPTIONS = Captions(
    __file__,
    shift=words_in(SHIFT, "µs"),
    penalty=words_in(PENALTY, "ms"),
    resamples=str(metrics.RESAMPLES),
    limit_tolerance=words(LIMIT_TOLERANCE),
    agreement=words(AGREEMENT),
)
# So many times the least time is drawn as the palest, and the least time as the fullest.
SLOWEST = 1000.0
# Maps of more robots than this are stacked.
MAXIMUM_BESIDE = 5


def budgets(start: str, results: Results) -> Sketch | None:
    """Return the shares of targets that are solved within each budget of time."""

    def rates(field: Sequence[Score], seconds: Floats) -> list[Floats]:
        return [
            metrics.within_budget(score.seconds, score.timed_solved, seconds) for score in field
        ]

    return _chart("budget", rates, np.logspace(-6, 0, 121), fields_of(results, start), results)


def performance_profiles(start: str, results: Results) -> Sketch | None:
    """Return the performance profiles of solvers on the same targets (Dolan and Moré 2002)."""

    def rates(field: Sequence[Score], ratios: Floats) -> list[Floats]:
        if not field:
            return []
        seconds = np.array([score.seconds for score in field])
        solved = np.array([score.timed_solved for score in field])
        return list(metrics.performance_profiles(seconds, solved, ratios))

    fields = {
        robot: [score for score in field if score.has_same_targets]
        for robot, field in fields_of(results, start).items()
    }
    return _chart("profile", rates, np.logspace(0, 4, 121), fields, results)


def _chart(
    name: str,
    rates: Callable[[Sequence[Score], Floats], list[Floats]],
    x: Floats,
    fields: Mapping[str, Sequence[Score]],
    results: Results,
) -> Sketch | None:
    """Return a panel of curves for each robot; None if there are no solvers with this start."""
    panels = []
    for robot, scores in fields.items():
        field = [score for score in scores if score.is_timed and score.is_finished]
        curves = zip(field, rates(field, x), strict=True)
        panels.append(Panel(robot, tuple(_share(score, x, curve) for score, curve in curves)))
    start = next((score.start for field in fields.values() for score in field), "")
    chart = CAPTIONS.figure(name)
    chart["name"] = f"{name}_{start.replace(' ', '_')}"
    chart["title"] = f"Robots, {start}: {chart['title']}"
    return declared_chart(chart, panels, results.entrants)


def _share(score: Score, x: Floats, rates: Floats) -> Series:
    """Return a share with its 95 % interval [%]."""
    low, high = metrics.wilson(rates, max(1, len(score.seconds)))
    return series(score.solver, x, 100 * rates, (100 * low, 100 * high))


# A cell of a map: how full it is drawn, from 0 to 1, and its text.
MapCell = tuple[float, str]


class RobotMaps(NamedTuple):
    """Maps of the same solvers and robots: by title a cell for each, None where it has none."""

    solvers: tuple[str, ...]
    robots: tuple[str, ...]
    panels: dict[str, list[list[MapCell | None]]]


def heat_map(start: str, results: Results) -> Sketch | None:
    """Return the map of solvers of one start and robots, in two panels; None without solvers."""
    fields = fields_of(results, start)
    scores = {(s.solver, robot): s for robot, field in fields.items() for s in field}
    solvers = tuple(dict.fromkeys(solver for solver, _ in scores))

    def panel(read: Callable[[Score], MapCell]) -> list[list[MapCell | None]]:
        rows = ([scores.get((solver, robot)) for robot in fields] for solver in solvers)
        return [[score and read(score) for score in row] for row in rows]

    if not scores:
        return None
    panels = {"solved [%]": panel(_success), "time relative to fastest": panel(_slowness)}
    return Sketch(
        f"robots_map_{start.replace(' ', '_')}",
        f"Robots, {start}: who is good at what",
        "Left: targets solved of all given. Right: the geometric mean of times over the "
        "least on that robot, unsolved targets with their penalty. Fuller is better; a star "
        "where the solver is not ranked, no field where it does not take the "
        "robot.",
        RobotMaps(solvers, tuple(fields), panels),
        draw_map,
    )


def _success(score: Score) -> MapCell:
    rate = score.share.hits / max(score.share.total, 1)
    return rate**2, f"{100 * rate:.3g}{_star(score)}"  # squared, for most rates are near to 1


def _slowness(score: Score) -> MapCell:
    ratio = score.relative_time
    if np.isnan(ratio):
        return 0.0, "–"
    fullness = 1.0 - np.log(max(ratio, 1.0)) / np.log(SLOWEST)
    size, unit = (ratio, "") if ratio < 999.5 else (ratio / 1e3, "k")  # as wide as a cell
    text = f"{size:.{1 if size < 10 else 0}f}{unit}{_star(score)}"
    return float(np.clip(fullness, 0.0, 1.0)), text


def _star(score: Score) -> str:
    return "" if score.is_ranked else "*"


def draw_map(maps: RobotMaps) -> "Canvas":
    """Return the maps as a figure of matplotlib's."""
    from ...figures.drawing import canvas

    rows = 1 if len(maps.robots) <= MAXIMUM_BESIDE else len(maps.panels)
    height = rows * (1.3 + 0.27 * len(maps.solvers))
    figure, axes = canvas(height, len(maps.panels) // rows, rows, sharey=True)
    for ax, (title, cells) in zip(axes, maps.panels.items(), strict=True):
        _draw_panel(ax, title, cells, maps.robots)
    axes[0].set_yticks(range(len(maps.solvers)), [plain_label(solver) for solver in maps.solvers])
    axes[0].invert_yaxis()
    return figure


def _draw_panel(
    ax: "Axes", title: str, rows: Sequence[Sequence[MapCell | None]], robots: Sequence[str]
) -> None:
    cells = ((i, j, *cell) for i, row in enumerate(rows) for j, cell in enumerate(row) if cell)
    for i, j, fullness, text in cells:
        alpha = 0.06 + 0.5 * fullness
        ax.barh(i, 0.96, 0.92, j - 0.48, color=COLOURS["blue"], alpha=alpha, linewidth=0)
        ax.text(j, i, text, ha="center", va="center", fontsize=8)
    ax.set(title=title, xlim=(-0.5, len(robots) - 0.5), ylim=(-0.5, len(rows) - 0.5))
    names = [plain_label(robot) for robot in robots]
    ax.set_xticks(range(len(robots)), names, rotation=25, ha="right", rotation_mode="anchor")
    ax.tick_params(length=0)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


FIGURES: tuple[Figure, ...] = tuple(
    partial(draw, start) for draw in (heat_map, budgets, performance_profiles) for start in STARTS
)
