"""A map of solvers and robots: how much each solves, and how far it is from the fastest."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ....presentation.figures import COLOURS, Drawing, canvas, finished, written
from ....presentation.layout import Figure
from ....presentation.results import Results
from ..readings import KINDS
from .readings import Line, lines

# So many times the least time is drawn as the palest, and the least time as the fullest.
SLOWEST = 1000.0


def heat_map(kind: str) -> Figure:
    """Return the map of solvers of one kind and robots, in two panels."""

    def draw(results: Results) -> Drawing | None:
        made = lines(results, kind)
        if not made:
            return None
        robots = list(dict.fromkeys(robot for line in made for robot in line.records))
        with canvas(1.3 + 0.27 * len(made), 2, sharey=True) as (figure, axes):
            _panel(axes[0], made, robots, "solved [%]", _success)
            _panel(axes[1], made, robots, "times the least time", _slowness)
            axes[0].set_yticks(range(len(made)), [written(line.solver) for line in made])
            axes[0].invert_yaxis()
            return finished(
                figure,
                f"robots_map_{KINDS[kind]}",
                f"Robots, {kind}: who is good at what",
                "Left: targets solved of all given. Right: the geometric mean of times over the "
                "least on that robot, unsolved targets with their penalty. Fuller is better; no "
                "field where a solver does not take the robot.",
            )

    return draw


# What a field is: how full it is drawn, from 0 to 1, and what is written on it.
Field = tuple[float, str]


def _success(line: Line, robot: str) -> Field | None:
    share = line.share(robot)
    if share is None:
        return None
    rate = share.hits / max(share.total, 1)
    return rate**2, f"{100 * rate:.3g}"  # squared, for most rates are near to 1


def _slowness(line: Line, robot: str) -> Field | None:
    ratio = line.times_the_best(robot)
    if ratio is None:
        return None
    fullness = 1.0 - np.log(max(ratio, 1.0)) / np.log(SLOWEST)
    return float(np.clip(fullness, 0.0, 1.0)), f"{ratio:,.{1 if ratio < 10 else 0}f}"


def _panel(
    ax: Axes, made: Sequence[Line], robots: Sequence[str], title: str,
    read: Callable[[Line, str], Field | None],
) -> None:  # fmt: skip
    for i, line in enumerate(made):
        for j, robot in enumerate(robots):
            field = read(line, robot)
            if field is None:
                continue
            fullness, said = field
            box = Rectangle((j - 0.48, i - 0.46), 0.96, 0.92, color=COLOURS["blue"], linewidth=0)
            box.set_alpha(0.06 + 0.5 * fullness)
            ax.add_patch(box)
            ax.text(j, i, said, ha="center", va="center", fontsize=8)
    ax.set(title=title, xlim=(-0.5, len(robots) - 0.5), ylim=(-0.5, len(made) - 0.5))
    names = [written(robot) for robot in robots]
    ax.set_xticks(range(len(robots)), names, rotation=25, ha="right", rotation_mode="anchor")
    ax.tick_params(length=0)
    ax.grid(visible=False)
    for spine in ax.spines.values():
        spine.set_visible(False)
