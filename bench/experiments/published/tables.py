"""Published tables, and the same set-up here."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, label, settings
from ...tables.columns import (
    claimed,
    effort,
    iterations_said,
    places,
    spread_of_iterations,
    text,
    words_in,
)
from ...tables.layout import Layout
from ...tables.table import INTERVAL, Cell, Column, Summary, in_unit, listing, words
from ..robots.readings import RULE, cut, solved, total
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
    mark: str = ""


def _rates(results: Results) -> list[Rate]:
    """Return the rates published for the robots at hand, and then ours, robot by robot."""
    here = [_measured_rate(record) for record in results.all("ik", task=TRAC_IK)]
    robots = {rate.robot for rate in here}
    rates = [
        Rate(r.robot, r.solver, r.source, percent=r.percent, mean=r.milliseconds)
        for r in published.TRAC_IK
        if r.robot in robots
    ]
    order = [rate.robot for rate in published.TRAC_IK]
    return sorted([*rates, *here], key=lambda rate: order.index(rate.robot))


def _measured_rate(record: Record) -> Rate:
    if "solved" not in record.arrays:
        return Rate(record.facts["robot"], record.solver, record.notes.get("remark", ""))
    share = metrics.share(solved(record))
    median, _, mean = effort(record)
    return Rate(
        record.facts["robot"],
        record.solver,
        HERE,
        share,
        in_unit(metrics.ratio(share.hits, share.total), "%"),
        in_unit(median, "ms"),
        in_unit(mean, "ms"),
        cut(record),
    )


def _published_rate(record: Record) -> float | None:
    return record.facts.get("infeasible")


def _unclaimed(record: Record) -> float:
    """Return the share of all targets that a search does not call solved, begun or not."""
    return 1.0 - metrics.ratio(float(np.sum(record.arrays["claimed"] == 1)), total(record))


def _failed(record: Record) -> metrics.Share:
    return metrics.share(~solved(record))


def _said_of_search(record: Record) -> str:
    before = _published_rate(record)
    beside = "" if before is None else f", published {words(before)} %"
    own = words_in(_unclaimed(record), "%")
    marked = f", {cut(record)}" if cut(record) else ""
    said = f"{own} infeasible by its own word{beside}; {words(_failed(record))}{marked}"
    return f"{record.solver}: {said}"


trac_ik = Layout(
    "What did TRAC-IK’s authors measure, and what do we?",
    "published_trac_ik",
    "TRAC-IK’s published table, and here",
    columns=(
        text("robot", lambda rate: rate.robot),
        text("solver", lambda rate: rate.solver),
        text("from", lambda rate: rate.source),
        Column("solved", "%", read=lambda rate: rate.percent, factor=1.0),
        Column("time, mean", "ms", read=lambda rate: rate.mean, factor=1.0),
        text("mark", lambda rate: rate.mark),
        replace(Column("solved", note=INTERVAL, read=lambda rate: rate.solved), folded=True),
        replace(
            Column("time, median", "ms", read=lambda rate: rate.median, factor=1.0), folded=True
        ),
    ),
    ranked=lambda rate: not rate.mark,
    subjects=_rates,
    shows=f"Full poses at {words(published.TRAC_IK_TOLERANCE)} m and rad in each of 6 components, "
    "every search from the middle of the limits, at most 5 ms for TRAC-IK; times of all targets, "
    f"those that failed included. {RULE}",
    measured="Published: 10,000 reachable random poses on a machine of its time. Here: as many "
    "of our own as the column says, evaluated by MuJoCo at the norm of three such components; "
    "the PR2’s continuous joints have two revolutions in either direction.",
    summary=lambda rates: listing(
        "Here:",
        (
            f"{rate.robot}, {rate.solver}: {words(rate.solved)}, mean {words(rate.mean)} ms"
            f"{', ' if rate.mark else ''}{rate.mark}"
            for rate in rates
            if rate.solved
        ),
    ),
)


toolbox = Layout(
    "And those of the Robotics Toolbox?",
    "published_toolbox",
    "The Robotics Toolbox tutorial’s table of one search, and here",
    subjects=lambda results: [r for r in results.all("ik", task=TOOLBOX) if "solved" in r.arrays],
    columns=(
        text("solver", lambda record: record.solver),
        Column("published, infeasible", "%", read=_published_rate, factor=1.0),
        Column("here, by its own word", "%", read=_unclaimed),
        Column("here, not solved within the limits", note=INTERVAL, read=_failed),
        *places("time", "µs", ("median",), effort),
        text("mark", cut),
    ),
    shows="UR5, random poses and starts, one search of at most "
    f"{words(published.TOOLBOX_ITERATIONS)} iterations; infeasible is what the search does not "
    "solve. The published searches look at no limits, nor do the toolbox’s here; the last "
    f"share counts answers beyond the limits as not solved. {RULE}",
    measured="Published: 10,000 poses, the tutorial’s own Python loops (Haviland and Corke "
    f"2022, {published.TOOLBOX_SOURCE}; the rates of its other commits differ by some tenths). "
    "Here the toolbox’s compiled ones, and ours; half the squared error within "
    f"{words(published.TOOLBOX_HALF_SQUARE)}.",
    summary=lambda records: Summary(
        "Not solved by one search:", tuple(map(_said_of_search, records))
    ),
)


NEAR = next(iter(published.FABRIK_DISTANCES))


class Counted(NamedTuple):
    """The iterations of a solver in the set-up of the paper on FABRIK, by stratum."""

    solver: str
    here: dict[str, Record]

    def published(self, stratum: str) -> float | None:
        """Return the mean of the paper."""
        counts = published.FABRIK.get(self.solver, (None, None))
        return counts[list(published.FABRIK_DISTANCES).index(stratum)]

    def mean(self, stratum: str) -> Cell:
        """Return the mean here."""
        here = self.here.get(stratum)
        said = np.zeros(0) if here is None else iterations_said(here)
        return claimed(metrics.mean(said), here) if here is not None and said.size else None

    def largest(self, stratum: str) -> Cell:
        """Return the largest number here."""
        here = self.here.get(stratum)
        return None if here is None else spread_of_iterations(here)[2]


def _counted(results: Results) -> list[Counted]:
    records = results.all("ik", task=FABRIK)
    by: dict[str, dict[str, Record]] = {}
    for record in records:
        by.setdefault(record.solver, {})[record.facts["stratum"]] = record
    return [Counted(solver, here) for solver, here in by.items()]


def _fabrik_columns(stratum: str) -> tuple[Column, ...]:
    return (
        Column(f"{stratum}, published, mean", read=lambda counted: counted.published(stratum)),
        Column(f"{stratum}, here, mean", read=lambda counted: counted.mean(stratum)),
        Column(f"{stratum}, here, largest", read=lambda counted: counted.largest(stratum)),
    )


def _fabrik_summary(solvers: Sequence[Counted]) -> Summary:
    return Summary(
        "Mean iterations towards a reachable target:",
        tuple(
            f"{label(one.solver)}: {_mean_in_words(one)} here, "
            f"{words(one.published(NEAR))} published"
            for one in solvers
        ),
    )


def _mean_in_words(counted: Counted) -> str:
    if NEAR not in counted.here:
        return words(None)
    counts = iterations_said(counted.here[NEAR])
    if not counts.size:
        return "iterations unsaid"
    mean, low, high = metrics.mean_interval(counts)
    interval = "" if np.isnan(low) else f"{words(low)}–{words(high)}, "
    written = claimed(words(mean), counted.here[NEAR])
    return f"{written} ({interval}n = {words(counts.size)})"


fabrik = Layout(
    "And those of FABRIK?",
    "published_fabrik",
    "Iterations in the paper on FABRIK, and here",
    subjects=_counted,
    columns=(
        text("solver", lambda counted: label(counted.solver)),
        *(column for stratum in published.FABRIK_DISTANCES for column in _fabrik_columns(stratum)),
    ),
    shows="Iterations for one target, ten joints, no limits. Here a target out of reach is "
    "recognised as such by geometry where the chain is straight.",
    measured=lambda solvers: (
        "Published: Aristidou and Lasenby 2011, table 1, 20 runs, MATLAB, read in a "
        "secondary source; chain, target and tolerance are not stated there. Here a guess: "
        f"{published.FABRIK_LINKS} links of {published.FABRIK_LENGTH} m from straight, "
        f"{published.FABRIK_RUNS} seeded directions, targets at "
        f"{' and '.join(map(str, published.FABRIK_DISTANCES.values()))} m, "
        f"to {settings((r for one in solvers for r in one.here.values()), 'tolerance')} m."
    ),
    summary=_fabrik_summary,
)


LAYOUTS = (trac_ik, toolbox, fabrik)
