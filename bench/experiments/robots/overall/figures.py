"""A map of solvers and robots: how much each solves, and how far it is from the fastest."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ....figures.sketch import Sketch
from ....figures.style import COLOURS, written
from ....harness.results import Results
from ....tables.layout import Figure
from ..readings import KINDS
from .readings import Line, lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# So many times the least time is drawn as the palest, and the least time as the fullest.
SLOWEST = 1000.0
# Maps of more robots than this stand below each other.
MOST_BESIDE = 5


# What a field is: how full it is drawn, from 0 to 1, and what is written on it.
Field = tuple[float, str]


class Panel(NamedTuple):
    """A map: its title, and a field for each solver and robot, None where it has none."""

    title: str
    fields: tuple[tuple[Field | None, ...], ...]


class Map(NamedTuple):
    """Maps of the same solvers and robots beside each other."""

    solvers: tuple[str, ...]
    robots: tuple[str, ...]
    panels: tuple[Panel, ...]


def heat_map(kind: str) -> Figure:
    """Return the map of solvers of one kind and robots, in two panels."""

    def sketch(results: Results) -> Sketch | None:
        made = lines(results, kind)
        if not made:
            return None
        robots = tuple(dict.fromkeys(robot for line in made for robot in line.records))
        panels = (
            _panel("solved [%]", made, robots, _success),
            _panel("times the least time", made, robots, _slowness),
        )
        return Sketch(
            f"robots_map_{KINDS[kind]}",
            f"Robots, {kind}: who is good at what",
            "Left: targets solved of all given. Right: the geometric mean of times over the "
            "least on that robot, unsolved targets with their penalty. Fuller is better; a star "
            "where a budget of time cut the solver short, no field where it does not take the "
            "robot.",
            Map(tuple(line.solver for line in made), robots, panels),
            draw_map,
        )

    return sketch


def _panel(
    title: str, made: Sequence[Line], robots: Sequence[str],
    read: Callable[[Line, str], Field | None],
) -> Panel:  # fmt: skip
    return Panel(title, tuple(tuple(read(line, robot) for robot in robots) for line in made))


def _success(line: Line, robot: str) -> Field | None:
    share = line.share(robot)
    if share is None:
        return None
    rate = share.hits / max(share.total, 1)
    return rate**2, f"{100 * rate:.3g}{_star(line, robot)}"  # squared, for most rates are near to 1


def _slowness(line: Line, robot: str) -> Field | None:
    ratio = line.times_the_best(robot)
    if ratio is None:
        return None
    fullness = 1.0 - np.log(max(ratio, 1.0)) / np.log(SLOWEST)
    size, unit = (ratio, "") if ratio < 999.5 else (ratio / 1e3, "k")  # as wide as a field
    said = f"{size:.{1 if size < 10 else 0}f}{unit}{_star(line, robot)}"
    return float(np.clip(fullness, 0.0, 1.0)), said


def _star(line: Line, robot: str) -> str:
    return "*" if line.is_cut(robot) else ""


def draw_map(data: Map) -> "Canvas":
    """Return the maps as a figure of matplotlib's."""
    from ....figures.drawing import canvas

    rows = 1 if len(data.robots) <= MOST_BESIDE else len(data.panels)
    height = rows * (1.3 + 0.27 * len(data.solvers))
    figure, axes = canvas(height, len(data.panels) // rows, rows, sharey=True)
    for ax, panel in zip(axes, data.panels, strict=True):
        _draw_panel(ax, panel, data.robots)
    axes[0].set_yticks(range(len(data.solvers)), [written(solver) for solver in data.solvers])
    axes[0].invert_yaxis()
    return figure


def _draw_panel(ax: "Axes", panel: Panel, robots: Sequence[str]) -> None:
    for i, row in enumerate(panel.fields):
        for j, field in enumerate(row):
            if field is not None:
                _draw_field(ax, i, j, field)
    ax.set(title=panel.title, xlim=(-0.5, len(robots) - 0.5), ylim=(-0.5, len(panel.fields) - 0.5))
    names = [written(robot) for robot in robots]
    ax.set_xticks(range(len(robots)), names, rotation=25, ha="right", rotation_mode="anchor")
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for spine in ax.spines.values():
        spine.set_visible(False)


def _draw_field(ax: "Axes", i: int, j: int, field: Field) -> None:
    from matplotlib.patches import Rectangle

    fullness, said = field
    box = Rectangle((j - 0.48, i - 0.46), 0.96, 0.92, color=COLOURS["blue"], linewidth=0)
    box.set_alpha(0.06 + 0.5 * fullness)
    ax.add_patch(box)
    ax.text(j, i, said, ha="center", va="center", fontsize=8)
