"""Shares of targets solved against time and the fastest, and a map of all robots."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...figures.chart import Panel, Series, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...figures.style import COLOURS, plain_label
from ...harness import metrics
from ...harness.metrics import Floats
from ...peers.peer import (
    ONE_START,
    PORTFOLIO_ITERATIONS,
    RESTART_ITERATIONS,
    RESTARTS,
    SHORT_ATTEMPTS,
)
from ...problems.evaluate import AGREEMENT
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Figure
from ...tables.results import Results, grouped
from ...tables.table import words
from . import REPEATS
from .readings import PENALTY, SHIFT, STARTS, Score, fields_of, in_groups, together

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
    repeats=str(REPEATS),
    portfolio=words(PORTFOLIO_ITERATIONS),
    restarts=words(RESTART_ITERATIONS),
    attempts=words(SHORT_ATTEMPTS[0]),
    short=words(SHORT_ATTEMPTS[1]),
)
# The quantities of a map; so many times the shortest time is drawn as the palest.
SOLVED, TIME, SLOWEST = "poses solved", "time", 1000.0
UNITS_OF_MAPS = {SOLVED: "solved [%]", TIME: "median time of a pose solved [µs]"}
# Times of a target within which shares are drawn [s].
_BUDGETS = np.logspace(-6, 0, 121)
# Maps of more robots than this are stacked.
MAXIMUM_BESIDE = 5


def budgets(start: str, results: Results) -> Sketch | None:
    """Return the shares of targets solved within each budget of time."""
    return _chart("budget", _rates_in_time, _BUDGETS, fields_of(results, start), results)


def _rates_in_time(field: Sequence[Score], seconds: Floats) -> list[Floats]:
    return [metrics.within_budget(score.seconds, score.timed_solved, seconds) for score in field]


def group_budgets(start: str, results: Results) -> Sketch | None:
    """Return the same shares over all robots held out, of the solvers that take all."""
    members = in_groups(fields_of(results, start)).get("held out", {})
    scores = together(list(members), members) if len(members) > 1 else []
    fields = {scores[0].robots: scores} if scores else {}
    return _chart("group_budget", _rates_in_time, _BUDGETS, fields, results)


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
    return declared_chart(_declared(name, start), panels, results.entrants)


def _declared(name: str, start: str) -> dict[str, Any]:
    """Return the declared parts of a figure, its name and title with a start."""
    chart = CAPTIONS.figure(name)
    title = f"Robots, {start}: {chart['title']}"
    return {**chart, "name": f"{name}_{start.replace(' ', '_')}", "title": title}


def _share(score: Score, x: Floats, rates: Floats) -> Series:
    """Return a share with its 95 % interval [%]."""
    low, high = metrics.wilson(rates, max(1, len(score.seconds)))
    return series(score.solver, x, 100 * rates, (100 * low, 100 * high))


class MapCell(NamedTuple):
    """A solver on a robot: its text, its shade from 0 (worst) to 100, a star if unranked."""

    text: str
    shade: int
    is_starred: bool = False


class MapRow(NamedTuple):
    """A solver, and its cell for each robot, None where the robot is not taken."""

    solver: str
    is_yours: bool
    cells: list[MapCell | None]


class RobotMap(NamedTuple):
    """Solvers of a start and robots, by group with their number; the best solver first."""

    start: str
    quantity: str
    groups: list[tuple[str, int]]
    robots: list[str]
    rows: list[MapRow]

    @property
    def first_columns(self) -> list[int]:
        """The index of the first robot of each group."""
        return [sum(count for _, count in self.groups[:i]) for i in range(len(self.groups))]

    @property
    def has_stars(self) -> bool:
        """Whether a solver is not ranked on some robot."""
        return any(cell.is_starred for row in self.rows for cell in row.cells if cell)


def robot_maps(results: Results, *starts: str) -> list[RobotMap]:
    """Return a map of each start and quantity, as far as there are solvers."""
    return [
        _map(start, quantity, fields, results)
        for start in starts or STARTS
        if (fields := fields_of(results, start))
        for quantity in (SOLVED, TIME)
    ]


def _map(start: str, quantity: str, fields: dict[str, list[Score]], results: Results) -> RobotMap:
    by_group = grouped(fields, lambda robot: fields[robot][0].group)
    robots = [robot for members in by_group.values() for robot in members]
    scores = {(s.solver, robot): s for robot in robots for s in fields[robot]}
    cell = _solved_cell if quantity == SOLVED else _time_cell
    rows = []
    for solver in dict.fromkeys(solver for solver, _ in scores):
        pairs = (scores.get((solver, robot)) for robot in robots)
        cells = [score and cell(score, fields[score.robots]) for score in pairs]
        rows.append(MapRow(solver, solver in results.entrants, cells))
    rows.sort(key=lambda row: -sum(cell.shade for cell in row.cells if cell))
    groups = [(group, len(members)) for group, members in by_group.items()]
    return RobotMap(start, quantity, groups, robots, rows)


def _solved_cell(score: Score, field: Sequence[Score]) -> MapCell:
    rate = score.share.hits / max(score.share.total, 1)
    return _cell(score, f"{math.floor(100 * rate)}", rate)


def _time_cell(score: Score, field: Sequence[Score]) -> MapCell:
    seconds = score.median_time
    if math.isnan(seconds):
        return MapCell("–", 0)
    ratio = seconds / np.nanmin([other.median_time for other in field])
    size, unit = (1e6 * seconds, "") if seconds < 999.5e-6 else (1e3 * seconds, "k")
    text = f"{size:.{1 if size < 9.95 else 0}f}{unit}"
    return _cell(score, text, 1.0 - math.log(ratio) / math.log(SLOWEST))


def _cell(score: Score, text: str, shade: float) -> MapCell:
    return MapCell(text, round(100 * min(1.0, max(0.0, shade))), not score.is_ranked)


def heat_map(start: str, results: Results) -> Sketch | None:
    """Return both maps for a start beside each other; None without solvers."""
    maps = robot_maps(results, start)
    chart = _declared("robots_map", start)
    return Sketch(**chart, data=maps, draw=draw_maps) if maps else None


def draw_maps(maps: Sequence[RobotMap]) -> "Canvas":
    """Return maps of the same solvers as a figure of matplotlib's, in the order of the first."""
    from ...figures.canvas import canvas

    solvers, robots = [row.solver for row in maps[0].rows], maps[0].robots
    rows = 1 if len(robots) <= MAXIMUM_BESIDE else len(maps)
    figure, axes = canvas(rows * (1.3 + 0.27 * len(solvers)), len(maps) // rows, rows, sharey=True)
    for ax, robot_map in zip(axes, maps, strict=True):
        cells = {row.solver: row.cells for row in robot_map.rows}
        _draw_map(ax, [cells[solver] for solver in solvers], robots)
        ax.set_title(UNITS_OF_MAPS[robot_map.quantity])
    axes[0].set_yticks(range(len(solvers)), [plain_label(solver) for solver in solvers])
    axes[0].invert_yaxis()
    return figure


def _draw_map(ax: "Axes", rows: Sequence[Sequence[MapCell | None]], robots: Sequence[str]) -> None:
    cells = ((i, j, *cell) for i, row in enumerate(rows) for j, cell in enumerate(row) if cell)
    for i, j, text, shade, is_starred in cells:
        alpha = 0.06 + 0.005 * shade
        ax.barh(i, 0.96, 0.92, j - 0.48, color=COLOURS["blue"], alpha=alpha, linewidth=0)
        ax.text(j, i, text + "*" * is_starred, ha="center", va="center", fontsize=8)
    ax.set(xlim=(-0.5, len(robots) - 0.5), ylim=(-0.5, len(rows) - 0.5))
    names = [plain_label(robot) for robot in robots]
    ax.set_xticks(range(len(robots)), names, rotation=25, ha="right", rotation_mode="anchor")
    ax.tick_params(length=0)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)


# Portfolios have no charts of each robot: the page would be half as large again.
FIGURES: tuple[Figure, ...] = (
    *(partial(draw, start) for draw in (group_budgets, heat_map) for start in STARTS),
    *(
        partial(draw, start)
        for draw in (budgets, performance_profiles)
        for start in (ONE_START, RESTARTS)
    ),
)
