"""Targets beyond reach, and the iterations of CCD and FABRIK: two of the lab's questions."""

from collections.abc import Sequence

import numpy as np

from ...figures.chart import Panel, Series, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import (
    quantile_cells,
    reported_iterations,
    spread_of,
    spread_of_iterations,
    words_in,
)
from ...tables.layout import Row
from ...tables.results import Results, by_problem, counted, grouped, label
from ...tables.table import Summary, words
from .. import arm
from . import BEYOND, CHAIN
from .values import ChainSolves

# A chain counts as straight if no joint is off the line by more than this share of the reach.
STRAIGHT = 0.01
# Iterations at which targets are counted.
COUNTED = np.unique(np.logspace(0, 3, 61).round())
_CAPTIONS = Captions(__file__)


def solves_row(record: Record) -> Row:
    """Return the cells common to every table of solves."""
    return {
        "record": record,
        "problem": record.title,
        "solver": label(record.solver),
        **quantile_cells("iterations", spread_of_iterations(record)),
        "iterations allowed": record.settings.get("max_iterations"),
        "remark": record.measured.get("remark", ""),
    }


def within_tolerance(record: Record) -> np.ndarray:
    """Return which residuals are within the tolerance."""
    return np.asarray(record.values.residual <= record.values.tolerance)


# Beyond reach.


def _beyond_rows(results: Results) -> list[Row]:
    chains = [r for r in results.all("ik", task=CHAIN, stratum=BEYOND) if r.has_numbers]
    return [*map(_beyond_row, results.all("arm", task=arm.BEYOND) + chains)]


def _beyond_row(record: Record) -> Row:
    solves: ChainSolves = record.values
    return {
        **solves_row(record),
        **quantile_cells("off the line", spread_of(record, "bend")),
        **quantile_cells("residual above distance − reach", spread_of(record, "excess")),
        "targets": int(record.size),
        "targets without a solution": int(np.isinf(solves.bend).sum()),
        "distances": solves.distance / solves.reach,
        "straight": solves.bend <= STRAIGHT * solves.reach,
    }


def _beyond_summary(rows: Sequence[Row]) -> Summary:
    shares = {
        solver: metrics.share(np.concatenate([row["straight"] for row in members]))
        for solver, members in grouped(rows, lambda row: str(row["solver"])).items()
    }
    straight = sum(share.hits == share.total for share in shares.values())
    return Summary(
        "The best solution is the straight line from root to target; "
        f"{straight} of {counted(len(shares), 'solver')} always end within "
        f"{words_in(STRAIGHT, '%')} of the reach of that line.",
        tuple(f"{solver}: {words(share)}" for solver, share in shares.items()),
    )


def _beyond_measured(rows: Sequence[Row]) -> dict[str, str]:
    distances = np.concatenate([row["distances"] for row in rows])
    return {"distances": " to ".join(map(words, metrics.extent(distances)))}


beyond_reach = _CAPTIONS.layout(
    "q1_beyond_reach", _beyond_rows, _beyond_summary, measured=_beyond_measured
)


# CCD and FABRIK.


def _rival_rows(results: Results) -> list[Row]:
    """Return a row for each problem solved by both CCD and FABRIK."""
    records = results.all("arm", task=arm.CURVE, warm=True)
    records += results.all("arm", task=arm.BEYOND) + results.all("ik", task=CHAIN)
    groups = [{r.solver: r for r in group} for group in by_problem(records).values()]
    return [
        _rival_row(group["ccd"], group["fabrik"])
        for group in groups
        if "ccd" in group and "fabrik" in group
    ]


def _rival_row(ccd: Record, fabrik: Record) -> Row:
    a, b = ccd.values.iterations, fabrik.values.iterations
    return {
        "records": [ccd, fabrik],
        "problem": ccd.title,
        **quantile_cells("CCD", spread_of(ccd, "iterations")),
        **quantile_cells("FABRIK", spread_of(fabrik, "iterations")),
        "CCD / FABRIK, means": metrics.ratio(metrics.mean(a), metrics.mean(b)),
        "solves": a.size,
        "fewer": metrics.ranking({"CCD": -a, "FABRIK": -b}).first,
    }


def _rival_summary(rows: Sequence[Row]) -> Summary:
    ratios = [row["CCD / FABRIK, means"] for row in rows]
    winners = [row["fewer"] for row in rows]
    ccd, fabrik = (winners.count((name,)) for name in ("CCD", "FABRIK"))
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {fabrik} of {len(rows)} problems, more on "
        f"{ccd}, and on {len(rows) - fabrik - ccd} they tie (n = "
        f"{words(sum(row['solves'] for row in rows))} solves); CCD "
        f"makes {words(min(ratios))} to {words(max(ratios))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(ratios)).median)})."
    )


def iterations_chart(results: Results) -> Sketch | None:
    """Show the share of the targets reached within each number of iterations, by stratum."""
    groups = ([r for r in group if reported_iterations(r).size] for group in histories(results))
    panels = [Panel(group[0].title, tuple(map(_reached, group))) for group in groups if group]
    chart = _CAPTIONS.figure("iterations")
    chart["shows"] += " Entrants claim their iterations." * bool(results.entrants)
    return declared_chart(chart, panels, results.entrants)


def histories(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [r for r in results.all("ik", task=CHAIN) if r.values.stratum != BEYOND]
    records = [record for record in records if record.values.history_median is not None]
    return list(by_problem(records).values())


def _reached(record: Record) -> Series:
    """Return the share of the targets reached within each number of iterations [%]."""
    iterations = np.where(within_tolerance(record), record.values.iterations, np.inf)
    rates = np.mean(iterations[:, None] <= COUNTED, axis=0)
    low, high = metrics.wilson(rates, iterations.size)
    return series(record.solver, COUNTED, 100 * rates, (100 * low, 100 * high))


rivals = _CAPTIONS.layout("q2_iterations", _rival_rows, _rival_summary, figures=(iterations_chart,))

LAYOUTS = (beyond_reach, rivals)
