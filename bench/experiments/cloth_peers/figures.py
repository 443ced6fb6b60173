"""Work-precision diagrams: the error of every solver against its time for a frame."""

from matplotlib.axes import Axes

from ...peers import registry
from ...presentation.figures import Drawing, canvas, every_handle, finished, nth_style, written
from ...presentation.layout import Figure
from ...presentation.results import Results
from . import MOTION, ONE_STEP
from .readings import Point, points

# Errors beyond this are left out: of a motion that blew up.
MOST_DRAWN = 10.0


def work_precision(name: str, task: str, error: str, titles: tuple[str, str, str]) -> Figure:
    """Return what draws an error against the time for a frame: a curve for each solver.

    A column for each stiffness, a row for each size. The titles are those of the figure, of the
    error's axis, and what it shows.
    """

    def draw(results: Results) -> Drawing | None:
        found = [p for p in points(results, task) if _can_be_drawn(p, error)]
        if not found:
            return None
        stiffnesses, sizes = (
            sorted({p.stiffness for p in found}),
            sorted({p.particles for p in found}),
        )
        names = list(dict.fromkeys(p.solver for p in found))
        height = 2.3 * len(sizes) + 0.2 * len(names)
        with canvas(height, len(stiffnesses), len(sizes), sharex=True, sharey=True) as (
            figure,
            axes,
        ):
            cells = [(size, stiffness) for size in sizes for stiffness in stiffnesses]
            for ax, (size, stiffness) in zip(axes, cells, strict=True):
                here = [p for p in found if (p.particles, p.stiffness) == (size, stiffness)]
                _work_precision_curves(ax, here, names, error)
                ax.set(xscale="log", yscale="log", title=f"{size} × {size}, {stiffness:,.0f} N/m")
                ax.minorticks_off()
            for ax in axes[-len(stiffnesses) :]:
                ax.set_xlabel("time for a frame [ms]")
            for ax in axes[:: len(stiffnesses)]:
                ax.set_ylabel(titles[1])
            figure.legend(*every_handle(axes), loc="outside lower left", ncols=2)
            return finished(figure, name, titles[0], titles[2])

    return draw


def _work_precision_curves(ax: Axes, found: list[Point], names: list[str], error: str) -> None:
    for solver in dict.fromkeys(p.solver for p in found):
        mine = [p for p in found if p.solver == solver]
        ax.plot(
            [1e3 * p.values["seconds"] for p in mine],
            [p.values[error] for p in mine],
            marker=_marker(solver),
            markersize=3.5,
            label=written(solver),
            **nth_style(names.index(solver)),
        )


def _marker(solver: str) -> str:
    """Return the marker of whose a solver is."""
    return registry.ENGINE_MARKERS.get(registry.find(solver).engine, registry.OTHER.marker)


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
