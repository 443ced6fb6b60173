"""The energy that every integrator leaves, against the time."""

from ...figures.chart import GREATER, Axis, Chart, Panel, series
from ...figures.sketch import Sketch, chart_sketch
from ...tables.results import Results, by_problem


def energy(results: Results) -> Sketch | None:
    """Show the energy that each integrator leaves against the time, without dampers and with."""
    records = results.all("energy")
    if not records:
        return None
    panels = tuple(
        Panel(
            group[0].title,
            tuple(series(r.solver, r.values.time, r.values.left) for r in group),
        )
        for group in by_problem(records).values()
    )
    return chart_sketch(
        Chart(
            "energy",
            "Energy of a swinging cloth by integrator",
            "Without dampers all energy should stay. Lines that cover each other are the same "
            "method.",
            panels,
            Axis("time [s]", limits=(0, None)),
            Axis("energy above rest, of the start", limits=(0, None)),
            columns=2,
            better=GREATER,
            entrants=results.entrants,
        )
    )
