"""Success and residuals within reach, on the arm's curves and the chain's targets."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import effort, spread_of
from ...tables.layout import Layout
from ...tables.results import Results, by_problem, grouped, leaders
from ...tables.table import Summary, words
from ..chain import BEYOND, CHAIN
from ..chain.tables import histories, quantile_cells, solves_row, within_tolerance
from . import CURVE

STARTS = {None: "random", False: "rest", True: "last solution"}
# The cells of a row by the titles of their columns, and its record.
Row = dict[str, Any]


def _rows(results: Results) -> list[Row]:
    """Return a row for each solver on targets within reach, problem by problem."""
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.details.stratum != BEYOND]
    return [_row(record) for group in by_problem(records).values() for record in group]


def _row(record: Record) -> Row:
    hits = within_tolerance(record)
    return {
        **solves_row(record),
        "start": STARTS[record.details.warm],
        "hits": hits,
        "within tolerance": metrics.share(hits),
        **quantile_cells("residual", spread_of(record, "residual")),
        "time, median": effort(record).median if "seconds" in record.arrays else None,
    }


def _summary(rows: Sequence[Row]) -> Summary:
    hits = {
        solver: {(row["record"].problem, row["start"]): row["hits"] for row in members}
        for solver, members in grouped(rows, lambda row: str(row["solver"])).items()
    }
    ranking = _ranking(hits)
    first = f"; first: {leaders(ranking)}" if ranking else ""
    points = (
        f"{solver}: {words(metrics.share(np.concatenate([*problems.values()])))}"
        for solver, problems in hits.items()
    )
    return Summary(f"Solved within tolerance, over all these problems{first}:", tuple(points))


def _ranking(hits: dict[str, dict[tuple[str, str], np.ndarray]]) -> metrics.Ranking | None:
    """Return a ranking of the solvers that solve all problems, None of fewer than two."""
    sizes = {problem: hit.size for problems in hits.values() for problem, hit in problems.items()}
    complete = {
        solver: np.concatenate([problems[problem] for problem in sizes])
        for solver, problems in hits.items()
        if {problem: hit.size for problem, hit in problems.items()} == sizes
    }
    return metrics.ranking(complete) if len(complete) > 1 else None


def residuals_chart(results: Results) -> Sketch | None:
    """Show the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = tuple(
        Panel(group[0].title, tuple(map(_residuals, group)), group[0].details.tolerance)
        for group in histories(results)
    )
    if not panels:
        return None
    return chart_sketch(
        Chart(
            "ik_residuals",
            "Residual against iteration, inverse kinematics",
            "Line: the median target; band: from the 10th to the 90th percentile; dotted: the "
            "tolerance, at which a target is done and keeps its residual.",
            panels,
            Axis("iteration, log scale", log=True),
            Axis("residual [m]", log=True),
            entrants=results.entrants,
        )
    )


def _residuals(record: Record) -> Series:
    """Return the residuals after each iteration; a logarithmic axis has no iteration 0."""
    solves = record.values
    median, low, high = solves.history_median, solves.history_low, solves.history_high
    return series(record.solver, np.arange(1, len(median)), median[1:], (low[1:], high[1:]))


accuracy = Layout(
    **Captions(__file__).of("accuracy"),
    subjects=_rows,
    summary=_summary,
    figures=(residuals_chart,),
    compared=2,
)

LAYOUTS = (accuracy,)
