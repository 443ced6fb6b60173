"""Medians of the timing: a row for each work, a mark for each that does it."""

from typing import Any

from matplotlib.axes import Axes

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.figures import (
    COLOURS,
    Drawing,
    canvas,
    finished,
    legend_height,
    plain_powers,
    written,
)
from ...presentation.layout import Figure
from ...presentation.results import Results, by_problem, solvers


def timing(subject: str, unit: str, scale: float, title: str) -> Figure:
    """Return a figure of the medians of one subject: a row for each work, a mark for each doer."""

    def draw(results: Results) -> Drawing | None:
        records = results.all("timing", subject=subject)
        if not records:
            return None
        rows = by_problem(records)
        works, labels = list(rows), [written(of[0].title) for of in rows.values()]
        height = 0.27 * len(works) + 1.2 + legend_height(solvers(records), 3)
        with canvas(height, 1) as (figure, axes):
            _timing_marks(axes[0], records, works, scale)
            axes[0].set_yticks(range(len(works)), labels)
            axes[0].set(xscale="log", xlabel=f"median [{unit}], log scale")
            axes[0].set_ylim(-0.6, len(works) - 0.4)
            plain_powers(axes[0])
            axes[0].invert_yaxis()
            figure.legend(loc="outside upper right", ncols=3)
            return finished(
                figure,
                f"timing_{subject}",
                title,
                "Further left is faster; each line of the grid is ten times the one before.",
            )

    return draw


def _timing_marks(ax: Axes, records: list[Record], works: list[str], scale: float) -> None:
    timed = [solver.name for solver in registry.TIMED]
    known = [solver for solver in timed if solver in solvers(records)]
    for solver in [*known, *(name for name in solvers(records) if name not in timed)]:
        colour, _, marker = registry.find(solver).style
        filled = "none" if solver == registry.PLAIN.name else None
        mine = [record for record in records if record.solver == solver]
        style: dict[str, Any] = {"color": COLOURS[colour], "markerfacecolor": filled}
        style |= {"linestyle": "none", "markeredgewidth": 1.4, "label": written(solver)}
        size = 11 if solver == registry.LIMIT.name else 5.5
        x = [scale * metrics.timing(record.arrays["seconds"]).median for record in mine]
        y = [works.index(record.problem) for record in mine]
        ax.plot(x, y, marker, markersize=size, **style)


TIMINGS = {
    "kinematics": timing("kinematics", "ns", 1e9, "Time of forward kinematics, for one pose"),
    "ik": timing("ik", "µs", 1e6, "Time of inverse kinematics, for one solve"),
    "cloth": timing("cloth", "µs", 1e6, "Time of a cloth step, for one frame"),
}
