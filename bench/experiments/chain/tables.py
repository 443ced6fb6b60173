"""The lab's first two questions about inverse kinematics."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, by_problem, counted, label, settings, solvers
from ...tables import columns
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    P95,
    SOLVER,
    places,
    spread,
    spread_of,
    text,
    titled,
    words_in,
)
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from .. import arm
from . import BEYOND, CHAIN, figures

# A chain counts as straight if no joint is off the line by more than this share of the reach.
STRAIGHT = 0.01
RIVALS = ("ccd", "fabrik")

# The records of both rivals on one problem.
Pair = tuple[Record, Record]


def _over_reach(records: Sequence[Record], name: str) -> metrics.Floats:
    return np.concatenate([record.arrays[name] / record.arrays["reach"] for record in records])


def _distances(records: Sequence[Record]) -> str:
    if not records:
        return "–"
    return " to ".join(words(x) for x in metrics.extent(_over_reach(records, "distance")))


def _beyond_summary(records: Sequence[Record]) -> Summary:
    return Summary(
        "The best answer is the straight line from root to target. Answers within "
        f"{words_in(STRAIGHT, '%')} of the reach of that line:",
        tuple(
            f"{label(solver)}: {_straightness([r for r in records if r.solver == solver])}"
            for solver in solvers(records)
        ),
    )


def _straightness(records: Sequence[Record]) -> str:
    bends = _over_reach(records, "bend")
    straight, answered = words(metrics.share(bends <= STRAIGHT)), np.isfinite(bends)
    unanswered = f"; no answer to {counted(int(np.sum(~answered)), 'target')}"
    if not answered.any():
        return f"{straight}{unanswered}"
    iterations = np.concatenate([columns.iterations_said(record) for record in records])
    most = columns.claimed(counted(int(iterations.max(initial=0)), "iteration"), records[0])
    excess = np.concatenate([record.arrays["excess"] for record in records])[answered]
    return (
        f"{straight}; at worst "
        f"{words_in(metrics.spread(bends[answered]).largest, '%')} of the reach off the line, "
        f"{words(metrics.spread(excess).largest)} m above distance − reach, "
        + (words(most) if iterations.size else "iterations unsaid")
        + unanswered * (not answered.all())
    )


beyond_reach = Layout(
    "Q1. If the target is too far away, what does inverse kinematics give?",
    "q1_beyond_reach",
    "Targets beyond reach",
    columns=(
        titled("problem"),
        SOLVER,
        *spread("off the line", "bend", "m", (LARGEST,)),
        *spread("residual above distance − reach", "excess", "m", (LARGEST,)),
        *columns.iterations(),
        columns.allowed(),
        columns.remark(),
        *(
            replace(column, folded=True)
            for column in (
                Column("targets", read=lambda record: int(record.size)),
                *spread("off the line", "bend", "m", (MEDIAN,)),
                *spread("residual above distance − reach", "excess", "m", (MEDIAN,)),
            )
        ),
    ),
    subjects=lambda results: (
        results.all("arm", task=arm.BEYOND)
        + [r for r in results.all("ik", task=CHAIN, stratum=BEYOND) if r.arrays]
    ),
    shows="The best answer is the straight line from root to target, which leaves exactly "
    "distance − reach. “Off the line” is the joint farthest from that line.",
    measured=lambda records: (
        f"Seeded targets in all directions, {_distances(records)} times the reach away. "
        f"Solvers stop at a residual of {settings(records, 'tolerance')} m, ours and the loops on "
        "the engines, which draw a target to within reach as ours do, also as close as that to the "
        f"best one, or after {settings(records, 'max_iterations')} iterations."
    ),
    summary=_beyond_summary,
)


def _pairs(results: Results) -> list[Pair]:
    records = results.all("arm", task=arm.CURVE, warm=True)
    records += results.all("arm", task=arm.BEYOND) + results.all("ik", task=CHAIN)
    groups = [{r.solver: r for r in group} for group in by_problem(records).values()]
    return [(both["ccd"], both["fabrik"]) for both in groups if both.keys() >= set(RIVALS)]


def _counts(i: int) -> list[Column]:
    return places(
        label(RIVALS[i]), "", (MEDIAN, P95, LARGEST), lambda pair: spread_of(pair[i], "iterations")
    )


def _fewer(pair: Pair) -> float:
    ccd, fabrik = (metrics.mean(record.arrays["iterations"]) for record in pair)
    return metrics.ratio(ccd, fabrik)


def _rival_summary(pairs: Sequence[Pair]) -> Summary:
    factors = [_fewer(pair) for pair in pairs]
    first = [_needs_fewest(pair) for pair in pairs]
    ccd, fabrik = (sum(who == name for who in first) for name in RIVALS)
    solves = sum(pair[0].arrays["iterations"].size for pair in pairs)
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {fabrik} of {len(pairs)} problems, more on "
        f"{ccd}, and on {len(pairs) - fabrik - ccd} they tie (n = {words(solves)} solves); CCD "
        f"makes {words(min(factors))} to {words(max(factors))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(factors)).median)})."
    )


def _needs_fewest(pair: Pair) -> str:
    """Return who needs fewer iterations on average for the same targets, "" if that is a tie."""
    scores = zip(RIVALS, (-record.arrays["iterations"] for record in pair), strict=True)
    first = metrics.ranking(dict(scores)).first
    return first[0] if len(first) == 1 else ""


iterations = Layout(
    "Q2. How many iterations do CCD and FABRIK need?",
    "q2_iterations",
    "Iterations of CCD and of FABRIK",
    columns=(
        text("problem", lambda pair: pair[0].title),
        *(_counts(i)[0] for i in range(len(RIVALS))),
        Column("CCD / FABRIK, means", read=_fewer),
        *(
            replace(column, folded=True)
            for column in (
                Column("solves", read=lambda pair: pair[0].arrays["iterations"].size),
                *(column for i in range(len(RIVALS)) for column in _counts(i)[1:]),
            )
        ),
    ),
    subjects=_pairs,
    shows="One iteration rotates every joint once (CCD) or runs along the chain once in each "
    "direction (FABRIK). Solves that fail count with all the iterations they made.",
    measured=lambda pairs: (
        "The arm starts each frame from its last solution, or from rest towards targets "
        "beyond its reach; the chain starts from random poses. At most "
        f"{settings((record for pair in pairs for record in pair), 'max_iterations')} iterations. "
        "They tie unless Fisher’s randomisation test of the differences, target by target, gives "
        "less than 5 %."
    ),
    summary=_rival_summary,
    figures=(figures.iterations,),
)


LAYOUTS = (beyond_reach, iterations)
