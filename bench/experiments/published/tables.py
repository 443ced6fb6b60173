"""Published tables of solvers, and the same set-up measured here."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.metrics import Interval, Share
from ...harness.record import Record
from ...peers import registry
from ...tables.captions import Captions
from ...tables.columns import folded, text
from ...tables.layout import Layout
from ...tables.results import Results, grouped, label
from ...tables.table import Cell, Column, Summary, listing, words
from ..robots.readings import Score
from ..robots.tables import RULE
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published


class PublishedComparison(NamedTuple):
    """A number of a published table, and the number measured here.

    It is of a solver on a robot, or in a stratum of targets; the measured number has its 95 %
    interval, NaN where that is unknown.
    """

    table: str
    problem: str
    solver: str
    quantity: str = ""
    published: float | None = None
    measured: Interval | None = None
    targets: int | None = None
    mark: str = ""
    source: str = ""
    record: Record | None = None

    def bound(self, name: str) -> Cell:
        """Return the measured number or a bound of its interval, None where that is unknown."""
        number = getattr(self.measured, name, None)
        return number if number == number else None


def _comparisons(results: Results) -> list[PublishedComparison]:
    """Return all numbers of the published tables that have records."""
    trac_ik, toolbox = (
        [r for r in results.all("ik", task=task) if "solved" in r.arrays]
        for task in (TRAC_IK, TOOLBOX)
    )
    fabrik = sorted(results.all("ik", task=FABRIK), key=lambda r: _STRATA.index(r.details.stratum))
    rows = [*_of_trac_ik(trac_ik)]
    rows += [row for record in toolbox for row in _of_toolbox(record)]
    return rows + [row for record in fabrik for row in _of_fabrik(record)]


_STRATA = list(published.FABRIK.distances)


def _of_trac_ik(records: Sequence[Record]) -> Iterator[PublishedComparison]:
    """Yield success rates and mean times, robot by robot, the published solvers first."""
    titles = {peer.label_of(entry): peer.title for peer in registry.PEERS for entry in peer.entries}
    for robot, members in grouped(published.TRAC_IK.rates, lambda rate: rate.robot).items():
        rates = {rate.solver: rate for rate in members}
        measured = {titles.get(r.solver, r.solver): r for r in records if r.details.robot == robot}
        for solver in dict.fromkeys([*rates, *measured]) if measured else ():
            rate, record = rates.get(solver), measured.get(solver)
            row = PublishedComparison("TRAC-IK", robot, solver, source=rate.source if rate else "")
            row, share, time = _scored(row, record) if record else (row, None, None)
            percent, mean = (rate.percent, rate.milliseconds) if rate else (None, None)
            yield row._replace(quantity="solved [%]", published=percent, measured=share)
            yield row._replace(quantity="time, mean [ms]", published=mean, measured=time)


def _scored(
    row: PublishedComparison, record: Record
) -> tuple[PublishedComparison, Interval, Interval]:
    """Return a row of a record, the share of targets solved [%] and the mean time [ms]."""
    score = Score(row.problem, "", record.solver, (record,))
    row = row._replace(solver=record.solver, targets=score.total, mark=score.limits, record=record)
    time = Interval(1e3 * metrics.mean(score.begun("seconds")), np.nan, np.nan)
    return row, _percent(score.share), time


def _of_toolbox(record: Record) -> Iterator[PublishedComparison]:
    """Yield the shares of targets that one search does not solve, and its time."""
    score = Score(record.title, "", record.solver, (record,))
    rate = record.details.infeasible
    source = "" if rate is None else published.TOOLBOX.source
    row, *_ = _scored(
        PublishedComparison("Robotics Toolbox", record.title, "", source=source), record
    )
    infeasible = _percent(metrics.share(score.all("claimed", 0) != 1))
    unsolved = _percent(metrics.share(~score.solved))
    median = Interval(*(1e6 * x for x in score.median_time))
    yield row._replace(quantity="declared infeasible [%]", published=rate, measured=infeasible)
    yield row._replace(quantity="not solved within the limits [%]", measured=unsolved)
    yield row._replace(quantity="time, median [µs]", measured=median)


def _of_fabrik(record: Record) -> Iterator[PublishedComparison]:
    """Yield the mean and the largest number of iterations of a solver in a stratum."""
    stratum = record.details.stratum
    iterations = published.FABRIK.means.get(record.solver, {}).get(stratum)
    counts = record.values.iterations[~np.isnan(record.values.iterations)]
    row = PublishedComparison("FABRIK", stratum, label(record.solver), record=record)
    is_claimed = record.facts.get("entrant") is True
    row = row._replace(
        targets=counts.size or None,
        mark="claimed" * is_claimed if counts.size else "iterations not reported",
        source="" if iterations is None else published.FABRIK.source,
    )
    mean = metrics.mean_interval(counts) if counts.size else None
    largest = Interval(float(counts.max()), np.nan, np.nan) if counts.size else None
    yield row._replace(quantity="iterations, mean", published=iterations, measured=mean)
    yield row._replace(quantity="iterations, largest", measured=largest)


def _percent(share: Share) -> Interval:
    rate = metrics.ratio(share.hits, share.total)
    return Interval(100.0 * rate, 100.0 * share.low, 100.0 * share.high)


def _summary(rows: Sequence[PublishedComparison]) -> Summary:
    complete = (row for row in rows if row.published is not None and row.measured)
    return listing("Here, and as published:", map(_point, complete))


def _point(row: PublishedComparison) -> str:
    low, high = row.bound("low"), row.bound("high")
    interval = "" if low is None else f"{words(low)}–{words(high)}, "
    mark = f", {row.mark}" if row.mark else ""
    return (
        f"{row.problem}, {row.solver}: {row.quantity} {words(row.bound('value'))} "
        f"({interval}n = {words(row.targets)}), published {words(row.published)}{mark}"
    )


_CAPTIONS = Captions(
    __file__,
    rule=RULE,
    trac_ik_tolerance=words(published.TRAC_IK.tolerance),
    toolbox_iterations=words(published.TOOLBOX.iterations),
    toolbox_half_square=words(published.TOOLBOX.half_square),
    links=str(published.FABRIK.links),
    length=str(published.FABRIK.length),
    runs=str(published.FABRIK.runs),
    distances=" and ".join(map(str, published.FABRIK.distances.values())),
    fabrik_tolerance=words(published.FABRIK.tolerance),
)

published_ik = Layout(
    **_CAPTIONS.of("published_ik"),
    subjects=_comparisons,
    columns=(
        text("table", lambda row: row.table),
        text("problem", lambda row: row.problem),
        text("solver", lambda row: row.solver),
        text("quantity", lambda row: row.quantity),
        Column("published", read=lambda row: row.published),
        Column("measured", read=lambda row: row.bound("value")),
        text("mark", lambda row: row.mark),
        *folded(
            [
                Column("measured, 95 % low", read=lambda row: row.bound("low")),
                Column("measured, 95 % high", read=lambda row: row.bound("high")),
                Column("targets", read=lambda row: row.targets),
                text("source", lambda row: row.source),
            ]
        ),
    ),
    summary=_summary,
)

LAYOUTS = (published_ik,)
