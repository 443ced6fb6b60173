"""Shares of the targets that solvers solve, against time and against the fastest."""

from collections.abc import Callable

import numpy as np

from ...harness.record import Record
from ...presentation.figures import Drawing, canvas, every_handle, finished, nth_style, written
from ...presentation.layout import Figure
from ...presentation.results import Results
from . import readings

PANELS = 3


def robot_curves(
    name: str,
    kind: str,
    titles: tuple[str, str, str],
    curves: Callable[[list[Record], np.ndarray], dict[str, dict[str, np.ndarray]]],
    along: np.ndarray,
) -> Figure:
    """Return what draws a share for each solver along an axis, a panel for each robot.

    The titles are those of the figure, of the axis, and what it shows.
    """

    def draw(results: Results) -> Drawing | None:
        panels = curves(readings.records_of(results, kind), along)
        if not panels:
            return None
        names = list(dict.fromkeys(solver for panel in panels.values() for solver in panel))
        rows = -(-len(panels) // PANELS)
        with canvas(2.4 * rows + 0.22 * len(names), PANELS, rows, sharey=True) as (figure, axes):
            for ax, (robot, panel) in zip(axes, panels.items(), strict=False):
                for solver, shares in panel.items():
                    ax.plot(
                        along, 100 * shares, label=written(solver), **nth_style(names.index(solver))
                    )
                ax.set(title=written(robot), xscale="log", xlabel=titles[1], ylim=(-3, 103))
                ax.minorticks_off()
            for ax in axes[len(panels) :]:
                ax.remove()
            axes[0].set_ylabel("targets [%]")
            figure.legend(*every_handle(axes[: len(panels)]), loc="outside lower left", ncols=2)
            return finished(figure, name, titles[0], titles[2])

    return draw


def budgets(kind: str) -> Figure:
    """Return the figure of the targets solved within a time, by solvers of one kind."""
    return robot_curves(
        f"budget_{readings.KINDS[kind]}",
        kind,
        (
            f"Robots, {kind}: targets solved within a time",
            "time for each target [s]",
            "Share of the targets within reach that are solved within so much time for each.",
        ),
        readings.budget_curves,
        np.logspace(-6, 0, 121),
    )


def profiles(kind: str) -> Figure:
    """Return the figure of performance profiles of solvers of one kind."""
    return robot_curves(
        f"profile_{readings.KINDS[kind]}",
        kind,
        (
            f"Robots, {kind}: performance profiles",
            "times the fastest on a target",
            "Share of the targets that a solver solves within so many times the time of the "
            "fastest on that target; where a line ends is what it solves at all.",
        ),
        readings.profiles,
        np.logspace(0, 4, 121),
    )
