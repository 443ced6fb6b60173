"""Numbers of published tables, and what the same set-up gives here."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.metrics import Interval, Share
from ...harness.record import Record
from ...harness.results import Results, label
from ...peers import registry
from ..robots.readings import Score
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published

SOLVED, MEAN_TIME = "solved [%]", "time, mean [ms]"
INFEASIBLE, UNSOLVED = "infeasible by its own word [%]", "not solved within the limits [%]"
MEAN_ITERATIONS, MOST_ITERATIONS = "iterations, mean", "iterations, largest"
MEDIAN_TIME = "time, median [µs]"


class Comparison(NamedTuple):
    """A number of a published table, and what it comes to here.

    Attributes:
        table: whose table it is.
        problem: a robot, or a stratum of targets.
        solver: how it is written.
        quantity: what the number is, with its unit.
        published: the number there, None if there is none.
        here: the number here with its 95 % interval, NaN where that is unknown; likewise.
        targets: how many targets are behind the number here.
        mark: what to know of the number here.
        source: where the number was published.
        record: what was measured.
    """

    table: str
    problem: str
    solver: str
    quantity: str = ""
    published: float | None = None
    here: Interval | None = None
    targets: int | None = None
    mark: str = ""
    source: str = ""
    record: Record | None = None


# Numbers by quantity: as published, and here.
Numbers = dict[str, tuple[float | None, Interval | None]]


def comparisons(results: Results) -> list[Comparison]:
    """Return all numbers of the published tables of which something was measured."""
    return [*_trac_ik(results), *_toolbox(results), *_fabrik(results)]


def _rows(row: Comparison, numbers: Numbers) -> Iterator[Comparison]:
    for quantity, (before, here) in numbers.items():
        yield row._replace(quantity=quantity, published=before, here=here)


def _trac_ik(results: Results) -> Iterator[Comparison]:
    """Yield success rates and mean times, robot by robot, the published solvers first."""
    measured = [r for r in results.all("ik", task=TRAC_IK) if "solved" in r.arrays]
    titles = {peer.called(entry): peer.title for peer in registry.PEERS for entry in peer.entries}
    for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK):
        rates = {rate.solver: rate for rate in published.TRAC_IK if rate.robot == robot}
        here = {titles.get(r.solver, r.solver): r for r in measured if r.details.robot == robot}
        for solver in dict.fromkeys([*rates, *here]) if here else ():
            yield from _rates(robot, solver, rates.get(solver), here.get(solver))


def _rates(
    robot: str, solver: str, rate: published.PublishedRate | None, record: Record | None
) -> Iterator[Comparison]:
    """Yield the success rate and the mean time of a solver on a robot."""
    row = Comparison("TRAC-IK", robot, solver, source=rate.source if rate else "")
    share = time = None
    if record:
        score = Score(robot, "", record.solver, (record,))
        row = row._replace(solver=record.solver, **_sample(score))
        share, time = _percent(score.share), Interval(1e3 * score.effort.mean, *_UNKNOWN)
    percent, milliseconds = (rate.percent, rate.milliseconds) if rate else (None, None)
    yield from _rows(row, {SOLVED: (percent, share), MEAN_TIME: (milliseconds, time)})


def _toolbox(results: Results) -> Iterator[Comparison]:
    """Yield which share of targets one search does not solve, and how long it takes."""
    for record in results.all("ik", task=TOOLBOX):
        if "solved" in record.arrays:
            score = Score(record.title, "", record.solver, (record,))
            before = record.details.infeasible
            source = "" if before is None else published.TOOLBOX_SOURCE
            row = Comparison("Robotics Toolbox", score.robots, score.solver, source=source)
            numbers: Numbers = {
                INFEASIBLE: (before, _percent(metrics.share(score.all("claimed", 0) != 1))),
                UNSOLVED: (None, _percent(metrics.share(~score.solved))),
                MEDIAN_TIME: (None, Interval(*(1e6 * x for x in score.median_time))),
            }
            yield from _rows(row._replace(**_sample(score)), numbers)


def _fabrik(results: Results) -> Iterator[Comparison]:
    """Yield the iterations of each solver, stratum by stratum."""
    for i, stratum in enumerate(published.FABRIK_DISTANCES):
        for record in results.all("ik", task=FABRIK, stratum=stratum):
            before = published.FABRIK.get(record.solver, (None, None))[i]
            counts = record.values.iterations[~np.isnan(record.values.iterations)]
            claimed = "claimed" if record.facts.get("entrant") else ""
            row = Comparison(
                "FABRIK",
                stratum,
                label(record.solver),
                targets=counts.size or None,
                mark=claimed if counts.size else "iterations unsaid",
                source="" if before is None else published.FABRIK_SOURCE,
                record=record,
            )
            largest = Interval(float(counts.max()), *_UNKNOWN) if counts.size else None
            mean = metrics.mean_interval(counts) if counts.size else None
            numbers: Numbers = {MEAN_ITERATIONS: (before, mean), MOST_ITERATIONS: (None, largest)}
            yield from _rows(row, numbers)


_UNKNOWN = (np.nan, np.nan)


def _percent(share: Share) -> Interval:
    rate = metrics.ratio(share.hits, share.total)
    return Interval(*(100.0 * x for x in (rate, share.low, share.high)))


def _sample(score: Score) -> dict[str, Any]:
    """Return what is behind the numbers of a score."""
    return {"targets": score.share.total, "mark": score.limits, "record": score.records[0]}
