"""Work-precision diagrams: the error of every solver against its time for a frame."""

from collections.abc import Sequence
from functools import partial

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...tables.results import Results, grouped
from . import MOTION, ONE_STEP
from .readings import Point, points

# Larger errors are those of motions that diverged, and are not drawn.
MAX_ERROR = 10.0


def work_precision(
    name: str, task: str, error: str, titles: tuple[str, str, str], results: Results
) -> Sketch | None:
    """Show an error against the time for a frame: a curve for each solver.

    Each stiffness has a column, each size a row. The titles are those of the figure, of the error's
    axis, and the caption.
    """
    visible = [point for point in points(results, task) if _is_visible(point, error)]
    if not visible:
        return None
    title, label, caption = titles
    cloths = [point for point in visible if not point.own]
    stiffnesses = sorted({point.stiffness for point in cloths})
    panels = [
        Panel(
            f"{size} × {size}, {stiffness:,.0f} N/m",
            _curves([p for p in cloths if (p.particles, p.stiffness) == (size, stiffness)], error),
        )
        for size in sorted({point.particles for point in cloths})
        for stiffness in stiffnesses
    ]
    own = grouped((point for point in visible if point.own), lambda point: point.own)
    panels += [Panel(cloth, _curves(group, error)) for cloth, group in own.items()]
    return chart_sketch(
        Chart(
            name,
            title,
            caption,
            tuple(panels),
            Axis("time for a frame [ms]", log=True),
            Axis(label, log=True),
            columns=len(stiffnesses) or len(panels),
            entrants=results.entrants,
        )
    )


def _curves(visible: Sequence[Point], error: str) -> tuple[Series, ...]:
    return tuple(
        series(solver, [1e3 * p.seconds for p in group], [p.values[error] for p in group])
        for solver, group in grouped(visible, lambda point: point.solver).items()
    )


def _is_visible(point: Point, error: str) -> bool:
    """Return whether a point reached its end, with an error that can be drawn."""
    is_whole = "wanted" not in point.values or point.is_whole
    return is_whole and point.seconds > 0 and 0 < point.values[error] < MAX_ERROR


one_step = partial(
    work_precision,
    "work_precision_step",
    ONE_STEP,
    "error",
    (
        "Work and precision in one step",
        "error |x − x*| / |y − x*|",
        "Error to the converged step of implicit Euler.",
    ),
)
to_implicit_euler = partial(
    work_precision,
    "work_precision_implicit",
    MOTION,
    "implicit",
    (
        "Work and precision, to implicit Euler",
        "rms distance [m]",
        "Distance to converged implicit Euler after the last frame, without motions that diverged "
        "or ran out of time.",
    ),
)
to_the_truth = partial(
    work_precision,
    "work_precision_truth",
    MOTION,
    "true",
    (
        "Work and precision, to the truth",
        "rms distance [m]",
        "Distance to the true motion after the last frame, without motions that diverged or ran "
        "out of time.",
    ),
)
