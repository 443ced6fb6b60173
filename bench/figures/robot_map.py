"""Maps of solvers and robots: the share solved and the time of each, as in the tables."""

import math
from typing import NamedTuple

from ..ranking.scores import PENALTY, STARTS, Score, fields_of
from ..tables.columns import extent_in_words, words_in
from ..tables.results import Results, grouped
from ..tables.table import percent

# The quantities of a map; so many times the shortest time is drawn as the palest.
SOLVED, TIME, SLOWEST = "poses solved", "time", 1000.0
UNITS_OF_MAPS = {
    SOLVED: "targets solved [%]",
    TIME: f"time, geometric mean [µs], {words_in(PENALTY, 'ms')} where not solved",
}


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


def robot_maps(results: Results) -> list[RobotMap]:
    """Return a map for each start with solvers and each quantity, solved targets and time."""
    return [
        _map(start, quantity, fields, results)
        for start in STARTS
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
