"""Published tables, and the same set-up here."""

from functools import partial
from typing import NamedTuple

from ...harness import metrics
from ...harness.record import Record
from ...presentation.columns import effort, places, spread_of, text, words_in
from ...presentation.entry import Entry
from ...presentation.results import Results, label, settings
from ...presentation.tables import (
    INTERVAL,
    Column,
    Summary,
    Table,
    in_unit,
    listing,
    tabulate,
    words,
)
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published

HERE = "here"


class Rate(NamedTuple):
    """A success rate on a robot [%] and the times of a solve [ms], published or measured here."""

    robot: str
    solver: str
    source: str
    solved: metrics.Share | None = None
    percent: float | None = None
    median: float | None = None
    mean: float | None = None


def trac_ik(results: Results) -> Table:
    """Return TRAC-IK's table, and what the solvers do here."""
    here = [_measured_rate(record) for record in results.all("ik", task=TRAC_IK)]
    robots = {rate.robot for rate in here}
    rates = [
        Rate(r.robot, r.solver, r.source, percent=r.percent, mean=r.milliseconds)
        for r in published.TRAC_IK
        if r.robot in robots
    ]
    order = list(dict.fromkeys(rate.robot for rate in published.TRAC_IK))
    return tabulate(
        "published_trac_ik",
        "TRAC-IK’s published table, and here",
        (
            text("robot", lambda rate: rate.robot),
            text("solver", lambda rate: rate.solver),
            text("from", lambda rate: rate.source),
            Column("solved", note=INTERVAL, read=lambda rate: rate.solved),
            Column("solved", "%", read=lambda rate: rate.percent, factor=1.0),
            Column("time, median", "ms", read=lambda rate: rate.median, factor=1.0),
            Column("time, mean", "ms", read=lambda rate: rate.mean, factor=1.0),
        ),
        sorted([*rates, *here], key=lambda rate: order.index(rate.robot)),
        shows="Full poses at 1e-5 m and rad in each of six components, every search from the "
        "middle of the limits, at most 5 ms for TRAC-IK; times of all targets, those that failed "
        "included.",
        measured="Published: 10,000 reachable random poses on a machine of its time. Here: as many "
        "of our own as the column says, evaluated by MuJoCo at the norm of three such components; "
        "the PR2’s continuous joints have two revolutions in either direction.",
        summary=lambda rates: listing(
            "Here:",
            (
                f"{rate.robot}, {rate.solver}: {words(rate.solved)}, mean {words(rate.mean)} ms"
                for rate in rates
                if rate.solved
            ),
        ),
    )


def _measured_rate(record: Record) -> Rate:
    if "solved" not in record.arrays:
        return Rate(record.facts["robot"], record.solver, record.notes.get("remark", ""))
    share = metrics.share(record.arrays["solved"])
    median, _, mean = effort(record)
    return Rate(
        record.facts["robot"],
        record.solver,
        HERE,
        share,
        metrics.percent(share.hits, share.total),
        in_unit(median, "ms"),
        in_unit(mean, "ms"),
    )


def toolbox(results: Results) -> Table:
    """Return the Robotics Toolbox's table of one search, and what the solvers do here."""
    return tabulate(
        "published_toolbox",
        "The Robotics Toolbox tutorial’s table of one search, and here",
        (
            text("solver", lambda record: record.solver),
            Column("published, infeasible", "%", read=_published_rate, factor=1.0),
            Column("here, by its own word", "%", read=_unclaimed),
            Column("here, not solved within the limits", note=INTERVAL, read=_failed),
            *places("time", "µs", ("median",), effort),
        ),
        [r for r in results.all("ik", task=TOOLBOX) if "solved" in r.arrays],
        shows="UR5, random poses and starts, one search of at most "
        f"{words(published.TOOLBOX_ITERATIONS)} iterations; infeasible is what the search does not "
        "solve. The published searches look at no limits, nor do the toolbox’s here; the last "
        "share counts answers beyond the limits as not solved.",
        measured="Published: 10,000 poses, the tutorial’s own Python loops (Haviland and Corke "
        "2022). Here the toolbox’s compiled ones, and ours; half the squared error within "
        f"{words(published.TOOLBOX_HALF_SQUARE)}.",
        summary=lambda records: Summary(
            "Not solved by one search:", tuple(map(_said_of_search, records))
        ),
    )


def _published_rate(record: Record) -> float | None:
    return record.facts.get("infeasible")


def _unclaimed(record: Record) -> float:
    share = metrics.share(record.arrays["claimed"] != 1)
    return metrics.ratio(share.hits, share.total)


def _failed(record: Record) -> metrics.Share:
    return metrics.share(~record.arrays["solved"])


def _said_of_search(record: Record) -> str:
    before = _published_rate(record)
    beside = "" if before is None else f", published {words(before)} %"
    own = words_in(_unclaimed(record), "%")
    return f"{record.solver}: {own} infeasible by its own word{beside}; {words(_failed(record))}"


def fabrik(results: Results) -> Table:
    """Return table 1 of the paper on FABRIK, and our iterations."""
    records = results.all("ik", task=FABRIK)
    by = {(record.solver, record.facts["stratum"]): record for record in records}
    return tabulate(
        "published_fabrik",
        "Iterations in the paper on FABRIK, and here",
        (
            text("solver", label),
            *(
                Column(f"{stratum}, {what}", read=partial(read, by, stratum))
                for stratum in published.FABRIK_DISTANCES
                for what, read in (
                    ("published, mean", _published_count),
                    ("here, mean", _mean_count),
                    ("here, largest", _largest_count),
                )
            ),
        ),
        dict.fromkeys(record.solver for record in records),
        shows="Iterations for one target, ten joints, no limits. Here a target out of reach is "
        "recognised as such by geometry where the chain is straight.",
        measured="Published: Aristidou and Lasenby 2011, table 1, 20 runs, MATLAB, read in a "
        "secondary source; chain, target and tolerance are not stated there. Here a guess: "
        f"{published.FABRIK_LINKS} links of 0.1 m from straight, {published.FABRIK_RUNS} seeded "
        f"directions, targets at {' and '.join(map(str, published.FABRIK_DISTANCES.values()))} m, "
        f"to {settings(records, 'tolerance')} m.",
        summary=lambda solvers: Summary(
            "Mean iterations towards a reachable target:",
            tuple(
                f"{label(solver)}: {words(_mean_count(by, NEAR, solver))} here, "
                f"{words(_published_count(by, NEAR, solver))} published"
                for solver in solvers
            ),
        ),
    )


NEAR = next(iter(published.FABRIK_DISTANCES))
ByStratum = dict[tuple[str, str], Record]


def _published_count(_: ByStratum, stratum: str, solver: str) -> float | None:
    counts = published.FABRIK.get(solver)
    return None if counts is None else counts[list(published.FABRIK_DISTANCES).index(stratum)]


def _mean_count(by: ByStratum, stratum: str, solver: str) -> float | None:
    record = by.get((solver, stratum))
    return None if record is None else metrics.mean(record.arrays["iterations"])


def _largest_count(by: ByStratum, stratum: str, solver: str) -> float | None:
    record = by.get((solver, stratum))
    return None if record is None else spread_of(record, "iterations")[2]


ENTRIES = (
    Entry("What did TRAC-IK’s authors measure, and what do we?", trac_ik),
    Entry("And those of the Robotics Toolbox?", toolbox),
    Entry("And those of FABRIK?", fabrik),
)
