"""The map of solvers and robots, and the strip of all claims against their tolerances."""

import math
from typing import NamedTuple

from ...experiments.robots.readings import STARTS, Score, fields_of
from ...tables.results import Results, grouped
from ...tables.table import number_of, words
from .page_tables import PageTable

# The quantities of a map; so many times the least time is drawn as the palest.
SOLVED, TIME, SLOWEST = "poses solved", "time", 1000.0
# Decades of the strip of claims, and the width of a dot on it [%].
DECADES, DOT = 8, 1.3


class MapCell(NamedTuple):
    """A solver on a robot: its text, and its shade from 0 (worst) to 100."""

    text: str
    shade: int


class MapRow(NamedTuple):
    """A solver, and its cell for each robot, None where it does not take the robot."""

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


class ClaimDot(NamedTuple):
    """A claim on the strip: its difference over its tolerance, its place [%], and its level."""

    name: str
    used: float
    place: float
    level: int
    address: str


def robot_maps(results: Results) -> list[RobotMap]:
    """Return a map of each start and quantity, as far as there are solvers."""
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
        cells = [score and cell(score) for score in pairs]
        rows.append(MapRow(solver, solver in results.entrants, cells))
    rows.sort(key=lambda row: -sum(cell.shade for cell in row.cells if cell))
    groups = [(group, len(members)) for group, members in by_group.items()]
    return RobotMap(start, quantity, groups, robots, rows)


def _solved_cell(score: Score) -> MapCell:
    rate = score.share.hits / max(score.share.total, 1)
    return _cell(score, f"{math.floor(100 * rate)}", rate)


def _time_cell(score: Score) -> MapCell:
    ratio = score.relative_time
    size, unit = (ratio, "") if ratio < 999.5 else (ratio / 1e3, "k")
    text = f"{size:.{1 if size < 10 else 0}f}{unit}"
    return _cell(score, text, 1.0 - math.log(max(ratio, 1.0)) / math.log(SLOWEST))


def _cell(score: Score, text: str, shade: float) -> MapCell:
    """Return a cell; a star marks a solver that is not ranked."""
    return MapCell(text + "*" * (not score.is_ranked), round(100 * min(1.0, max(0.0, shade))))


def claim_dots(check: PageTable) -> list[ClaimDot]:
    """Return the claims of the cross-check by their differences on a log scale.

    Dots that would touch lie above each other.
    """
    titles = [column.title for column in check.table.columns]
    difference, tolerance = (titles.index(name) for name in ("largest difference", "tolerance"))
    claims = [
        (number_of(row[difference]) / number_of(row[tolerance]), words(row[0]), shown.address)
        for row, shown in zip(check.table.rows, check.rows, strict=True)
    ]
    dots: list[ClaimDot] = []
    ends: list[float] = []  # of the last dot of each level
    for used, name, address in sorted(claims):
        place = 100 * (1 + math.log10(min(max(used, 10.0**-DECADES), 2.0)) / DECADES)
        level = next((i for i, end in enumerate(ends) if end <= place), len(ends))
        ends[level : level + 1] = [place + DOT]
        dots.append(ClaimDot(name, used, place, level, address))
    return dots
