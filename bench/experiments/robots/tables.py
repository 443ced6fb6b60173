"""Robots: who solves how many targets, how fast, and how far what is claimed is so.

Solvers that make one attempt and those that start again are never in one table: each of the first
five tables exists for either kind.
"""

from collections import Counter
from collections.abc import Sequence
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
from ...presentation.layout import Layout
from ...presentation.results import Results, listed, settings
from ...presentation.tables import Cell, Column, Summary, listing, words
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

    success: Layout
    strata: Layout
    unreachable: Layout
    budgets: Layout
    profiles: Layout


def _robots(results: Results) -> list[Record]:
    """Return a record on each robot."""
    found = [r for kind in KINDS for r in measured(records_of(results, kind))]
    return list({record.title: record for record in found}.values())


models = Layout(
    "On which robots?",
    "robots_list",
    "The robots",
    subjects=_robots,
    columns=(
        titled("robot"),
        Column("joints", read=lambda record: record.facts["joints"]),
        Column("degrees of freedom", read=lambda record: record.facts["freedom"]),
        text("effectors", lambda record: ", ".join(record.facts["tips"])),
        text("wanted of each effector", lambda record: record.facts["wanted"]),
    ),
    shows="Arms are the chains of links that end in the effector, hinges only, with the limits of "
    "their files; continuous joints have two revolutions in either direction. The "
    "character is our own, of balls without and hinges with limits.",
    measured="The arms’ files are those of example-robot-data, without soft limits; every "
    "solver and the evaluation read the same text.",
    summary=lambda robots: Summary(f"{listed([robot.title for robot in robots])}."),
)


class Participant(NamedTuple):
    """A peer and the version that took part, "" if it did not."""

    peer: Peer
    version: str


def _participants(results: Results) -> list[Participant]:
    """Return all peers if any took part."""
    present = {r.solver: r.settings.get("version", "") for r in results.all("ik", task=REACHABLE)}
    return [
        Participant(
            peer, next((present[n] for n in map(peer.called, peer.entries) if n in present), "")
        )
        for peer in (registry.PEERS if present else ())
    ]


def _kinds(peer: Peer) -> str:
    return listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in peer.entries])


who = Layout(
    "Who takes part?",
    "robots_solvers",
    "The solvers",
    subjects=_participants,
    columns=(
        text("solver", lambda one: one.peer.title),
        text("package", lambda one: one.peer.package),
        text("version", lambda one: one.version or "not installed"),
        text("license", lambda one: one.peer.license),
        text("takes", lambda one: one.peer.can),
        text("takes part as", lambda one: _kinds(one.peer)),
    ),
    shows="A solver that makes one attempt is also started again by the bench, from seeded "
    "random poses until it claims an answer within the limits.",
    measured="Settings are the packages’ own but for those in brackets and what their adapters "
    "in bench/peers say.",
    summary=lambda all: Summary(
        f"{sum(bool(one.version) for one in all)} of {len(all)} installed."
    ),
)


def _measured(kind: str, results: Results, task: str = REACHABLE) -> list[Record]:
    return measured(records_of(results, kind, task))


def _how(records: Sequence[Record]) -> str:
    return (
        f"{_MEASURED}within {settings(records, 'tolerance')} m and "
        f"{settings(records, 'tolerance_rotation')} rad, every limit kept to 1e-6 rad."
    )


