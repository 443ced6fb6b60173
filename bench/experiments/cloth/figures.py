"""Residual and error of one implicit Euler step, iteration by iteration."""

import numpy as np

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness.record import Record
from ...tables.results import Results, by_problem
from . import ONE_STEP


def cloth_convergence(results: Results) -> Sketch | None:
    """Show residual and error against the iteration of one step, a column for each stiffness."""
    cloths = list(by_problem(results.all("cloth", task=ONE_STEP)).values())
    if not cloths:
        return None
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    panels = [
        Panel(
            f"cloth, {records[0].title}" if quantity == "residual" else "",
            tuple(_iterated(record, quantity) for record in records),
            label=title,
        )
        for quantity, title in rows.items()
        for records in cloths
    ]
    return chart_sketch(
        Chart(
            "cloth_convergence",
            "Convergence of one implicit Euler step",
            "Above the residual, below the error to the converged step; both are 1 at the start. "
            "Lines end in rounding.",
            tuple(panels),
            Axis("iteration, log scale", log=True),
            Axis(log=True, limits=(1e-14, 2)),
            columns=len(cloths),
            entrants=results.entrants,
        )
    )


def _iterated(record: Record, quantity: str) -> Series:
    values = getattr(record.values, quantity)[1:]
    return series(record.solver, np.arange(1, 1 + len(values)), values)
