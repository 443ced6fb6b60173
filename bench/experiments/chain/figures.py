"""Iterations and residuals on the ten-ball chain, and how far joints rotate on every curve."""

import numpy as np

from ...figures.chart import GREATER, SPAN, Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.columns import iterations_said
from ...tables.results import Results, by_problem
from ...tables.table import in_unit
from .. import arm
from . import BEYOND, CHAIN

# Iterations at which targets are counted.
COUNTED = np.unique(np.logspace(0, 3, 61).round())


def iterations(results: Results) -> Sketch | None:
    """Show the share of the targets that is done within so many iterations, stratum by stratum."""
    panels = [counting for of in _ik_panels(results) if (counting := [*filter(_counts, of)])]
    if not panels:
        return None
    return chart_sketch(
        Chart(
            "iterations",
            "Iterations of every solver",
            "How many of the targets are reached within so many iterations; the band is the 95 % "
            "interval (Wilson)." + " Entrants claim their iterations." * bool(results.entrants),
            tuple(Panel(of[0].title, tuple(map(_reached, of))) for of in panels),
            Axis("iterations, log scale", log=True),
            Axis("targets reached [%]", limits=(-3, 103)),
            better=GREATER,
            entrants=results.entrants,
        )
    )


def _counts(record: Record) -> bool:
    """Return whether a solver says its iterations."""
    return bool(iterations_said(record).size)


def _reached(record: Record) -> Series:
    """Return the share of the targets that is reached within each number of iterations [%]."""
    done = record.values.residual <= record.details.tolerance
    taken = record.values.iterations
    shares = [metrics.share(done & (taken <= most)) for most in COUNTED]
    low, high = (100 * np.array([getattr(s, end) for s in shares]) for end in ("low", "high"))
    middle = [100 * share.hits / max(1, share.total) for share in shares]
    return series(record.solver, COUNTED, middle, (low, high))


def ik_residuals(results: Results) -> Sketch | None:
    """Show the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = _ik_panels(results)
    if not panels:
        return None
    return chart_sketch(
        Chart(
            "ik_residuals",
            "Residual against iteration, inverse kinematics",
            "Line: the median target; band: from the 10th to the 90th percentile; dotted: the "
            "tolerance, at which a target is done and keeps its residual.",
            tuple(
                Panel(of[0].title, tuple(map(_residuals, of)), of[0].details.tolerance)
                for of in panels
            ),
            Axis("iteration, log scale", log=True),
            Axis("residual [m]", log=True),
            entrants=results.entrants,
        )
    )


def _residuals(record: Record) -> Series:
    low, median, high = (
        record.values.history_low,
        record.values.history_median,
        record.values.history_high,
    )
    after = slice(1, None)
    k = np.arange(len(median))
    return series(record.solver, k[after], median[after], (low[after], high[after]))


def _ik_panels(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [r for r in results.all("ik", task=CHAIN) if r.details.stratum != BEYOND]
    records = [record for record in records if record.values.history_median is not None]
    return list(by_problem(records).values())


def jitter(results: Results) -> Sketch | None:
    """Show the largest rotation of a joint on each curve, from rest and from the last solution."""
    records = results.all("arm", task=arm.CURVE, warm=False)
    if not records:
        return None
    rows = by_problem(records)
    curves, spans = list(rows), []
    for record in records:
        warm = results.one("arm", record.problem, record.solver, warm=True)
        ends = [_largest_angle(r) for r in (record, warm) if r is not None]
        y = [curves.index(record.problem)] * len(ends)
        spans.append(series(record.solver, ends, y, form=SPAN))
    return chart_sketch(
        Chart(
            "jitter",
            "Largest rotation of a joint between neighbouring frames",
            "Hollow: every frame solved from the rest pose; filled: every frame started from the "
            "last solution.",
            (Panel("", tuple(spans)),),
            Axis("largest rotation of a joint between frames [°], log scale", log=True),
            columns=1,
            rows=tuple(str(of[0].details.curve) for of in rows.values()),
            entrants=results.entrants,
            hollow="from rest",
            filled="from the last solution",
        )
    )


def _largest_angle(record: Record) -> float:
    return in_unit(metrics.spread(record.values.largest_angle).largest, "°")