def success(kind: str) -> Layout:
    """Return how many targets are solved, how soon, and how closely."""
    columns = (
        share("solved, uniform in joint space", partial(_solved, stratum=0)),
        share("solved, all strata within reach", _solved),
        *times("time"),
        *_residuals("position", "m"),
        *_residuals("rotation", "rad"),
        Column("claimed but not so", read=false_claims),
        Column("set-up", "ms", read=lambda record: record.arrays["setup"]),
    )
    return Layout(
        f"With {kind}: how many targets are solved, how soon?",
        f"robots_success_{KINDS[kind]}",
        f"Robots, {kind}: success, time and accuracy",
        subjects=partial(records_of, kind=kind),
        columns=(
            *NAMES,
            *map(_if_measured, columns),
            text("remark", lambda record: record.notes.get("remark", "")),
        ),
        shows="Times are of all targets within reach, those that failed included. Residuals "
        "are of those solved, not cut off at the tolerance. “Claimed but not so” counts "
        "answers that the solver calls solved and the evaluation does not. A solver that runs "
        "out of time has fewer targets; all have them in one order, the strata alternating.",
        measured=_how,
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


def strata(kind: str) -> Layout:
    """Return how many targets are solved in each stratum."""
    return Layout(
        f"With {kind}: which targets are hard?",
        f"robots_strata_{KINDS[kind]}",
        f"Robots, {kind}: success in each stratum",
        subjects=partial(_measured, kind),
        columns=_strata_columns,
        shows="Targets from random poses within the limits. Space: the effector spread evenly over "
        "the cells of a grid; outer shell and near the root: the twentieth of the poses whose "
        "effector is farthest from and nearest to the first joint; near singular: the twentieth "
        "with the smallest least singular value of the Jacobian; at a limit: one joint put at "
        "one of its limits.",
        measured=_how,
        summary=_strata_summary,
    )


def _strata_columns(records: Sequence[Record]) -> tuple[Column, ...]:
    names = records[0].facts["strata"] if records else []
    return (*NAMES, *(share(name, partial(_solved, stratum=i)) for i, name in enumerate(names)))


def _strata_summary(records: Sequence[Record]) -> Summary:
    names = records[0].facts["strata"]
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


def unreachable(kind: str) -> Layout:
    """Return what becomes of targets out of reach."""
    return Layout(
        f"With {kind}: what happens out of reach?",
        f"robots_unreachable_{KINDS[kind]}",
        f"Robots, {kind}: targets out of reach",
        subjects=partial(_measured, kind, task=UNREACHABLE),
        columns=(
            *NAMES,
            Column("targets", read=lambda record: record.arrays["solved"].size),
            Column("claimed as solved", read=false_claims),
            *times("time"),
            *places("distance left", "m", (MEDIAN, LARGEST), _distances_left),
            Column("answers", read=lambda record: _left(record).size),
        ),
        shows="Targets farther from the first joint than all links in a row reach. What counts "
        "is how soon a solver gives up, and that it claims nothing.",
        measured=_how,
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


def budgets(kind: str) -> Layout:
    """Return how many targets are solved within an equal time."""
    return Layout(
        f"With {kind}: who is ahead at an equal budget?",
        f"robots_budget_{KINDS[kind]}",
        f"Robots, {kind}: solved within an equal budget of time",
        subjects=partial(_measured, kind),
        columns=(
            *NAMES,
            *(
                Column(f"within {_duration(budget)}", "%", read=at(i, _within_budgets))
                for i, budget in enumerate(BUDGETS)
            ),
        ),
        shows="Share of the targets within reach that are solved within so much time for each.",
        measured=_how,
        summary=_leaders,
        figures=(figures.budgets(kind),),
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


class Profile(NamedTuple):
    """The performance profile of a solver on a robot."""

    robot: str
    solver: str
    curve: np.ndarray
    records: list[Record]


def _profiles(kind: str, results: Results) -> list[Profile]:
    records = records_of(results, kind)
    return [
        Profile(robot, solver, curve, records)
        for robot, curves in profiles(records, RATIOS).items()
        for solver, curve in curves.items()
    ]


def profile(kind: str) -> Layout:
    """Return how many targets are solved within some times the time of the fastest."""
    return Layout(
        f"With {kind}: who is the fastest, how often?",
        f"robots_profile_{KINDS[kind]}",
        f"Robots, {kind}: performance profiles",
        subjects=partial(_profiles, kind),
        columns=(
            text("robot", lambda row: row.robot),
            text("solver", lambda row: row.solver),
            *(
                Column(f"within {words(x)} times the fastest", "%", read=at(i, _curve))
                for i, x in enumerate(RATIOS.tolist())
            ),
        ),
        shows="Share of the targets, among those within reach that any of these solvers "
        "solves, that a solver solves within so many times the time of the fastest on that "
        "target (Dolan and Moré 2002).",
        measured=lambda rows: (
            f"{_how(rows[0].records if rows else [])} The targets are those that "
            "all solvers shown were given; a solver given less than an eighth of them is left out."
        ),
        summary=_profile_summary,
        figures=(figures.profiles(kind),),
    )


def _curve(row: Profile) -> np.ndarray:
    return row.curve


def _profile_summary(rows: Sequence[Profile]) -> Summary:
    """Say who is the fastest most often, robot by robot."""
    first: dict[str, Profile] = {}
    for row in rows:
        if row.robot not in first or row.curve[0] > first[row.robot].curve[0]:
            first[row.robot] = row
    return Summary(
        "Most often the fastest:",
        tuple(
            f"{robot}: {row.solver}, on {words_in(float(row.curve[0]), '%')} of the targets"
            for robot, row in first.items()
        ),
    )


def _duration(seconds: float) -> str:
    return words_in(seconds, "µs" if seconds < 1e-3 else "ms")


OF_KIND = {
    kind: Tables(success(kind), strata(kind), unreachable(kind), budgets(kind), profile(kind))
    for kind in KINDS
}
LAYOUTS = (who, models, *(layout for made in OF_KIND.values() for layout in made))
