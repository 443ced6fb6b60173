"""Iterations and residuals of inverse kinematics on the ten-ball chain."""

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...presentation.figures import COLOURS, Drawing, canvas, finished, plain_powers, written
from ...presentation.results import Results, by_problem, label
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
                colour, line, _ = registry.find(record.solver).style
                ax.stairs(
                    metrics.counts(record.arrays["iterations"], edges), edges,
                    color=COLOURS[colour], linestyle=line, fill=False, linewidth=1.6,
                    label=written(label(record.solver)),
                )  # fmt: skip
            ax.set(title=written(records[0].title), xscale="log", xlabel="iterations, log scale")
            plain_powers(ax)
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
        for ax, records in zip(axes, panels, strict=True):
            for record in records:
                colour, line, _ = registry.find(record.solver).style
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
            ax.set(
                title=written(records[0].title), yscale="log", xlabel="iteration", xlim=(0, None)
            )
            ax.minorticks_off()
        axes[0].set_ylabel("residual [m]")
        axes[0].legend(loc="upper right")
        return finished(
            figure, "ik_residuals", "Residual against iteration, inverse kinematics",
            "Line: the median target; band: from the 10th to the 90th percentile; dotted: the "
            "tolerance, at which a target is done and keeps its residual.",
        )  # fmt: skip


def _ik_panels(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [
        record for record in results.all("ik", task=CHAIN)
        if "history_median" in record.arrays and record.facts["stratum"] != BEYOND
    ]  # fmt: skip
    return list(by_problem(records).values())
