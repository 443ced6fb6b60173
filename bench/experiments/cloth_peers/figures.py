"""Work-precision diagrams: the error of every solver against its time for a frame."""

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...tables.layout import Figure
from ...tables.results import Results
from . import MOTION, ONE_STEP
from .readings import Point, points

# Errors beyond this are left out: of a motion that blew up.
MOST_DRAWN = 10.0


def work_precision(name: str, task: str, error: str, titles: tuple[str, str, str]) -> Figure:
    """Return what shows an error against the time for a frame: a curve for each solver.

    A column for each stiffness, a row for each size. The titles are those of the figure, of the
    error's axis, and what it shows.
    """

    def sketch(results: Results) -> Sketch | None:
        found = [p for p in points(results, task) if _can_be_drawn(p, error)]
        if not found:
            return None
        ours = [p for p in found if not p.own]
        stiffnesses = sorted({p.stiffness for p in ours})
        sizes = sorted({p.particles for p in ours})
        panels = tuple(
            Panel(f"{size} × {size}, {stiffness:,.0f} N/m", _curves(here, error))
            for size in sizes
            for stiffness in stiffnesses
            for here in [[p for p in ours if (p.particles, p.stiffness) == (size, stiffness)]]
        )
        panels += tuple(
            Panel(name, _curves([p for p in found if p.own == name], error))
            for name in dict.fromkeys(p.own for p in found if p.own)
        )
        return chart_sketch(
            Chart(
                name,
                titles[0],
                titles[2],
                panels,
                Axis("time for a frame [ms]", log=True),
                Axis(titles[1], log=True),
                columns=len(stiffnesses) or len(panels),
                entrants=results.entrants,
            )
        )

    return sketch


def _curves(found: list[Point], error: str) -> tuple[Series, ...]:
    return tuple(
        series(
            solver,
            [1e3 * p.values["seconds"] for p in found if p.solver == solver],
            [p.values[error] for p in found if p.solver == solver],
        )
        for solver in dict.fromkeys(p.solver for p in found)
    )


def _can_be_drawn(point: Point, error: str) -> bool:
    """Return whether a point has got to its end and lies within what anyone wants to see."""
    whole = "wanted" not in point.values or point.is_whole
    return whole and point.values["seconds"] > 0 and 0 < point.values[error] < MOST_DRAWN


one_step = work_precision(
    "work_precision_step",
    ONE_STEP,
    "error",
    (
        "Work and precision in one step",
        "error |x − x*| / |y − x*|",
        "What is left of the error to the converged step of implicit Euler.",
    ),
)
to_implicit_euler = work_precision(
    "work_precision_implicit",
    MOTION,
    "implicit",
    (
        "Work and precision, to implicit Euler",
        "rms distance [m]",
        "Distance to converged implicit Euler after the last frame; motions that diverged or "
        "ran out of time are left out.",
    ),
)
to_the_truth = work_precision(
    "work_precision_truth",
    MOTION,
    "true",
    (
        "Work and precision, to the truth",
        "rms distance [m]",
        "Distance to the motion itself after the last frame; motions that diverged or ran out "
        "of time are left out.",
    ),
)
