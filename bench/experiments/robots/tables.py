"""Robots: who solves how many targets, how fast, and how far what is claimed is so.

Solvers that make one attempt and those that start again are never in one table: each of the first
five tables exists for either kind.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...peers.registry import Peer
from ...presentation.columns import (
    LARGEST,
    MEDIAN,
    at,
    effort,
    places,
    share,
    text,
    times,
    titled,
    words_in,
)
from ...presentation.entry import Entry
from ...presentation.results import Results, listed, settings
from ...presentation.tables import Cell, Column, Summary, Table, listing, tabulate, words
from . import REACHABLE, UNREACHABLE, figures
from .readings import KINDS, budget_curve, budget_curves, by_robot, measured, profiles, records_of

# Shares of the targets are shown for these budgets [s] and these ratios to the fastest.
BUDGETS = np.array([1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 1e-1])
RATIOS = np.array([1.0, 2.0, 5.0, 10.0, 100.0, 1000.0])
_MEASURED = (
    "Every solver has the same text of the robot, the same targets and the same seeded random "
    "starts. It works in a process of its own, on one core (TRAC-IK on two), and is timed target "
    "by target, as in a loop of solves: after the target before, solved again without counting "
    "where that takes less than a millisecond; conversions are left out. What it returns is "
    "evaluated by MuJoCo’s kinematics of the same text. TRAC-IK’s limits of time pass sooner on a "
    "busy machine. Solved means: "
)
NAMES = (titled("robot"), text("solver", lambda record: record.solver))


class Tables(NamedTuple):
    """The tables that exist for either kind."""

    success: Callable[[Results], Table]
    strata: Callable[[Results], Table]
    unreachable: Callable[[Results], Table]
    budgets: Callable[[Results], Table]
    profiles: Callable[[Results], Table]


def models(results: Results) -> Table:
    """Return the robots and what is asked of them."""
    one = {r.title: r for kind in KINDS for r in measured(records_of(results, kind))}
    return tabulate(
        "robots_list",
        "The robots",
        (
            titled("robot"),
            Column("joints", read=lambda record: record.facts["joints"]),
            Column("degrees of freedom", read=lambda record: record.facts["freedom"]),
            text("tips", lambda record: ", ".join(record.facts["tips"])),
            text("wanted of each tip", lambda record: record.facts["wanted"]),
        ),
        one.values(),
        shows="Arms are the chains of links that end in the tip, hinges alone, with the limits of "
        "their files; continuous joints have two revolutions in either direction. The "
        "character is our own, of balls without and hinges with limits.",
        measured="The arms’ files are those of example-robot-data, without soft limits; every "
        "solver and the evaluation read the same text.",
        summary=lambda _: Summary(f"{listed(list(one))}."),
    )


def who(results: Results) -> Table:
    """Return the solvers that take part."""
    present = {r.solver: r.settings.get("version") for r in results.all("ik", task=REACHABLE)}

    def version(peer: Peer) -> str:
        found = [present[name] for name in map(peer.called, peer.entries) if name in present]
        return next(iter(found), "") or "not installed"

    def installed(peers: Sequence[Peer]) -> Summary:
        count = sum(version(peer) != "not installed" for peer in peers)
        return Summary(f"{count} of {len(peers)} installed.")

    return tabulate(
        "robots_solvers",
        "The solvers",
        (
            text("solver", lambda peer: peer.title),
            text("package", lambda peer: peer.package),
            text("version", version),
            text("license", lambda peer: peer.license),
            text("takes", lambda peer: peer.can),
            text("takes part as", _kinds),
        ),
        registry.PEERS if present else (),
        shows="A solver that makes one attempt is also started again by the bench, from seeded "
        "random poses until it claims an answer within the limits.",
        measured="Settings are the packages’ own but for those in brackets and what their adapters "
        "in bench/peers say.",
        summary=installed,
    )


def _kinds(peer: Peer) -> str:
    return listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in peer.entries])


def _how(records: Sequence[Record]) -> str:
    return (
        f"{_MEASURED}within {settings(records, 'tolerance')} m and "
        f"{settings(records, 'tolerance_rotation')} rad, every limit kept to 1e-6 rad."
    )


def success(kind: str, results: Results) -> Table:
    """Return how many targets are solved, how soon, and how closely."""
    records = records_of(results, kind)
    columns = (
        share("solved, uniform in joint space", partial(_solved, stratum=0)),
        share("solved, all strata within reach", _solved),
        *times("time"),
        *_residuals("position", "m"),
        *_residuals("rotation", "rad"),
        Column("claimed but not so", read=false_claims),
        Column("set-up", "ms", read=lambda record: record.arrays["setup"]),
    )
    return tabulate(
        f"robots_success_{KINDS[kind]}",
        f"Robots, {kind}: success, time and accuracy",
        (
            *NAMES,
            *map(_if_measured, columns),
            text("remark", lambda record: record.notes.get("remark", "")),
        ),
        records,
        shows="Times are of all targets within reach, those that failed included. Residuals "
        "are of those solved, not cut off at the tolerance. “Claimed but not so” counts "
        "answers that the solver calls solved and the evaluation does not. A solver that runs "
        "out of time has fewer targets; all have them in one order, the strata alternating.",
        measured=_how(records),
        summary=_success_summary,
    )


def _if_measured(column: Column) -> Column:
    """Return the column, empty for a record without targets."""
    return replace(column, read=lambda r: column.read(r) if "solved" in r.arrays else None)


def _solved(record: Record, stratum: int | None = None) -> np.ndarray:
    solved = record.arrays["solved"]
    return solved if stratum is None else solved[record.arrays["stratum"] == stratum]


def _residuals(name: str, unit: str) -> list[Column]:
    def read(record: Record) -> Sequence[Cell]:
        values = record.arrays[name][record.arrays["solved"]]
        return metrics.spread(values) if values.size else (None, None, None)

    return places(f"{name} residual", unit, (MEDIAN, LARGEST), read)


def false_claims(record: Record) -> int | None:
    """Return how many claims the evaluation denies; None if the solver makes none."""
    claimed = record.arrays["claimed"]
    if not any(claimed >= 0):
        return None
    return int(np.count_nonzero((claimed == 1) & ~record.arrays["solved"]))


def _success_summary(records: Sequence[Record]) -> Summary:
    return listing(
        "Solved within reach, and the median time of all:",
        (f"{name}: {'; '.join(map(_rate, mine))}" for name, mine in by_robot(records).items()),
    )


def _rate(record: Record) -> str:
    solved = metrics.share(record.arrays["solved"])
    median = effort(record).median
    rate = words_in(metrics.ratio(solved.hits, solved.total), "%")
    return f"{record.solver} {rate} in {words_in(median, 'µs')}"


def strata(kind: str, results: Results) -> Table:
    """Return how many targets are solved in each stratum."""
    records = measured(records_of(results, kind))
    names = records[0].facts["strata"] if records else []
    return tabulate(
        f"robots_strata_{KINDS[kind]}",
        f"Robots, {kind}: success in each stratum",
        (*NAMES, *(share(name, partial(_solved, stratum=i)) for i, name in enumerate(names))),
        records,
        shows="Targets from random poses within the limits. Space: the tip spread evenly over "
        "the cells of a grid; outer shell and near the root: the twentieth of the poses whose "
        "tip is farthest from and nearest to the first joint; near singular: the twentieth "
        "with the smallest least singular value of the Jacobian; at a limit: one joint put at "
        "one of its limits.",
        measured=_how(records),
        summary=partial(_strata_summary, names),
    )


def _strata_summary(names: Sequence[str], records: Sequence[Record]) -> Summary:
    hardest = Counter(name for record in records if (name := _hardest(record, names)))
    if not hardest:
        return Summary("No stratum is harder than the others to any solver.")
    counts = [f"{name} ({count})" for name, count in hardest.most_common()]
    return Summary(f"Hardest, counted over solvers and robots: {listed(counts)}.")


def _hardest(record: Record, names: Sequence[str]) -> str:
    """Return the stratum in which the fewest targets are solved, "" if all are alike."""
    shares = [metrics.share(_solved(record, i)) for i in range(len(names))]
    rates = [metrics.ratio(share.hits, share.total) for share in shares]
    return names[int(np.argmin(rates))] if rates and min(rates) < max(rates) else ""


def unreachable(kind: str, results: Results) -> Table:
    """Return what becomes of targets out of reach."""
    records = measured(records_of(results, kind, UNREACHABLE))
    return tabulate(
        f"robots_unreachable_{KINDS[kind]}",
        f"Robots, {kind}: targets out of reach",
        (
            *NAMES,
            Column("targets", read=lambda record: record.arrays["solved"].size),
            Column("claimed as solved", read=false_claims),
            *times("time"),
            *places("distance left", "m", (MEDIAN, LARGEST), _distances_left),
            Column("answers", read=lambda record: _left(record).size),
        ),
        records,
        shows="Targets farther from the first joint than all links in a row reach. What counts "
        "is how soon a solver gives up, and that it claims nothing.",
        measured=_how(records),
        summary=_unreachable_summary,
    )


def _left(record: Record) -> np.ndarray:
    return record.arrays["position"][np.isfinite(record.arrays["position"])]


def _distances_left(record: Record) -> Sequence[Cell]:
    left = _left(record)
    return metrics.spread(left) if left.size else (None, None, None)


def _unreachable_summary(records: Sequence[Record]) -> Summary:
    claimed = [record for record in records if false_claims(record)]
    if not claimed:
        return Summary("No solver claims a target that is out of reach.")
    points = (
        f"{r.title}, {r.solver}: {words(false_claims(r))} of {words(r.arrays['solved'].size)}"
        for r in claimed
    )
    return Summary("Claimed though out of reach:", tuple(points))


def budgets(kind: str, results: Results) -> Table:
    """Return how many targets are solved within an equal time."""
    records = measured(records_of(results, kind))
    return tabulate(
        f"robots_budget_{KINDS[kind]}",
        f"Robots, {kind}: solved within an equal budget of time",
        (
            *NAMES,
            *(
                Column(f"within {_duration(budget)}", "%", read=at(i, _within_budgets))
                for i, budget in enumerate(BUDGETS)
            ),
        ),
        records,
        shows="Share of the targets within reach that are solved within so much time for each.",
        measured=_how(records),
        summary=_leaders,
    )


def _within_budgets(record: Record) -> np.ndarray:
    return budget_curve(record, BUDGETS)


def _leaders(records: Sequence[Record]) -> Summary:
    """Say who is ahead at each budget, robot by robot."""
    curves = budget_curves(records, BUDGETS)
    return Summary("Ahead:", tuple(f"{name}: {_ahead(of)}" for name, of in curves.items()))


def _ahead(curves: dict[str, np.ndarray]) -> str:
    leaders = [max(curves, key=lambda solver: curves[solver][i]) for i in range(len(BUDGETS))]
    return "; ".join(
        f"within {_duration(budget)} {solver} ({words_in(float(curves[solver][i]), '%')})"
        for i, (budget, solver) in enumerate(zip(BUDGETS, leaders, strict=True))
        if curves[solver][i] > 0
    )


def profile(kind: str, results: Results) -> Table:
    """Return how many targets are solved within some times the time of the fastest."""
    records = records_of(results, kind)
    made = profiles(records, RATIOS)
    return tabulate(
        f"robots_profile_{KINDS[kind]}",
        f"Robots, {kind}: performance profiles",
        (
            text("robot", lambda row: row[0]),
            text("solver", lambda row: row[1]),
            *(
                Column(f"within {words(x)} times the fastest", "%", read=at(i, _curve))
                for i, x in enumerate(RATIOS.tolist())
            ),
        ),
        [(robot, *one) for robot, curves in made.items() for one in curves.items()],
        shows="Share of the targets, among those within reach that any of these solvers "
        "solves, that a solver solves within so many times the time of the fastest on that "
        "target (Dolan and Moré 2002).",
        measured=f"{_how(records)} The targets are those that all solvers shown were given; a "
        "solver given less than an eighth of them is left out.",
        summary=lambda _: Summary(
            "Most often the fastest:",
            tuple(f"{robot}: {_fastest(curves)}" for robot, curves in made.items()),
        ),
    )


def _curve(row: tuple[str, str, np.ndarray]) -> np.ndarray:
    return row[2]


def _fastest(curves: dict[str, np.ndarray]) -> str:
    first = max(curves, key=lambda solver: curves[solver][0])
    return f"{first}, on {words_in(float(curves[first][0]), '%')} of the targets"


def _duration(seconds: float) -> str:
    return words_in(seconds, "µs" if seconds < 1e-3 else "ms")


MAKERS = (success, strata, unreachable, budgets, profile)
TABLES = {kind: Tables(*(partial(make, kind) for make in MAKERS)) for kind in KINDS}


def _entries(kind: str) -> tuple[Entry, ...]:
    """Return the entries that exist for either kind of solver."""
    made = TABLES[kind]
    solved_in_time, against_fastest = figures.budgets(kind), figures.profiles(kind)
    return (
        Entry(f"With {kind}: how many targets are solved, how soon?", made.success),
        Entry(f"With {kind}: which targets are hard?", made.strata),
        Entry(f"With {kind}: what happens out of reach?", made.unreachable),
        Entry(f"With {kind}: who is ahead at an equal budget?", made.budgets, (solved_in_time,)),
        Entry(f"With {kind}: who is the fastest, how often?", made.profiles, (against_fastest,)),
    )


ENTRIES = (
    Entry("Who takes part?", who),
    Entry("On which robots?", models),
    *(entry for kind in KINDS for entry in _entries(kind)),
)
