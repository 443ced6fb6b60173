"""Targets beyond reach, and the iterations of CCD and FABRIK: two of the lab's questions."""

from collections.abc import Sequence

import numpy as np

from ...figures.chart import GREATER, Axis, Chart, Panel, Series, series
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
    folded,
    iterations,
    iterations_said,
    places,
    remark,
    spread,
    spread_of,
    text,
    titled,
    words_in,
)
from ...tables.layout import Layout
from ...tables.results import Results, by_problem, grouped, label, settings
from ...tables.table import Column, Summary, words
from .. import arm
from . import BEYOND, CHAIN

# A chain counts as straight if no joint is off the line by more than this share of the reach.
STRAIGHT = 0.01
RIVALS = ("ccd", "fabrik")
# Iterations at which targets are counted.
COUNTED = np.unique(np.logspace(0, 3, 61).round())
_CAPTIONS = Captions(__file__)
# The records of both rivals on one problem.
Pair = tuple[Record, Record]


def within_tolerance(record: Record) -> np.ndarray:
    """Return which residuals are within the tolerance."""
    return np.asarray(record.values.residual <= record.details.tolerance)


# Beyond reach.


def _beyond_reach(results: Results) -> list[Record]:
    chains = [r for r in results.all("ik", task=CHAIN, stratum=BEYOND) if r.values]
    return results.all("arm", task=arm.BEYOND) + chains


def _is_straight(records: Sequence[Record]) -> np.ndarray:
    return np.concatenate([r.values.bend <= STRAIGHT * r.values.reach for r in records])


def _beyond_summary(records: Sequence[Record]) -> Summary:
    shares = {
        solver: metrics.share(_is_straight(members))
        for solver, members in grouped(records, lambda record: label(record.solver)).items()
    }
    return Summary(
        "The best solution is the straight line from root to target. Solutions within "
        f"{words_in(STRAIGHT, '%')} of the reach of that line:",
        tuple(f"{solver}: {words(share)}" for solver, share in shares.items()),
    )


def _beyond_measured(records: Sequence[Record]) -> dict[str, str]:
    distances = np.concatenate([r.values.distance / r.values.reach for r in records])
    return {
        "distances": " to ".join(map(words, metrics.extent(distances))),
        "tolerance": settings(records, "tolerance"),
        "max_iterations": settings(records, "max_iterations"),
    }


beyond_reach = Layout(
    **_CAPTIONS.of("q1_beyond_reach", _beyond_measured),
    subjects=_beyond_reach,
    columns=(
        titled("problem"),
        SOLVER,
        *spread("off the line", "bend", "m", (LARGEST,)),
        *spread("residual above distance − reach", "excess", "m", (LARGEST,)),
        *iterations(),
        allowed(),
        remark(),
        *folded(
            [
                Column("targets", read=lambda record: int(record.size)),
                Column(
                    "targets without a solution",
                    read=lambda record: int(np.isinf(record.values.bend).sum()),
                ),
                *spread("off the line", "bend", "m", (MEDIAN,)),
                *spread("residual above distance − reach", "excess", "m", (MEDIAN,)),
            ]
        ),
    ),
    summary=_beyond_summary,
)


# CCD and FABRIK.


def _rivals(results: Results) -> list[Pair]:
    """Return the records of CCD and FABRIK on each problem that both solved."""
    records = results.all("arm", task=arm.CURVE, warm=True)
    records += results.all("arm", task=arm.BEYOND) + results.all("ik", task=CHAIN)
    groups = [{r.solver: r for r in group} for group in by_problem(records).values()]
    return [(group["ccd"], group["fabrik"]) for group in groups if group.keys() >= set(RIVALS)]


def _iterations_ratio(pair: Pair) -> float:
    ccd, fabrik = (metrics.mean(record.values.iterations) for record in pair)
    return metrics.ratio(ccd, fabrik)


def _fewer_iterations(pair: Pair) -> str:
    """Return who needs fewer iterations on average for the same targets, "" if that is a tie."""
    scores = zip(RIVALS, (-record.values.iterations for record in pair), strict=True)
    first = metrics.ranking(dict(scores)).first
    return first[0] if len(first) == 1 else ""


def _rival_summary(pairs: Sequence[Pair]) -> Summary:
    ratios = [_iterations_ratio(pair) for pair in pairs]
    winners = [_fewer_iterations(pair) for pair in pairs]
    ccd, fabrik = (winners.count(name) for name in RIVALS)
    solves = sum(pair[0].values.iterations.size for pair in pairs)
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {fabrik} of {len(pairs)} problems, more on "
        f"{ccd}, and on {len(pairs) - fabrik - ccd} they tie (n = {words(solves)} solves); CCD "
        f"makes {words(min(ratios))} to {words(max(ratios))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(ratios)).median)})."
    )


def iterations_chart(results: Results) -> Sketch | None:
    """Show the share of the targets that is reached within so many iterations, by stratum."""
    groups = ([r for r in group if iterations_said(r).size] for group in histories(results))
    panels = [Panel(group[0].title, tuple(map(_reached, group))) for group in groups if group]
    if not panels:
        return None
    return chart_sketch(
        Chart(
            "iterations",
            "Iterations of every solver",
            "How many of the targets are reached within so many iterations; the band is the 95 % "
            "interval (Wilson)." + " Entrants claim their iterations." * bool(results.entrants),
            tuple(panels),
            Axis("iterations, log scale", log=True),
            Axis("targets reached [%]", limits=(-3, 103)),
            better=GREATER,
            entrants=results.entrants,
        )
    )


def histories(results: Results) -> list[list[Record]]:
    """Return the records with a history of each stratum within reach."""
    records = [r for r in results.all("ik", task=CHAIN) if r.details.stratum != BEYOND]
    records = [record for record in records if record.values.history_median is not None]
    return list(by_problem(records).values())


def _reached(record: Record) -> Series:
    """Return the share of the targets that is reached within each number of iterations [%]."""
    reached, made = within_tolerance(record), record.values.iterations
    shares = [metrics.share(reached & (made <= count)) for count in COUNTED]
    low, high = (100 * np.array([getattr(s, end) for s in shares]) for end in ("low", "high"))
    rates = [100 * share.hits / max(1, share.total) for share in shares]
    return series(record.solver, COUNTED, rates, (low, high))


def _counts(i: int, quantiles: Sequence[str]) -> list[Column]:
    def read(pair: Pair) -> Sequence[int | float]:
        return spread_of(pair[i], "iterations")

    return places(label(RIVALS[i]), "", quantiles, read)


rivals = Layout(
    **_CAPTIONS.of(
        "q2_iterations",
        lambda pairs: {
            "max_iterations": settings((r for pair in pairs for r in pair), "max_iterations")
        },
    ),
    subjects=_rivals,
    columns=(
        text("problem", lambda pair: pair[0].title),
        *_counts(0, (MEDIAN,)),
        *_counts(1, (MEDIAN,)),
        Column("CCD / FABRIK, means", read=_iterations_ratio),
        *folded(
            [
                Column("solves", read=lambda pair: pair[0].values.iterations.size),
                *_counts(0, (P95, LARGEST)),
                *_counts(1, (P95, LARGEST)),
            ]
        ),
    ),
    summary=_rival_summary,
    figures=(iterations_chart,),
)

LAYOUTS = (beyond_reach, rivals)
