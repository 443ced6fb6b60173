"""Published tables of solvers, and the same set-up measured here."""

from collections.abc import Iterator, Sequence

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...problems import published
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import Results, counted, grouped, label
from ...tables.table import Summary, listing, words
from ..robots.readings import Score
from ..robots.tables import RULE
from . import FABRIK, TOOLBOX, TRAC_IK


def _rows(results: Results) -> list[Row]:
    """Return all numbers of the published tables with records."""
    strata = list(published.FABRIK.distances)
    trac_ik, toolbox = (
        [record for record in results.all("ik", task=task) if "solved" in record.measured]
        for task in (TRAC_IK, TOOLBOX)
    )
    fabrik = sorted(results.all("ik", task=FABRIK), key=lambda r: strata.index(r.values.stratum))
    rows = [*_of_trac_ik(trac_ik)]
    rows += [row for record in toolbox for row in _of_toolbox(record)]
    return rows + [row for record in fabrik for row in _of_fabrik(record)]


def _row(about: Row, quantity: str, number: float | None, measured: Sequence[float]) -> Row:
    """Return the row of a number; `measured` may have the bounds of its 95 % interval."""
    titles = ("measured", "measured, 95 % low", "measured, 95 % high")
    cells = {t: None if np.isnan(x) else x for t, x in zip(titles, measured, strict=False)}
    return {**about, "quantity": quantity, "published": number, **cells}


def _about(score: Score) -> Row:
    row = {"record": score.records[0], "solver": score.solver, "targets": score.total}
    return {**row, "mark": score.limits}


def _of_trac_ik(records: Sequence[Record]) -> Iterator[Row]:
    """Yield success rates and mean times, robot by robot, the published solvers first."""
    titles = {peer.label_of(entry): peer.name for peer in registry.PEERS for entry in peer.entries}
    for robot, members in grouped(published.TRAC_IK.rates, lambda rate: rate.robot).items():
        rates = {rate.solver: rate for rate in members}
        measured = {titles.get(r.solver, r.solver): r for r in records if r.values.robot == robot}
        for solver in dict.fromkeys([*rates, *measured]) if measured else ():
            *_, percent, milliseconds, source = rates.get(solver) or (None, None, "")
            about = {"table": "TRAC-IK", "problem": robot, "solver": solver, "mark": ""}
            about |= {"source": source}
            share, time = [], []
            if record := measured.get(solver):
                score = Score(robot, "", record.solver, (record,))
                about |= _about(score)
                share, time = (
                    _percent(score, score.solved),
                    [1e3 * metrics.mean(score.seconds)],
                )
            yield _row(about, "solved [%]", percent, share)
            yield _row(about, "time, mean [ms]", milliseconds, time)


def _of_toolbox(record: Record) -> Iterator[Row]:
    """Yield the shares of targets not solved by a single search, and its time."""
    score = Score(record.title, "", record.solver, (record,))
    rate = record.values.infeasible
    source = "" if rate is None else published.TOOLBOX.source
    about = {"table": "Robotics Toolbox", "problem": record.title, "source": source}
    about |= _about(score)
    yield _row(about, "declared infeasible [%]", rate, _percent(score, score.all("claims", 0) != 1))
    yield _row(about, "not solved within the limits [%]", None, _percent(score, ~score.solved))
    median = metrics.median_interval(score.seconds)
    yield _row(about, "time, median [µs]", None, [1e6 * seconds for seconds in median])


def _of_fabrik(record: Record) -> Iterator[Row]:
    """Yield the mean and the largest number of iterations of a solver in a stratum."""
    stratum, is_claimed = record.values.stratum, record.measured.get("entrant") is True
    number = published.FABRIK.means.get(record.solver, {}).get(stratum)
    counts = record.values.iterations[~np.isnan(record.values.iterations)]
    about = {
        "record": record,
        "table": "FABRIK",
        "problem": stratum,
        "solver": label(record.solver),
        "targets": counts.size or None,
        "mark": "claimed" * is_claimed if counts.size else "iterations not reported",
        "source": "" if number is None else published.FABRIK.source,
    }
    mean = metrics.mean_interval(counts) if counts.size else ()
    yield _row(about, "iterations, mean", number, mean)
    yield _row(about, "iterations, largest", None, [float(counts.max())] if counts.size else ())


def _percent(score: Score, hits: np.ndarray) -> list[float]:
    """Return a share with its interval [%]; empty for an unfinished solver."""
    if not score.is_finished:
        return []
    share = metrics.share(hits)
    return [100.0 * metrics.ratio(*share[:2]), 100.0 * share.low, 100.0 * share.high]


def _summary(rows: Sequence[Row]) -> Summary:
    complete = [r for r in rows if None not in (r["published"], r.get("measured"))]
    sentence = f"{counted(len(complete), 'published figure')} can be compared with ours."
    return listing(sentence, map(_point, complete))


def _point(row: Row) -> str:
    low, high = (row.get(f"measured, 95 % {bound}") for bound in ("low", "high"))
    interval = "" if low is None else f"{words(low)}–{words(high)}, "
    mark = f", {row['mark']}" if row["mark"] else ""
    return (
        f"{row['problem']}, {row['solver']}: {row['quantity']} {words(row['measured'])} "
        f"({interval}n = {words(row['targets'])}), published {words(row['published'])}{mark}"
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

published_ik = _CAPTIONS.layout("published_ik", _rows, _summary)

LAYOUTS = (published_ik,)
