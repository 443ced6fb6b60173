"""Medians of the timing: a row for each work, a mark for each that does it."""

import numpy as np

from ...figures.chart import MARKS, Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.layout import Figure
from ...tables.results import Results, by_problem, solvers


def timing(subject: str, unit: str, scale: float, title: str) -> Figure:
    """Return a figure of the medians of one subject: a row for each work, a mark for each doer."""

    def sketch(results: Results) -> Sketch | None:
        records = results.all("timing", subject=subject)
        if not records:
            return None
        rows = by_problem(records)
        works = list(rows)
        marks = tuple(_marks(records, solver, works, scale) for solver in solvers(records))
        return chart_sketch(
            Chart(
                f"timing_{subject}",
                title,
                "Further left is faster. A mark is the median of the rounds, its line goes from "
                "the 10th to the 90th percentile.",
                (Panel("", marks),),
                Axis(f"median [{unit}], log scale", log=True),
                columns=1,
                rows=tuple(of[0].title for of in rows.values()),
                entrants=results.entrants,
            )
        )

    return sketch


def _marks(records: list[Record], solver: str, works: list[str], scale: float) -> Series:
    mine = [record for record in records if record.solver == solver]
    times = np.array([metrics.timing(record.values.seconds)[:3] for record in mine])
    median, low, high = scale * times.T
    y = [works.index(record.problem) for record in mine]
    return series(solver, median, y, (low, high), form=MARKS)


TIMINGS = {
    "kinematics": timing("kinematics", "ns", 1e9, "Time of forward kinematics, for one pose"),
    "ik": timing("ik", "µs", 1e6, "Time of inverse kinematics, for one solve"),
    "cloth": timing("cloth", "µs", 1e6, "Time of a cloth step, for one frame"),
}
