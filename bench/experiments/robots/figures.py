"""Shares of the targets that solvers solve, against time and against the fastest."""

from collections.abc import Callable

import numpy as np

from ...figures.chart import GREATER, Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results
from ...tables.layout import Figure
from . import readings


def robot_curves(
    name: str,
    kind: str,
    titles: tuple[str, str, str],
    curves: Callable[[list[Record], np.ndarray], dict[str, dict[str, np.ndarray]]],
    along: np.ndarray,
) -> Figure:
    """Return what shows a share for each solver along an axis, a panel for each robot.

    The titles are those of the figure, of the axis, and what it shows.
    """

    def sketch(results: Results) -> Sketch | None:
        records = readings.records_of(results, kind)
        panels = curves(records, along)
        if not panels:
            return None
        counts = {(r.title, r.solver): readings.total(r) for r in readings.measured(records)}
        return chart_sketch(
            Chart(
                name,
                titles[0],
                titles[2],
                tuple(
                    Panel(
                        robot,
                        tuple(_share(n, along, y, counts[robot, n]) for n, y in panel.items()),
                    )
                    for robot, panel in panels.items()
                ),
                Axis(titles[1], log=True),
                Axis("targets [%]", limits=(-3, 103)),
                better=GREATER,
                entrants=results.entrants,
            )
        )

    return sketch


def _share(solver: str, along: np.ndarray, rates: np.ndarray, count: int) -> Series:
    """Return a share with the interval that holds the true one in 95 % of samples [%]."""
    low, high = metrics.wilson(rates, max(1, count))
    return series(solver, along, 100 * rates, (100 * low, 100 * high))


def budgets(kind: str) -> Figure:
    """Return the figure of the targets solved within a time, by solvers of one kind."""
    return robot_curves(
        f"budget_{readings.KINDS[kind]}",
        kind,
        (
            f"Robots, {kind}: targets solved within a time",
            "time for each target [s]",
            "Share of the targets within reach that are solved within so much time for each; the "
            "band is the 95 % interval (Wilson).",
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
