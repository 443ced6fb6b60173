"""What the records of chains and curves say: solves within reach and beyond, rivals, motions."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...tables.results import Results, by_problem, label
from .. import arm
from ..closed_curves import COHERENT, COLD, CURVE, DRIFT, WARM
from . import BEYOND, CHAIN
from .values import Reached

# A chain counts as straight if no joint is off the line by more than this share of the reach.
STRAIGHT = 0.01
RIVALS = ("ccd", "fabrik")
STARTS = {None: "random", False: "rest", True: "last solution"}
MODES = (COLD, WARM, COHERENT)
# The step that closes a curve is as large as the others if it exceeds them by at most this share.
SAME = 0.01

# The records of both rivals on one problem.
Pair = tuple[Record, Record]


# Within reach.


def within_reach(results: Results) -> list[Record]:
    """Return the records of targets within reach, problem by problem."""
    records = results.all("arm", task=arm.CURVE, warm=False)
    records += results.all("arm", task=arm.CURVE, warm=True)
    records += [r for r in results.all("ik", task=CHAIN) if r.details.stratum != BEYOND]
    return [record for group in by_problem(records).values() for record in group]


def within_tolerance(record: Record) -> np.ndarray:
    """Return which residuals are within the tolerance."""
    return np.asarray(record.values.residual <= record.details.tolerance)


def hits(record: Record) -> metrics.Share:
    """Return the share of the residuals that are within the tolerance."""
    return metrics.share(within_tolerance(record))


def start(record: Record) -> str:
    """Return where the solves start."""
    return STARTS[record.details.warm]


def success(records: Iterable[Record]) -> tuple[dict[str, metrics.Share], metrics.Ranking | None]:
    """Return what each solver solves of all problems, and a ranking of those that take them all."""
    solved: dict[str, dict[tuple[str, str], metrics.Floats]] = {}
    for record in records:
        places = solved.setdefault(label(record.solver), {})
        places[record.problem, start(record)] = within_tolerance(record)
    sizes = {place: hit.size for places in solved.values() for place, hit in places.items()}
    joined = {solver: np.concatenate(list(places.values())) for solver, places in solved.items()}
    complete = {
        solver: np.concatenate([places[place] for place in sizes])
        for solver, places in solved.items()
        if {place: hit.size for place, hit in places.items()} == sizes
    }
    ranking = metrics.ranking(complete) if len(complete) > 1 else None
    return {solver: metrics.share(hit) for solver, hit in joined.items()}, ranking


# Beyond reach.


def beyond_reach(results: Results) -> list[Record]:
    """Return the records of targets beyond reach."""
    chains = [r for r in results.all("ik", task=CHAIN, stratum=BEYOND) if r.values]
    return results.all("arm", task=arm.BEYOND) + chains


def distances(records: Sequence[Record]) -> tuple[float, float]:
    """Return the least and greatest distance of the targets, in units of the reach."""
    values: list[Reached] = [record.values for record in records]
    return metrics.extent(np.concatenate([v.distance / v.reach for v in values]))


def straightness(records: Sequence[Record]) -> dict[str, metrics.Share]:
    """Return the share of straight chains of each solver."""
    straight: dict[str, list[np.ndarray]] = {}
    for record in records:
        values: Reached = record.values
        straight.setdefault(label(record.solver), []).append(values.bend <= STRAIGHT * values.reach)
    return {solver: metrics.share(np.concatenate(hits)) for solver, hits in straight.items()}


def unanswered(record: Record) -> int:
    """Return how many targets have no answer."""
    return int(np.isinf(record.values.bend).sum())


# CCD and FABRIK.


def rivals(results: Results) -> list[Pair]:
    """Return the records of CCD and FABRIK on each problem that both solved."""
    records = results.all("arm", task=arm.CURVE, warm=True)
    records += results.all("arm", task=arm.BEYOND) + results.all("ik", task=CHAIN)
    groups = [{r.solver: r for r in group} for group in by_problem(records).values()]
    return [(both["ccd"], both["fabrik"]) for both in groups if both.keys() >= set(RIVALS)]


def iterations_ratio(pair: Pair) -> float:
    """Return the mean iterations of CCD over those of FABRIK."""
    ccd, fabrik = (metrics.mean(record.values.iterations) for record in pair)
    return metrics.ratio(ccd, fabrik)


def fewer_iterations(pair: Pair) -> str:
    """Return who needs fewer iterations on average for the same targets, "" if that is a tie."""
    scores = zip(RIVALS, (-record.values.iterations for record in pair), strict=True)
    first = metrics.ranking(dict(scores)).first
    return first[0] if len(first) == 1 else ""


# Motions.


class Motions(NamedTuple):
    """One curve followed by one solver, and how it drifts over repetitions.

    Attributes:
        by_mode: the record of each mode.
        drifts: how far the arm is from its first pose after each repetition [rad], by mode; empty
            but for the curve that is repeated.
    """

    by_mode: Mapping[str, Record]
    drifts: Mapping[str, Record]

    @property
    def title(self) -> str:
        """How the curve is written."""
        return self.by_mode[WARM].title

    @property
    def solver(self) -> str:
        """The solver's label."""
        return label(self.by_mode[WARM].solver)

    @property
    def shared_iterations(self) -> int:
        """The iterations over all frames: what even the frame with the fewest more has more."""
        coherent, warm = (self.by_mode[mode].values.iterations for mode in (COHERENT, WARM))
        return int(metrics.extent(coherent - warm)[0])

    @property
    def is_smoother(self) -> bool:
        """Whether the coherent motion rotates its joints less far than that by warm starts."""
        return largest_angle(self.by_mode[COHERENT]) < largest_angle(self.by_mode[WARM])

    @property
    def is_closed(self) -> bool:
        """Whether the coherent motion's step from last frame to first is no larger than others."""
        record = self.by_mode[COHERENT]
        return closing_angle(record) <= (1.0 + SAME) * largest_angle(record)

    def drift(self, mode: str, repetition: int) -> float | None:
        """Return the drift after a repetition [rad], None where it was not measured."""
        record = self.drifts.get(mode)
        return float(record.values.drift[repetition - 1]) if record else None


def motions(results: Results) -> list[Motions]:
    """Return the curves that were followed in all modes, with the drift of the repeated one."""
    drifts = _by_curve(results, DRIFT)
    return [
        Motions(by_mode, drifts.get((problem.replace("arm/", "drift/"), solver), {}))
        for (problem, solver), by_mode in _by_curve(results, CURVE).items()
        if by_mode.keys() >= set(MODES)
    ]


def _by_curve(results: Results, task: str) -> dict[tuple[str, str], dict[str, Record]]:
    groups: dict[tuple[str, str], dict[str, Record]] = {}
    for record in results.all("tracking", task=task):
        modes = groups.setdefault((record.problem, record.solver), {})
        modes[record.details.mode] = record
    return groups


def largest_angle(record: Record) -> float:
    """Return the largest rotation of a joint between neighbouring frames [rad]."""
    return metrics.spread(record.values.largest_angle[:-1]).largest


def closing_angle(record: Record) -> float:
    """Return the largest rotation of a joint from the last frame back to the first [rad]."""
    return float(record.values.largest_angle[-1])
