"""Figures as SVG text. They compute nothing: what they draw comes from `metrics` and records.

Colours are tuned for a white page and named in `COLOURS`, so that a page with a dark side can put
its own in their place. Series differ in line style or marker as well as in colour.
"""

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..experiments.cloth.tables import ONE_STEP
from ..experiments.cloth_peers import tables as cloth_peers
from ..experiments.robots import tables as robots
from ..experiments.timing.case import COMPILED, LIMIT, OURS, PLAIN
from ..harness import metrics
from ..harness.record import Record
from .results import Results, label, problems, solvers
from .text import shortened

COLOURS = {
    "ink": "#22272e",
    "faint": "#68717d",
    "rule": "#d5d9df",
    "blue": "#0b62a8",
    "orange": "#c4500c",
    "green": "#0b7a5b",
    "purple": "#8a4a9f",
    "brass": "#96690f",
}
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "plumbob",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelsize": 9,
    "axes.edgecolor": COLOURS["faint"],
    "axes.labelcolor": COLOURS["ink"],
    "axes.titlecolor": COLOURS["ink"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.linewidth": 0.7,
    "grid.color": COLOURS["rule"],
    "grid.linewidth": 0.6,
    "text.color": COLOURS["ink"],
    "xtick.color": COLOURS["faint"],
    "ytick.color": COLOURS["faint"],
    "xtick.labelcolor": COLOURS["ink"],
    "ytick.labelcolor": COLOURS["ink"],
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "mathtext.default": "regular",
}
SERIES: dict[str, tuple[str, Any, str]] = {
    "ccd": ("orange", "-", "o"),
    "fabrik": ("blue", "--", "s"),
    "local_global": ("orange", "-", "o"),
    "newton": ("blue", "--", "s"),
    "chebyshev": ("green", "-.", "^"),
    "lbfgs": ("purple", (0, (1, 1)), "v"),
    "newton_cg": ("brass", (0, (4, 1, 1, 1, 1, 1)), "D"),
    "levenberg_marquardt": ("green", "-.", "^"),
    "damped_least_squares": ("purple", (0, (1, 1)), "v"),
    "jacobian_transpose": ("brass", (0, (4, 1, 1, 1, 1, 1)), "D"),
}
OTHER_SERIES = ("faint", ":", "P")
DOERS = {
    COMPILED: ("blue", "o"),
    PLAIN: ("orange", "D"),
    OURS: ("brass", "v"),
    "Pinocchio": ("green", "s"),
    "MuJoCo": ("purple", "^"),
    LIMIT: ("ink", "|"),
}
OTHER_DOER = ("faint", "P")
# The markers of solvers for cloths, whose names begin with the engine's.
ENGINES = {"Plumbob": "o", "MuJoCo": "s", "Newton": "^"}
WIDTH = 7.4
# Errors beyond this are left out: of a motion that blew up.
MOST_DRAWN = 10.0
PANELS = 3
# Letters of a name in a figure.
LONGEST = 60


class Drawing(NamedTuple):
    """A figure or picture: the stem of its file, what it shows, and the SVG."""

    name: str
    title: str
    shows: str
    svg: str


def written(name: str) -> str:
    """Return a name as matplotlib writes it letter by letter: no formula, no label to be hidden."""
    short = shortened(name, LONGEST).replace("$", r"\$")
    return f" {short}" if short.startswith("_") else short or "–"


def iterations(results: Results) -> Drawing | None:
    """Draw the histograms of iterations, CCD and FABRIK, a panel for each stratum."""
    panels = _ik_panels(results)
    if not panels:
        return None
    edges = np.array([0.5, 1.5, 2.5, 4.5, 8.5, 16.5, 32.5, 64.5, 128.5, 256.5, 512.5, 1000.5])
    with canvas(2.5, len(panels)) as (figure, axes):
        for ax, (problem, records) in zip(axes, panels.items(), strict=True):
            for record in records:
                colour, line, _ = SERIES.get(record.solver, OTHER_SERIES)
                ax.stairs(
                    metrics.counts(record.arrays["iterations"], edges), edges,
                    color=COLOURS[colour], linestyle=line, fill=False, linewidth=1.6,
                    label=written(label(record.solver)),
                )  # fmt: skip
            ax.set(title=written(label(problem)), xscale="log", xlabel="iterations, log scale")
            _plain_powers(ax)
        axes[0].set_ylabel("targets")
        axes[0].legend(loc="upper right")
        return finished(
            figure, "iterations", "Iterations of every solver",
            "How many of the targets took how many iterations, in classes of doubling width; the "
            "last class holds those that used all.",
        )  # fmt: skip


