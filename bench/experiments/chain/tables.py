"""Inverse kinematics of chains and curves: the lab's three questions, and accuracy."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    P95,
    SOLVER,
    allowed,
    at,
    effort,
    folded,
    greatest,
    iterations,
    least,
    places,
    remark,
    share,
    spread,
    spread_of,
    text,
    titled,
    words_in,
)
from ...tables.layout import Layout
from ...tables.results import label, leaders, settings
from ...tables.table import Column, Summary, words
from ..closed_curves import COHERENT, COLD, WARM
from . import figures, readings
from .readings import MODES, RIVALS, STRAIGHT, Motions, Pair


def _beyond_summary(records: Sequence[Record]) -> Summary:
    shares = readings.straightness(records).items()
    return Summary(
        "The best answer is the straight line from root to target. Answers within "
        f"{words_in(STRAIGHT, '%')} of the reach of that line:",
        tuple(f"{solver}: {words(share)}" for solver, share in shares),
    )


def _extent(records: Sequence[Record]) -> str:
    return " to ".join(map(words, readings.distances(records)))


beyond_reach = Layout(
    "Q1. If the target is too far away, what does inverse kinematics give?",
    "q1_beyond_reach",
    "Targets beyond reach",
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
                Column("targets without an answer", read=readings.unanswered),
                *spread("off the line", "bend", "m", (MEDIAN,)),
                *spread("residual above distance − reach", "excess", "m", (MEDIAN,)),
            ]
        ),
    ),
    subjects=readings.beyond_reach,
    shows="The best answer is the straight line from root to target, which leaves exactly "
    "distance − reach. “Off the line” is the joint farthest from that line.",
    measured=lambda records: (
        f"Seeded targets in all directions, {_extent(records)} times the reach away. "
        f"Solvers stop at a residual of {settings(records, 'tolerance')} m, ours and the loops on "
        "the engines, which draw a target to within reach as ours do, also as close as that to the "
        f"best one, or after {settings(records, 'max_iterations')} iterations."
    ),
    summary=_beyond_summary,
)


def _counts(i: int, of: Sequence[str]) -> list[Column]:
    return places(label(RIVALS[i]), "", of, lambda pair: spread_of(pair[i], "iterations"))


def _rival_summary(pairs: Sequence[Pair]) -> Summary:
    ratios = [readings.iterations_ratio(pair) for pair in pairs]
    first = [readings.fewer_iterations(pair) for pair in pairs]
    ccd, fabrik = (first.count(name) for name in RIVALS)
    solves = sum(pair[0].values.iterations.size for pair in pairs)
    return Summary(
        f"FABRIK needs fewer iterations than CCD on {fabrik} of {len(pairs)} problems, more on "
        f"{ccd}, and on {len(pairs) - fabrik - ccd} they tie (n = {words(solves)} solves); CCD "
        f"makes {words(min(ratios))} to {words(max(ratios))} times as many on average "
        f"(median of the problems {words(metrics.spread(np.array(ratios)).median)})."
    )


rivals = Layout(
    "Q2. How many iterations do CCD and FABRIK need?",
    "q2_iterations",
    "Iterations of CCD and of FABRIK",
    columns=(
        text("problem", lambda pair: pair[0].title),
        *(column for i in range(len(RIVALS)) for column in _counts(i, (MEDIAN,))),
        Column("CCD / FABRIK, means", read=readings.iterations_ratio),
        *folded(
            [
                Column("solves", read=lambda pair: pair[0].values.iterations.size),
                *(column for i in range(len(RIVALS)) for column in _counts(i, (P95, LARGEST))),
            ]
        ),
    ),
    subjects=readings.rivals,
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


def _by_mode(
    title: str, read: Callable[[Record], Any], unit: str = "", modes: Sequence[str] = MODES
) -> list[Column]:
    """Return a column for each mode."""

    def read_in(mode: str) -> Callable[[Motions], Any]:
        return lambda motions: read(motions.by_mode[mode])

    return [Column(f"{title}, {mode}", unit, read=read_in(mode), group=title) for mode in modes]


def _mean_iterations(record: Record) -> float:
    return metrics.mean(record.values.iterations)


def _drift(mode: str, repetition: int) -> Column:
    title = f"drift, {mode}"
    read = partial(Motions.drift, mode=mode, repetition=repetition)
    return Column(f"{title}, after {repetition}", "°", read=read, best="least", group=title)


def _motions_summary(rows: Sequence[Motions]) -> Summary:
    return Summary(
        "A coherent motion solves all frames together, so that the joints rotate as little as they "
        "can from each frame to the next. The largest rotation of a joint is smaller than with "
        f"warm starts in {sum(row.is_smoother for row in rows)} of {len(rows)} cases, and in "
        f"{sum(row.is_closed for row in rows)} the step from the last frame back to the first is "
        "no larger than others. The largest of all, and the frames within tolerance:",
        (*(_mode_summary(rows, mode) for mode in MODES), *_price(rows), *_drift_summary(rows)),
    )


def _mode_summary(rows: Sequence[Motions], mode: str) -> str:
    records = [row.by_mode[mode] for row in rows]
    worst = max(records, key=readings.largest_angle)
    hits = [readings.hits(record) for record in records]
    return (
        f"{mode}: {words_in(readings.largest_angle(worst), '°')} ({worst.title}, "
        f"{label(worst.solver)}); {words(sum(hit.hits for hit in hits))} of "
        f"{words(sum(hit.total for hit in hits))} frames"
    )


def _price(rows: Sequence[Motions]) -> Iterable[str]:
    counts = [row.shared_iterations for row in rows]
    yield f"all frames are changed together {words(min(counts))} to {words(max(counts))} times"


def _drift_summary(rows: Sequence[Motions]) -> Iterable[str]:
    warm, closed = (
        [drift for row in rows for i in repetitions if (drift := row.drift(mode, i)) is not None]
        for mode, repetitions in ((WARM, (3,)), (COHERENT, (1, 2, 3)))
    )
    if warm and closed:
        low, high = (words_in(drift, "°") for drift in metrics.extent(np.array(warm)))
        yield (
            f"after three repetitions warm starts leave the arm {low} to {high} from its first "
            f"pose; the closed coherent motion is never more than {words_in(max(closed), '°')} off"
        )


def _all_records(rows: Sequence[Motions]) -> list[Record]:
    return [record for row in rows for record in row.by_mode.values()]


jitter = Layout(
    "Q3. Joints may jitter from frame to frame: how is it avoided, and what does it cost?",
    "q3_jitter",
    "How far joints rotate from frame to frame, and what a smooth motion costs",
    subjects=readings.motions,
    columns=(
        text("curve", lambda row: row.title),
        text("solver", lambda row: row.solver),
        *least(_by_mode("largest rotation", readings.largest_angle, "°")),
        *least(_by_mode("closing rotation", readings.closing_angle, "°", (WARM, COHERENT))),
        *_by_mode("mean iterations", _mean_iterations, modes=(WARM, COHERENT)),
        *folded(
            [
                *_by_mode("mean iterations", _mean_iterations, modes=(COLD,)),
                Column("iterations over all frames at once", read=lambda m: m.shared_iterations),
                *greatest(_by_mode("within tolerance", readings.hits)),
                *_by_mode("largest path error", at(2, partial(spread_of, name="residual")), "m"),
                *_by_mode("mean rotation", lambda r: metrics.mean(r.values.mean_angle[:-1]), "°"),
                *(_drift(mode, i) for mode in (WARM, COHERENT) for i in (1, 2, 3)),
                Column("frames", read=lambda row: row.by_mode[WARM].values.residual.size),
            ]
        ),
    ),
    shows="The angle by which a joint rotates between neighbouring frames: of a ball the "
    "geodesic one, of a hinge the change of its coordinate. The largest is over all frames and "
    "joints, the mean over both; the step from the last frame back to the first stands apart. An "
    "iteration over all frames at once counts as one of each frame. The path error is the "
    "distance from the effector to its point on the curve. Drift is the largest angle between a "
    "joint’s first rotation and the one after each repetition of the curve.",
    measured=lambda rows: (
        "Each curve is closed and followed once. Cold: every frame is solved from the start pose; "
        "warm: from the solution before it; coherent: all frames are changed together from there "
        "until the sum of all squared angles, the closing one included, is least. Frames are "
        f"solved to {settings(_all_records(rows), 'tolerance')} m in at most "
        f"{settings(_all_records(rows), 'max_iterations')} iterations; a coherent motion is then "
        "on its path to rounding, and a frame that is not reached is drawn to its point. Residuals "
        "are recomputed by forward kinematics. For the drift the arm draws the heart three times "
        "without a break; the coherent motion is closed, so that it returns by construction."
    ),
    summary=_motions_summary,
    figures=(figures.jitter,),
)


def _success_summary(records: Sequence[Record]) -> Summary:
    shares, ranking = readings.success(records)
    first = f"; first: {leaders(ranking)}" if ranking else ""
    points = (f"{solver}: {words(hits)}" for solver, hits in shares.items())
    return Summary(f"Solved within tolerance, over all these problems{first}:", tuple(points))


def _median_time(record: Record) -> float | None:
    return effort(record).median if "seconds" in record.arrays else None


accuracy = Layout(
    "How often, and how closely, is the target met?",
    "accuracy",
    "Success and residuals within reach",
    columns=(
        titled("problem"),
        text("start", readings.start),
        SOLVER,
        share("within tolerance", readings.within_tolerance, best="greatest"),
        *spread("residual", "residual", "m", (LARGEST,)),
        Column("time, median", "µs", read=_median_time),
        *iterations((MEDIAN,)),
        allowed(),
        remark(),
        *folded([*spread("residual", "residual", "m", (MEDIAN, P95)), *iterations((P95, LARGEST))]),
    ),
    subjects=readings.within_reach,
    shows=lambda records: (
        f"A solve succeeds if the effector is within {settings(records, 'tolerance')} m of "
        "its target. Residuals are not cut off at the tolerance. The interval is Wilson’s; solvers "
        "tie unless one solves so many more of the same targets that chance would do as much in "
        "less than 5 % of cases (McNemar’s exact test)."
    ),
    measured=lambda records: (
        "Residuals recomputed by forward kinematics of the rotations returned, whatever "
        "the solver says. Starts: the arm’s rest pose, the last frame’s solution, or seeded random "
        f"rotations. At most {settings(records, 'max_iterations')} iterations. Targets of the "
        "chain are timed one by one, each by a call from Python."
    ),
    summary=_success_summary,
    figures=(figures.ik_residuals,),
    compared=2,
)


LAYOUTS = (beyond_reach, rivals, jitter, accuracy)
