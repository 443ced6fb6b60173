"""The energy of a swinging cloth by integrator."""

from collections.abc import Sequence

from ...figures.chart import Panel, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Row
from ...tables.results import Results, by_problem, label, settings
from ...tables.table import Summary, words
from . import DAMPINGS, SIZE

LISTED = (100, 1_000, 10_000)
CAPTIONS = Captions(__file__, size=str(SIZE), damping=f"{DAMPINGS['damped']:g}")


def energy_chart(results: Results) -> Sketch | None:
    """Show the energy left by each integrator over time, undamped and damped."""
    panels = (
        Panel(group[0].title, tuple(series(r.solver, r.values.time, r.values.left) for r in group))
        for group in by_problem(results.all("energy")).values()
    )
    return declared_chart(CAPTIONS.figure("energy"), panels, results.entrants)


def _rows(results: Results) -> list[Row]:
    rows = []
    for record in results.all("energy"):
        left, every = record.values.left, record.values.every
        row = {"cloth": record.title, "integrator": label(record.solver), "record": record}
        row |= {"last": float(left[-1]), "maximum": left.max(), "minimum": left.min()}
        counts = [count for count in LISTED if count // every < left.size]
        rows.append(row | {f"left after {words(n)} steps": left[n // every] for n in counts})
    return rows


def _summary(rows: Sequence[Row]) -> Summary:
    undamped = [row for row in rows if row["record"].values.damping == 0.0]
    if not undamped:
        return Summary()
    steps = settings((row["record"] for row in undamped), "steps")
    points = []
    for row in undamped:
        last, low, high = (words_in(float(row[x]), "%") for x in ("last", "minimum", "maximum"))
        points.append(f"{row['integrator']}: {last} (minimum {low}, maximum {high})")
    changes = {abs(float(row["last"]) - 1.0): row["integrator"] for row in undamped}
    return Summary(
        f"Without dampers the energy should stay constant; after {steps} steps "
        f"{changes[min(changes)]} is nearest to that, and {changes[max(changes)]} farthest.",
        tuple(points),
    )


energy = CAPTIONS.layout("energy", _rows, _summary, figures=(energy_chart,))

LAYOUTS = (energy,)