def ik_residuals(results: Results) -> Drawing | None:
    """Draw the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = _ik_panels(results)
    if not panels:
        return None
    with canvas(2.7, len(panels), sharey=True) as (figure, axes):
        for ax, (problem, records) in zip(axes, panels.items(), strict=True):
            for record in records:
                colour, line, _ = SERIES.get(record.solver, OTHER_SERIES)
                low, median, high = (
                    record.arrays[f"history_{name}"] for name in ("low", "median", "high")
                )
                k = np.arange(len(median))
                ax.fill_between(k, low, high, color=COLOURS[colour], alpha=0.15, linewidth=0)
                shown = {"linestyle": line, "color": COLOURS[colour]}
                ax.plot(k, median, **shown, label=written(label(record.solver)))
                ax.axhline(
                    record.settings["tolerance"],
                    color=COLOURS["faint"],
                    linewidth=0.8,
                    dashes=(2, 2),
                )
            ax.set(title=written(label(problem)), yscale="log", xlabel="iteration", xlim=(0, None))
            ax.minorticks_off()
        axes[0].set_ylabel("residual [m]")
        axes[0].legend(loc="upper right")
        return finished(
            figure, "ik_residuals", "Residual against iteration, inverse kinematics",
            "Line: the median target; band: from the 10th to the 90th percentile; dotted: the "
            "tolerance, at which a target is done and keeps its residual.",
        )  # fmt: skip


def jitter(results: Results) -> Drawing | None:
    """Draw the largest turn of a joint on each curve, from rest and from the last solution."""
    records = results.all("arm", warm=False)
    if not records:
        return None
    curves, names = problems(records), solvers(records)
    height = 0.32 * len(curves) + 1.1 + _legend_height(names, 1)
    with canvas(height, 1) as (figure, axes):
        for record in records:
            colour, _, marker = SERIES.get(record.solver, OTHER_SERIES)
            y = curves.index(record.problem) + _aside(record.solver, names)
            warm = results.one("arm", record.problem, record.solver, warm=True)
            ends = [_largest_turn(r) for r in (record, warm) if r is not None]
            axes[0].plot(ends, [y] * len(ends), color=COLOURS[colour], linewidth=0.9, alpha=0.6)
            for x, filled in zip(ends, ("none", COLOURS[colour]), strict=False):
                axes[0].plot(
                    x, y, marker, color=COLOURS[colour], markerfacecolor=filled, markersize=5.5,
                    linestyle="none", label=_once(axes[0], written(label(record.solver)), filled),
                )  # fmt: skip
        axes[0].set_yticks(range(len(curves)), _ticks(curves))
        axes[0].set(xscale="log", xlabel="largest turn of a joint between frames [°], log scale")
        axes[0].invert_yaxis()
        _plain_powers(axes[0])
        figure.legend(loc="outside upper right", ncols=2)
        return finished(
            figure, "jitter", "Largest turn of a joint between neighbouring frames",
            "Hollow: every frame solved from the rest pose; filled: every frame started from the "
            "last solution.",
        )  # fmt: skip


def cloth_convergence(results: Results) -> Drawing | None:
    """Draw residual and error against the iteration of one step, a column for each stiffness."""
    records = [r for r in results.all("cloth") if r.problem.endswith(ONE_STEP)]
    if not records:
        return None
    names = problems(records)
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    with canvas(4.6, len(names), rows=2, sharex=True, sharey=True) as (figure, axes):
        for i, (quantity, ylabel) in enumerate(rows.items()):
            for j, problem in enumerate(names):
                ax = axes[i * len(names) + j]
                for record in (r for r in records if r.problem == problem):
                    colour, line, _ = SERIES.get(record.solver, OTHER_SERIES)
                    values = record.arrays[quantity]
                    shown = {"linestyle": line, "color": COLOURS[colour]}
                    k = np.arange(1, len(values))
                    ax.plot(k, values[1:], **shown, label=written(label(record.solver)))
                ax.set(xscale="log", yscale="log", ylim=(1e-14, 2))
                _plain_powers(ax)
            axes[i * len(names)].set_ylabel(ylabel)
        for ax, problem in zip(axes, names, strict=False):
            ax.set_title(written(label(problem.removesuffix(ONE_STEP))))
        for ax in axes[len(names) :]:
            ax.set_xlabel("iteration, log scale")
        axes[0].legend(loc="upper right")
        return finished(
            figure, "cloth_convergence", "Convergence of one implicit Euler step",
            "Above the residual, below the error to the converged step; both are 1 at the start. "
            "Lines end in rounding.",
        )  # fmt: skip


def energy(results: Results) -> Drawing | None:
    """Draw the energy that each integrator leaves against the time, without dampers and with."""
    records = results.all("energy")
    if not records:
        return None
    names, shown = problems(records), solvers(records)
    with canvas(3.2 + _legend_height(shown, 3), len(names), sharey=True) as (figure, axes):
        for ax, problem in zip(axes, names, strict=True):
            for record in (r for r in records if r.problem == problem):
                style = _style(shown.index(record.solver))
                ax.plot(
                    record.arrays["time"], record.arrays["left"],
                    label=written(label(record.solver)), **style,
                )  # fmt: skip
            ax.set(
                title=written(label(problem.removeprefix("swing/"))),
                xlabel="time [s]",
                xlim=(0, None),
            )
        axes[0].set(ylabel="energy above rest, of the start", ylim=(0, None))
        figure.legend(*_every_handle(axes), loc="outside lower left", ncols=3)
        return finished(
            figure, "energy", "Energy of a swinging cloth by integrator",
            "Without dampers all energy should stay. Lines that cover each other are the same "
            "method.",
        )  # fmt: skip


def timing(
    subject: str, unit: str, scale: float, title: str
) -> Callable[[Results], Drawing | None]:
    """Return a figure of the medians of one subject: a row for each work, a mark for each doer."""

    def draw(results: Results) -> Drawing | None:
        records = results.all("timing", f"{subject}/")
        if not records:
            return None
        works = problems(records)
        height = 0.27 * len(works) + 1.2 + _legend_height(solvers(records), 3)
        with canvas(height, 1) as (figure, axes):
            _timing_marks(axes[0], records, works, scale)
            axes[0].set_yticks(range(len(works)), _ticks(works))
            axes[0].set(xscale="log", xlabel=f"median [{unit}], log scale")
            axes[0].set_ylim(-0.6, len(works) - 0.4)
            _plain_powers(axes[0])
            axes[0].invert_yaxis()
            figure.legend(loc="outside upper right", ncols=3)
            return finished(
                figure, f"timing_{subject}", title,
                "Further left is faster; each line of the grid is ten times the one before.",
            )  # fmt: skip

    return draw


def _timing_marks(ax: Axes, records: list[Record], works: list[str], scale: float) -> None:
    known = [solver for solver in DOERS if solver in solvers(records)]
    for solver in [*known, *(name for name in solvers(records) if name not in DOERS)]:
        colour, marker = DOERS.get(solver, OTHER_DOER)
        mine = [record for record in records if record.solver == solver]
        ax.plot(
            [scale * metrics.timing(record.arrays["seconds"]).median for record in mine],
            [works.index(record.problem) for record in mine],
            marker, markersize=11 if solver == LIMIT else 5.5, markeredgewidth=1.4,
            color=COLOURS[colour], markerfacecolor="none" if solver == PLAIN else None,
            linestyle="none", label=written(solver),
        )  # fmt: skip


def robot_curves(
    name: str,
    kind: str,
    titles: tuple[str, str, str],
    curves: Callable[[list[Record], np.ndarray], dict[str, dict[str, np.ndarray]]],
    along: np.ndarray,
) -> Callable[[Results], Drawing | None]:
    """Return what draws a share for each solver along an axis, a panel for each robot.

    The titles are those of the figure, of the axis, and what it shows.
    """

    def draw(results: Results) -> Drawing | None:
        panels = curves(robots.records_of(results, kind), along)
        if not panels:
            return None
        names = list(dict.fromkeys(solver for panel in panels.values() for solver in panel))
        rows = -(-len(panels) // PANELS)
        with canvas(2.4 * rows + 0.22 * len(names), PANELS, rows, sharey=True) as (figure, axes):
            for ax, (robot, panel) in zip(axes, panels.items(), strict=False):
                for solver, shares in panel.items():
                    ax.plot(
                        along, 100 * shares, label=written(solver), **_style(names.index(solver))
                    )
                ax.set(title=written(robot), xscale="log", xlabel=titles[1], ylim=(-3, 103))
                ax.minorticks_off()
            for ax in axes[len(panels) :]:
                ax.remove()
            axes[0].set_ylabel("targets [%]")
            figure.legend(*_every_handle(axes[: len(panels)]), loc="outside lower left", ncols=2)
            return finished(figure, name, titles[0], titles[2])

    return draw


def _every_handle(axes: list[Axes]) -> tuple[list[Any], list[str]]:
    """Return a handle and its label for each solver that is in any panel."""
    found: dict[str, Any] = {}
    for ax in axes:
        found |= {
            name: handle for handle, name in zip(*ax.get_legend_handles_labels(), strict=True)
        }
    return list(found.values()), list(found)


def _style(i: int) -> dict[str, Any]:
    """Return a colour and a line for the i-th of many solvers; all pairs differ for a while."""
    colours = ("blue", "orange", "green", "purple", "brass", "ink")
    lines = ("-", "--", "-.", ":")
    return {"color": COLOURS[colours[i % len(colours)]], "linestyle": lines[i % len(lines)]}


def _budget_curves(records: list[Record], along: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    panels: dict[str, dict[str, np.ndarray]] = {}
    for record in robots.measured(records):
        panel = panels.setdefault(robots.robot_of(record), {})
        panel[record.solver] = robots.budget_curve(record, along)
    return panels


def work_precision(
    name: str, family: str, error: str, titles: tuple[str, str, str]
) -> Callable[[Results], Drawing | None]:
    """Return what draws an error against the time for a frame: a curve for each solver.

    A column for each stiffness, a row for each size. The titles are those of the figure, of the
    error's axis, and what it shows.
    """

    def draw(results: Results) -> Drawing | None:
        found = [p for p in cloth_peers.points(results, family) if _can_be_drawn(p, error)]
        if not found:
            return None
        stiffnesses, sizes = (
            sorted({p.stiffness for p in found}),
            sorted({p.particles for p in found}),
        )
        names = list(dict.fromkeys(p.solver for p in found))
        height = 2.3 * len(sizes) + 0.2 * len(names)
        with canvas(height, len(stiffnesses), len(sizes), sharex=True, sharey=True) as (
            figure, axes,
        ):  # fmt: skip
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
            figure.legend(*_every_handle(axes), loc="outside lower left", ncols=2)
            return finished(figure, name, titles[0], titles[2])

    return draw


def _work_precision_curves(
    ax: Axes, found: list[cloth_peers.Point], names: list[str], error: str
) -> None:
    for solver in dict.fromkeys(p.solver for p in found):
        mine = [p for p in found if p.solver == solver]
        ax.plot(
            [1e3 * p.values["seconds"] for p in mine], [p.values[error] for p in mine],
            marker=ENGINES.get(solver.partition(" ")[0], OTHER_SERIES[2]), markersize=3.5,
            label=written(solver), **_style(names.index(solver)),
        )  # fmt: skip


def _can_be_drawn(point: cloth_peers.Point, error: str) -> bool:
    """Return whether a point has got to its end and lies within what anyone wants to see."""
    whole = "wanted" not in point.values or cloth_peers.is_whole(point)
    return whole and point.values["seconds"] > 0 and 0 < point.values[error] < MOST_DRAWN


@contextlib.contextmanager
def canvas(
    height: float, columns: int, rows: int = 1, *, sharex: bool = False, sharey: bool = False
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure [inch high] in the common style and its axes, row by row."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
        yield figure, list(axes.ravel())


def finished(figure: Figure, name: str, title: str, shows: str) -> Drawing:
    """Return the figure as a drawing, the same for the same figure."""
    text = io.StringIO()
    with warnings.catch_warnings():  # the page's fonts have all letters, and names may be many
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Title": title})
    return Drawing(name, title, shows, text.getvalue())


def _ik_panels(results: Results) -> dict[str, list[Record]]:
    records = [
        r
        for r in results.all("ik", "chain/")
        if "history_median" in r.arrays and "beyond" not in r.problem
    ]
    return {problem: [r for r in records if r.problem == problem] for problem in problems(records)}


def _largest_turn(record: Record) -> float:
    return metrics.degrees(metrics.spread(record.arrays["largest_turn"]).largest)


def _legend_height(names: list[str], columns: int) -> float:
    """Return how much higher [inch] a figure is for a legend of more than two rows."""
    return 0.2 * max(0, -(-len(names) // columns) - 2)


def _ticks(works: list[str]) -> list[str]:
    return [written(label(work.partition("/")[2])) for work in works]


def _aside(solver: str, names: list[str]) -> float:
    """Return how far from the middle of its row a solver is drawn, so that none covers another."""
    return 0.6 * ((names.index(solver) + 0.5) / len(names) - 0.5)


def _once(ax: Axes, solver: str, filled: str) -> str | None:
    name = f"{solver}, {'from rest' if filled == 'none' else 'from the last solution'}"
    return None if name in ax.get_legend_handles_labels()[1] else name


def _plain_powers(ax: Axes) -> None:
    """Write 1, 10, 1,000 in place of powers on a logarithmic axis, without minor ticks."""
    ax.xaxis.set_major_formatter(mpl.ticker.FuncFormatter(_plain))
    ax.minorticks_off()


def _plain(x: float, _: int) -> str:
    return f"{x:,.0f}" if x >= 1 else f"{x:g}"


FIGURES: tuple[Callable[[Results], Drawing | None], ...] = (
    iterations,
    ik_residuals,
    jitter,
    cloth_convergence,
    energy,
    work_precision(
        "work_precision_step",
        cloth_peers.ONE_STEP,
        "error",
        (
            "Work and precision in one step",
            "error |x − x*| / |y − x*|",
            "What is left of the error to the converged step of implicit Euler.",
        ),
    ),
    work_precision(
        "work_precision_implicit",
        cloth_peers.MOTION,
        "implicit",
        (
            "Work and precision, to implicit Euler",
            "rms distance [m]",
            "Distance to converged implicit Euler after the last frame; motions that diverged or "
            "ran out of time are left out.",
        ),
    ),
    work_precision(
        "work_precision_truth",
        cloth_peers.MOTION,
        "true",
        (
            "Work and precision, to the truth",
            "rms distance [m]",
            "Distance to the motion itself after the last frame; motions that diverged or ran out "
            "of time are left out.",
        ),
    ),
    timing("kinematics", "ns", 1e9, "Time of forward kinematics, for one pose"),
    timing("ik", "µs", 1e6, "Time of inverse kinematics, for one solve"),
    timing("cloth", "µs", 1e6, "Time of a cloth step, for one frame"),
    *(
        robot_curves(
            f"budget_{end}",
            kind,
            (
                f"Robots, {kind}: targets solved within a time",
                "time for each target [s]",
                "Share of the targets within reach that are solved within so much time for each.",
            ),
            _budget_curves,
            np.logspace(-6, 0, 121),
        )
        for kind, end in robots.KINDS.items()
    ),
    *(
        robot_curves(
            f"profile_{end}",
            kind,
            (
                f"Robots, {kind}: performance profiles",
                "times the fastest on a target",
                "Share of the targets that a solver solves within so many times the time of the "
                "fastest on that target; where a line ends is what it solves at all.",
            ),
            robots.profiles,
            np.logspace(0, 4, 121),
        )
        for kind, end in robots.KINDS.items()
    ),
)
