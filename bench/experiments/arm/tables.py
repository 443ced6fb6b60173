"""Success and residuals within reach, on the arm's curves and the chain's targets."""

from collections.abc import Iterable, Sequence

import numpy as np

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    P95,
    SOLVER,
    allowed,
    effort,
    folded,
    iterations,
    remark,
    share,
    spread,
    text,
    titled,
)
from ...tables.layout import Layout
from ...tables.results import Results, by_problem, grouped, label, leaders, settings
from ...tables.table import Column, Summary, words
from ..chain import BEYOND, CHAIN
from ..chain.tables import histories, within_tolerance
from . import CURVE

STARTS = {None: "random", False: "rest", True: "last solution"}


def _within_reach(results: Results) -> list[Record]:
    """Return the records of targets within reach, problem by problem."""
    records = results.all("arm", task=CURVE, warm=False)
    records += results.all("arm", task=CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.details.stratum != BEYOND]
    return [record for group in by_problem(records).values() for record in group]


def _start(record: Record) -> str:
    return STARTS[record.details.warm]


def _summary(records: Sequence[Record]) -> Summary:
    hits = {
        solver: {(r.problem, _start(r)): within_tolerance(r) for r in members}
        for solver, members in grouped(records, lambda record: label(record.solver)).items()
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


def _measured(records: Iterable[Record]) -> dict[str, str]:
    return {name: settings(records, name) for name in ("tolerance", "max_iterations")}


accuracy = Layout(
    **Captions(__file__).of("accuracy", _measured),
    subjects=_within_reach,
    columns=(
        titled("problem"),
        text("start", _start),
        SOLVER,
        share("within tolerance", within_tolerance, best="greatest"),
        *spread("residual", "residual", "m", (LARGEST,)),
        Column(
            "time, median",
            "µs",
            read=lambda record: effort(record).median if "seconds" in record.arrays else None,
        ),
        *iterations((MEDIAN,)),
        allowed(),
        remark(),
        *folded([*spread("residual", "residual", "m", (MEDIAN, P95)), *iterations((P95, LARGEST))]),
    ),
    summary=_summary,
    figures=(residuals_chart,),
    compared=2,
)

LAYOUTS = (accuracy,)
