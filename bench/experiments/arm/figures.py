"""The largest rotation of a joint between frames, on every curve."""

from ...figures.chart import SPAN, Axis, Chart, Panel, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, by_problem
from ...tables.table import in_unit
from . import CURVE


def jitter(results: Results) -> Sketch | None:
    """Show the largest rotation of a joint on each curve, from rest and from the last solution."""
    records = results.all("arm", task=CURVE, warm=False)
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
            rows=tuple(str(of[0].facts["curve"]) for of in rows.values()),
            entrants=results.entrants,
            hollow="from rest",
            filled="from the last solution",
        )
    )


def _largest_angle(record: Record) -> float:
    return in_unit(metrics.spread(record.arrays["largest_angle"]).largest, "°")
