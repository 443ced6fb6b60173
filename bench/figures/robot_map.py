"""Maps of solvers and robots: the share solved and the time of each, as in the tables."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..ranking.scores import PENALTY, STARTS, Score, fields_of
from ..tables.columns import extent_in_words, words_in
from ..tables.results import Results, grouped
from ..tables.table import percent
from .style import COLOURS, plain_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# The quantities of a map; so many times the shortest time is drawn as the palest.
SOLVED, TIME, SLOWEST = "poses solved", "time", 1000.0
UNITS_OF_MAPS = {
    SOLVED: "targets solved [%]",
    TIME: f"time, geometric mean [µs], {words_in(PENALTY, 'ms')} where not solved",
}
# Maps of more robots than this are stacked.
MAXIMUM_BESIDE = 5


class MapCell(NamedTuple):
    """A solver on a robot: its text, its shade from 0 (worst) to 100, a star if unranked."""

    text: str
    shade: float
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
    sample: str = ""  # the number of targets or timed targets on a robot

    @property
    def caption(self) -> str:
        """What the cells show, with unit and number of targets."""
        return f"{UNITS_OF_MAPS[self.quantity]}, {self.sample}"

    @property
    def first_columns(self) -> list[int]:
        """The index of the first robot of each group."""
        return [sum(count for _, count in self.groups[:i]) for i in range(len(self.groups))]

    @property
    def has_stars(self) -> bool:
        """Whether a solver is not ranked on some robot."""
        return any(cell.is_starred for row in self.rows for cell in row.cells if cell)


def robot_maps(results: Results, *starts: str) -> list[RobotMap]:
    """Return a map for each start with solvers and each quantity, solved targets and time."""
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
        cells = [cell(score) if score else None for score in pairs]
        rows.append(MapRow(solver, solver in results.user_solvers, cells))
    rows.sort(key=lambda row: -sum(cell.shade for cell in row.cells if cell))
    groups = [(group, len(members)) for group, members in by_group.items()]
    sizes = {s.total if quantity == SOLVED else s.seconds.size for s in scores.values()} - {0}
    sample = f"n = {extent_in_words(sizes)} on each robot"
    return RobotMap(start, quantity, groups, robots, rows, sample)


def _solved_cell(score: Score) -> MapCell:
    """Return the share of all targets that are solved, as in the table."""
    hits, total = score.share[:2]
    rate = hits / max(total, 1)
    return _cell(score, percent(rate, total), rate)


def _time_cell(score: Score) -> MapCell:
    """Return the geometric mean of the times, as in the table."""
    seconds = score.mean_time.value
    if math.isnan(seconds):
        return MapCell("–", 0)
    size, unit = (1e6 * seconds, "") if seconds < 999.5e-6 else (1e3 * seconds, "k")
    text = f"{size:.{1 if size < 9.95 else 0}f}{unit}"
    return _cell(score, text, 1.0 - math.log(score.relative_time) / math.log(SLOWEST))


def _cell(score: Score, text: str, shade: float) -> MapCell:
    return MapCell(text, round(100 * min(1.0, max(0.0, shade)), 2), not score.is_ranked)


def draw_maps(maps: Sequence[RobotMap]) -> "Canvas":
    """Return maps of the same solvers as a figure of matplotlib's, in the order of the first."""
    from .canvas import canvas

    solvers, robots = [row.solver for row in maps[0].rows], maps[0].robots
    rows = 1 if len(robots) <= MAXIMUM_BESIDE else len(maps)
    figure, axes = canvas(rows * (1.3 + 0.27 * len(solvers)), len(maps) // rows, rows, sharey=True)
    for ax, robot_map in zip(axes, maps, strict=True):
        cells = {row.solver: row.cells for row in robot_map.rows}
        _draw_map(ax, [cells[solver] for solver in solvers], robots)
        ax.set_title(robot_map.caption)
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
