"""Iterations and residuals of inverse kinematics on the ten-ball chain."""

import numpy as np
from matplotlib.axes import Axes

from ...harness import metrics
from ...harness.record import Record
from ...presentation.figures import (
    COLOURS,
    Drawing,
    canvas,
    drawn_as,
    finished,
    plain_powers,
    written,
)
from ...presentation.results import Results, by_problem
from . import BEYOND, CHAIN


def iterations(results: Results) -> Drawing | None:
    """Draw the histograms of iterations, CCD and FABRIK, a panel for each stratum."""
    panels = _ik_panels(results)
    if not panels:
        return None
    edges = np.array([0.5, 1.5, 2.5, 4.5, 8.5, 16.5, 32.5, 64.5, 128.5, 256.5, 512.5, 1000.5])
    with canvas(2.5, len(panels)) as (figure, axes):
        for ax, records in zip(axes, panels, strict=True):
            for record in records:
                counts = metrics.counts(record.arrays["iterations"], edges)
                ax.stairs(counts, edges, fill=False, linewidth=1.6, **drawn_as(record.solver))
            ax.set(title=written(records[0].title), xscale="log", xlabel="iterations, log scale")
            plain_powers(ax)
        axes[0].set_ylabel("targets")
        axes[0].legend(loc="upper right")
        return finished(
            figure,
            "iterations",
            "Iterations of every solver",
            "How many of the targets took how many iterations, in classes of doubling width; the "
            "last class holds those that used all.",
        )


def ik_residuals(results: Results) -> Drawing | None:
    """Draw the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = _ik_panels(results)
    if not panels:
        return None
    with canvas(2.7, len(panels), sharey=True) as (figure, axes):
        for ax, records in zip(axes, panels, strict=True):
            for record in records:
                _residuals(ax, record)
            ax.set(
                title=written(records[0].title), yscale="log", xlabel="iteration", xlim=(0, None)
            )
            ax.minorticks_off()
        axes[0].set_ylabel("residual [m]")
        axes[0].legend(loc="upper right")
        return finished(
            figure,
            "ik_residuals",
            "Residual against iteration, inverse kinematics",
            "Line: the median target; band: from the 10th to the 90th percentile; dotted: the "
            "tolerance, at which a target is done and keeps its residual.",
        )


def _residuals(ax: Axes, record: Record) -> None:
    style = drawn_as(record.solver)
    low, median, high = (record.arrays[f"history_{name}"] for name in ("low", "median", "high"))
    k = np.arange(len(median))
    ax.fill_between(k, low, high, color=style["color"], alpha=0.15, linewidth=0)
    ax.plot(k, median, **style)
    tolerance = record.settings["tolerance"]
    ax.axhline(tolerance, color=COLOURS["faint"], linewidth=0.8, dashes=(2, 2))


def _ik_panels(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [r for r in results.all("ik", task=CHAIN) if r.facts["stratum"] != BEYOND]
    records = [record for record in records if "history_median" in record.arrays]
    return list(by_problem(records).values())
