"""The lab's three questions about inverse kinematics, and accuracy."""

from collections.abc import Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, by_problem, counted, label, settings, solvers
from ...presentation.tables import Cell, Column, Summary, Table, words
from .. import arm
from . import BEYOND, CHAIN

# A chain counts as straight if no joint is off the line by more than this share of the reach.
STRAIGHT = 0.01
RIVALS = ("ccd", "fabrik")


def beyond_reach(results: Results) -> Table:
    """Return Q1: what becomes of a target that is too far away."""
    records = results.all("arm", task=arm.BEYOND)
    records += results.all("ik", task=CHAIN, stratum=BEYOND)
    return Table(
        "q1_beyond_reach",
        "Targets beyond reach",
        (
            Column("problem", words=True),
            Column("solver", words=True),
            Column("targets"),
            Column("off the line, median", "m"),
            Column("off the line, largest", "m"),
            Column("residual above distance − reach, median", "m"),
            Column("residual above distance − reach, largest", "m"),
            Column("iterations, median"),
            Column("iterations, largest"),
        ),
        tuple(_beyond_row(record) for record in records),
        shows="The best answer is the straight line from root to target, which leaves exactly "
        "distance − reach. “Off the line” is the joint farthest from that line.",
        measured=f"Seeded targets in all directions, {_distances(records)} times the reach away. "
        f"Solvers stop at a residual of {settings(records, 'tolerance')} m, ours also as close as "
        f"that to the best one, or after {settings(records, 'max_iterations')} iterations.",
        summary=_beyond_summary(records),
    )


def _beyond_row(record: Record) -> tuple[Cell, ...]:
    bend, excess = (metrics.spread(record.arrays[name]) for name in ("bend", "excess"))
    median, _, largest = metrics.whole(record.arrays["iterations"])
    return (
        record.title, label(record.solver), int(record.size), bend.median, bend.largest,
        excess.median, excess.largest, median, largest,
    )  # fmt: skip


def _distances(records: Sequence[Record]) -> str:
    shares = [record.arrays["distance"] / record.arrays["reach"] for record in records]
    if not shares:
        return "–"
    low, high = metrics.extent(np.concatenate(shares))
    return f"{words(low)} to {words(high)}"


def _beyond_summary(records: Sequence[Record]) -> Summary:
    points = []
    for solver in solvers(records):
        mine = [record for record in records if record.solver == solver]
        bends = np.concatenate([r.arrays["bend"] / r.arrays["reach"] for r in mine])
        straight = metrics.share(bends <= STRAIGHT)
        excess = max(metrics.spread(r.arrays["excess"]).largest for r in mine)
        most = max(metrics.whole(r.arrays["iterations"])[2] for r in mine)
        points.append(
            f"{label(solver)}: {words(straight.hits)} of {words(straight.total)}; at worst "
            f"{words(metrics.percent(metrics.spread(bends).largest, 1.0))} % of the reach off the "
            f"line, {words(excess)} m above distance − reach, {counted(int(most), 'iteration')}"
        )
    return Summary(
        "The best answer is the straight line from root to target. Answers within "
        f"{words(metrics.percent(STRAIGHT, 1.0))} % of the reach of that line:",
        tuple(points),
    )


def iterations(results: Results) -> Table:
    """Return Q2: the iterations of CCD against FABRIK."""
    records = [
        record
        for record in results.all("arm", task=arm.CURVE, warm=True)
        + results.all("arm", task=arm.BEYOND)
        + results.all("ik", task=CHAIN)
        if record.solver in RIVALS
    ]
    pairs = []
    for both in by_problem(records).values():
        pair = [next((r for r in both if r.solver == rival), None) for rival in RIVALS]
        if pair[0] is not None and pair[1] is not None:
            pairs.append((pair[0], pair[1]))
    return Table(
        "q2_iterations",
        "Iterations of CCD and of FABRIK",
        (
            Column("problem", words=True),
            Column("solves"),
            *(
                Column(f"{label(rival)}, {what}")
                for rival in RIVALS
                for what in ("median", "95 %", "largest")
            ),
            Column("CCD / FABRIK, means"),
        ),
        tuple(_rival_row(*pair) for pair in pairs),
        shows="One iteration rotates every joint once (CCD) or runs along the chain once in each "
        "direction (FABRIK). Solves that fail count with all the iterations they made.",
        measured="The arm starts each frame from its last solution, or from rest towards targets "
        "beyond its reach; the chain starts from random poses. At most "
        f"{settings(records, 'max_iterations')} iterations.",
        summary=_rival_summary(pairs),
    )


def _rival_row(ccd: Record, fabrik: Record) -> tuple[Cell, ...]:
    spreads = [metrics.whole(record.arrays["iterations"]) for record in (ccd, fabrik)]
    return (
        ccd.title,
        int(ccd.arrays["iterations"].size),
        *(value for spread in spreads for value in spread),
        _fewer(ccd, fabrik),
    )


def _fewer(ccd: Record, fabrik: Record) -> float:
    return metrics.ratio(
        metrics.mean(ccd.arrays["iterations"]), metrics.mean(fabrik.arrays["iterations"])
    )


def _rival_summary(pairs: Sequence[tuple[Record, Record]]) -> Summary:
    if not pairs:
        return Summary()
    factors = [_fewer(ccd, fabrik) for ccd, fabrik in pairs]
    wins = sum(factor > 1 for factor in factors)
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {wins} of {len(pairs)} problems; CCD makes "
        f"{words(min(factors))} to {words(max(factors))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(factors)).median)})."
    )
