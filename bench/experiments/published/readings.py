"""Numbers of published tables, and what the same set-up gives here."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.metrics import Interval, Share
from ...harness.record import Record
from ...peers import registry
from ...tables.results import Results, label
from ..robots.readings import Score
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published

SOLVED, MEAN_TIME = "solved [%]", "time, mean [ms]"
INFEASIBLE, UNSOLVED = "infeasible by its own word [%]", "not solved within the limits [%]"
MEAN_ITERATIONS, MOST_ITERATIONS = "iterations, mean", "iterations, largest"
MEDIAN_TIME, UNSAID = "time, median [µs]", "iterations unsaid"


class Comparison(NamedTuple):
    """A number of a published table, and what it comes to here.

    It is of a solver on a robot, or in a stratum of targets; here it has its 95 % interval, NaN
    where that is unknown, and there are so many targets behind it.
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


def comparisons(results: Results) -> list[Comparison]:
    """Return all numbers of the published tables of which something was measured."""
    toolbox, fabrik = (results.all("ik", task=task) for task in (TOOLBOX, FABRIK))
    return [
        *_trac_ik([r for r in results.all("ik", task=TRAC_IK) if "solved" in r.arrays]),
        *(row for r in toolbox if "solved" in r.arrays for row in _search(r)),
        *(row for r in sorted(fabrik, key=_stratum) for row in _iterations(r)),
    ]


def _trac_ik(records: Sequence[Record]) -> Iterator[Comparison]:
    """Yield success rates and mean times, robot by robot, the published solvers first."""
    titles = {peer.label_of(entry): peer.title for peer in registry.PEERS for entry in peer.entries}
    for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK):
        rates = {rate.solver: rate for rate in published.TRAC_IK if rate.robot == robot}
        here = {titles.get(r.solver, r.solver): r for r in records if r.details.robot == robot}
        for solver in dict.fromkeys([*rates, *here]) if here else ():
            rate, record = rates.get(solver), here.get(solver)
            row = Comparison("TRAC-IK", robot, solver, source=rate.source if rate else "")
            row, share, time = _measured(row, record) if record else (row, None, None)
            yield row._replace(quantity=SOLVED, published=rate and rate.percent, here=share)
            yield row._replace(quantity=MEAN_TIME, published=rate and rate.milliseconds, here=time)


def _measured(row: Comparison, record: Record) -> tuple[Comparison, Interval, Interval]:
    """Return a row of what is measured here, the share of targets solved and the mean time."""
    score = Score(row.problem, "", record.solver, (record,))
    row = row._replace(solver=record.solver, targets=score.total, mark=score.limits, record=record)
    return row, _percent(score.share), Interval(1e3 * score.effort.mean, np.nan, np.nan)


def _search(record: Record) -> Iterator[Comparison]:
    """Yield which share of targets one search does not solve, and how long it takes."""
    score = Score(record.title, "", record.solver, (record,))
    before = record.details.infeasible
    source = "" if before is None else published.TOOLBOX_SOURCE
    row, *_ = _measured(Comparison("Robotics Toolbox", record.title, "", source=source), record)
    unclaimed = _percent(metrics.share(score.all("claimed", 0) != 1))
    unsolved = _percent(metrics.share(~score.solved))
    median = Interval(*(1e6 * x for x in score.median_time))
    yield row._replace(quantity=INFEASIBLE, published=before, here=unclaimed)
    yield row._replace(quantity=UNSOLVED, here=unsolved)
    yield row._replace(quantity=MEDIAN_TIME, here=median)


def _stratum(record: Record) -> int:
    return list(published.FABRIK_DISTANCES).index(record.details.stratum)


def _iterations(record: Record) -> Iterator[Comparison]:
    """Yield the mean and the largest number of iterations of a solver in a stratum."""
    before = published.FABRIK.get(record.solver, (None, None))[_stratum(record)]
    counts = record.values.iterations[~np.isnan(record.values.iterations)]
    row = Comparison("FABRIK", record.details.stratum, label(record.solver), record=record)
    row = row._replace(
        targets=counts.size or None,
        mark="claimed" * (record.facts.get("entrant") is True) if counts.size else UNSAID,
        source="" if before is None else published.FABRIK_SOURCE,
    )
    mean = metrics.mean_interval(counts) if counts.size else None
    largest = Interval(float(counts.max()), np.nan, np.nan) if counts.size else None
    yield row._replace(quantity=MEAN_ITERATIONS, published=before, here=mean)
    yield row._replace(quantity=MOST_ITERATIONS, here=largest)


def _percent(share: Share) -> Interval:
    rate = metrics.ratio(share.hits, share.total)
    return Interval(100.0 * rate, 100.0 * share.low, 100.0 * share.high)
