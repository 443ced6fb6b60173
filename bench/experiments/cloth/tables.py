"""Convergence of the solvers of an implicit Euler step, and two laws of dampers."""

from collections.abc import Iterator, Sequence

import numpy as np

from ...figures.chart import Panel, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Row
from ...tables.results import (
    Results,
    by_problem,
    counted,
    grouped,
    label,
    listed,
    most_often,
    settings,
)
from ...tables.table import Summary, words
from ..cloth_peers import DECADES, SOLVED
from ..pictures.figures import falling_cloth
from . import DAMPERS, FEW, ONE_STEP

# Iterations after which errors are listed.
LISTED = (1, 10, 100, 1000)
CAPTIONS = Captions(__file__)


def convergence_chart(results: Results) -> Sketch | None:
    """Show residual and error over the iterations of a step, a column for each stiffness."""
    cloths = by_problem(results.all("cloth", task=ONE_STEP)).values()
    rows = {"residual": "residual", "error": "error |x − x*| / |y − x*|"}
    panels = (
        Panel(
            f"cloth, {records[0].title}" if quantity == "residual" else "",
            tuple(
                series(r.solver, np.arange(1, errors.size), errors[1:])
                for r in records
                for errors in [getattr(r.values, quantity)]
            ),
            label=title,
        )
        for quantity, title in rows.items()
        for records in cloths
    )
    chart = CAPTIONS.figure("cloth_convergence")
    return declared_chart(chart, panels, results.entrants, columns=len(cloths))


def _convergence_rows(results: Results) -> list[Row]:
    """Return a row for every solver on every cloth, cloth by cloth."""
    tasks = {ONE_STEP: _one_step, FEW: _few_iterations}
    records = [record for task in tasks for record in results.all("cloth", task=task)]
    rows = []
    for (title, solver), group in grouped(records, lambda r: (r.title, r.solver)).items():
        row: Row = {"cloth": f"lab cloth, {title}", "solver": label(solver), "records": group}
        for record in group:
            row |= tasks[record.measured["task"]](record)
        rows.append(row)
    return [row for cloth in grouped(rows, lambda row: str(row["cloth"])).values() for row in cloth]


def _one_step(record: Record) -> Row:
    errors, residuals = record.values.error, record.values.residual
    counts = [count for count in LISTED if count < errors.size]
    return {
        **{f"error after {words(count)}": errors[count] for count in counts},
        **{f"residual after {words(count)}": residuals[count] for count in counts},
        **{f"iterations to {d}": metrics.first_below(errors, float(d)) for d in DECADES},
        "smallest error": errors.min(),
        "iterations tried": errors.size - 1,
    }


def _few_iterations(record: Record) -> Row:
    steps, title = record.values, _steps_of(record.values.iterations)
    errors, drift = metrics.spread(steps.error), float(steps.drift[-1])
    return {
        f"{title}, median error": errors.median,
        f"{title}, largest error": errors.largest,
        f"{title}, drift": drift,
        f"{title}, drift relative to the path": metrics.ratio(drift, float(steps.path[-1])),
    }


def _steps_of(count: int) -> str:
    return f"steps of {counted(count, 'iteration')}"


def _convergence_summary(rows: Sequence[Row]) -> Summary:
    points = [
        f"{cloth}: {listed([_count(row) for row in of_cloth if row.get('iterations tried')])}"
        for cloth, of_cloth in grouped(rows, lambda row: str(row["cloth"])).items()
    ]
    points += _single_iterations(rows)
    title = f"iterations to {SOLVED}"
    cloths = grouped((row for row in rows if row.get(title)), lambda row: str(row["cloth"]))
    firsts = [min(of_cloth, key=lambda r: r[title])["solver"] for of_cloth in cloths.values()]
    fewest = f"by {most_often(firsts, 'cloth')}" if firsts else "by no solver"
    sentence = f"An error of {SOLVED} is reached in the fewest iterations {fewest}."
    return Summary(sentence, tuple(points))


def _count(row: Row) -> str:
    count = row[f"iterations to {SOLVED}"]
    limit = f"more than {words(row['iterations tried'])}"
    return f"{row['solver']} {limit if count is None else words(count)}"


def _single_iterations(rows: Sequence[Row]) -> Iterator[str]:
    title = _steps_of(1)
    for row in rows:
        if f"{title}, drift" in row:
            steps = [r for r in row["records"] if r.measured["task"] == FEW]
            drift, share = row[f"{title}, drift"], row[f"{title}, drift relative to the path"]
            yield (
                f"{row['cloth']}, {settings(steps, 'steps')} steps of one local/global iteration "
                f"each: a median error of {words_in(row[f'{title}, median error'], '%')}; the "
                f"cloth drifts by {words(drift)} m, {words_in(share, '%')} of its path"
            )


convergence = CAPTIONS.layout(
    "cloth_convergence",
    _convergence_rows,
    _convergence_summary,
    figures=(convergence_chart, falling_cloth),
)


def _damped_steps(results: Results) -> list[Row]:
    """Return a row for every step of every damped cloth, the longest step first."""
    rows: list[Row] = []
    for record in results.all("cloth", task=DAMPERS):
        differences = record.values.difference
        orders = [None, *np.log2(differences[:-1] / differences[1:])]
        for h, difference, order in zip(record.values.h, differences, orders, strict=True):
            row = {"cloth": record.title, "h": float(h), "difference": float(difference)}
            rows.append({**row, "observed order": order, "record": record})
    return rows


def _damper_summary(steps: Sequence[Row]) -> Summary:
    cloths = grouped(steps, lambda step: str(step["cloth"]))
    low, high = (words(end(step["difference"] for step in steps)) for end in (min, max))
    return Summary(
        f"The forces of the two laws differ by {low} to {high} of their size, the less the "
        "shorter the step.",
        tuple(f"{cloth}: {_at(of[0])}, {_at(of[-1])}" for cloth, of in cloths.items()),
    )


def _at(step: Row) -> str:
    return f"{words(step['difference'])} at {words_in(step['h'], 'ms')}"


dampers = CAPTIONS.layout("cloth_dampers", _damped_steps, _damper_summary)

LAYOUTS = (convergence, dampers)
