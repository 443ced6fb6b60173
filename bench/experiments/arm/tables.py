"""Success and residuals within reach, on the arm's curves and the chain's targets."""

from collections.abc import Sequence

import numpy as np

from ...figures.chart import Panel, Series, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...peers import catalogue
from ...tables.captions import Captions
from ...tables.columns import quantile_cells, spread_of
from ...tables.layout import Row
from ...tables.results import Results, by_problem, grouped, leaders
from ...tables.table import Summary, words
from ..chain import BEYOND, CHAIN
from ..chain.tables import histories, solves_row, within_tolerance
from . import CURVE

STARTS = {None: "random", False: "rest", True: "last solution"}
_CAPTIONS = Captions(__file__)


def _rows(results: Results) -> list[Row]:
    """Return a row for each solver on targets within reach, problem by problem."""
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.values.stratum != BEYOND]
    return [_row(record) for group in by_problem(records).values() for record in group]


def _row(record: Record) -> Row:
    hits, seconds = within_tolerance(record), record.measured.get("seconds")
    return {
        **solves_row(record),
        "start": STARTS[record.values.warm],
        "hits": hits,
        "within tolerance": metrics.share(hits),
        **quantile_cells("residual", spread_of(record, "residual")),
        "time, median": None if seconds is None else float(np.median(seconds)),
    }


def _summary(rows: Sequence[Row]) -> Summary:
    hits = {
        solver: {(row["record"].problem, row["start"]): row["hits"] for row in members}
        for solver, members in grouped(rows, lambda row: str(row["solver"])).items()
    }
    rivals = {solver: hits[solver] for solver in hits if not catalogue.is_loop(solver)}
    ranking = _ranking(rivals)
    first = f"Over all problems most targets are solved by {leaders(ranking)}." if ranking else ""
    points = (
        f"{solver}: {words(metrics.share(np.concatenate([*problems.values()])))}"
        for solver, problems in hits.items()
    )
    unranked = "No two solvers were given all problems, so that none is ranked."
    return Summary(first or unranked, tuple(points))


def _ranking(hits: dict[str, dict[tuple[str, str], np.ndarray]]) -> metrics.Ranking | None:
    """Return a ranking of the solvers that solve all problems, None of fewer than two."""
    sizes: dict[tuple[str, str], int] = {}
    for problem, hit in (item for problems in hits.values() for item in problems.items()):
        sizes[problem] = max(hit.size, sizes.get(problem, 0))
    complete = {
        solver: np.concatenate([problems[problem] for problem in sizes])
        for solver, problems in hits.items()
        if {problem: hit.size for problem, hit in problems.items()} == sizes
    }
    return metrics.ranking(complete) if len(complete) > 1 else None


def residuals_chart(results: Results) -> Sketch | None:
    """Show the residual against the iteration, median and 10 to 90 % of the targets."""
    panels = (
        Panel(group[0].title, tuple(map(_residuals, group)), group[0].values.tolerance)
        for group in histories(results)
    )
    return declared_chart(_CAPTIONS.figure("ik_residuals"), panels, results.entrants)


def _residuals(record: Record) -> Series:
    """Return the residuals after each iteration; a logarithmic axis has no iteration 0."""
    solves = record.values
    median, low, high = solves.history_median, solves.history_low, solves.history_high
    return series(record.solver, np.arange(1, len(median)), median[1:], (low[1:], high[1:]))


accuracy = _CAPTIONS.layout("accuracy", _rows, _summary, figures=(residuals_chart,), compared=2)

LAYOUTS = (accuracy,)
