"""Robots: who solves how many targets, how fast, and how far what is claimed is so.

Solvers that make one attempt and those that start again are never in one table: each of the first
five tables exists for either kind.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...peers.registry import ONE_START, RESTARTS
from ...presentation.results import Results, listed, settings
from ...presentation.tables import INTERVAL, Cell, Column, Summary, Table, words
from . import REACHABLE, UNREACHABLE

KINDS = {ONE_START: "one_start", RESTARTS: "restarts"}
# Shares of the targets are shown for these budgets [s] and these ratios to the fastest.
BUDGETS = np.array([1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 1e-1])
RATIOS = np.array([1.0, 2.0, 5.0, 10.0, 100.0, 1000.0])
# A solver that was given less than this part of the targets, an eighth, is in no profile.
ENOUGH = 8
_MEASURED = (
    "Every solver has the same text of the robot, the same targets and the same seeded random "
    "starts. It works in a process of its own, on one core (TRAC-IK on two), and is timed target "
    "by target, as in a loop of solves: after the target before, solved again without counting "
    "where that takes less than a millisecond; conversions are left out. What it returns is "
    "evaluated by MuJoCo’s kinematics of the same text. TRAC-IK’s limits of time pass sooner on a "
    "busy machine. Solved means: "
)


class Tables(NamedTuple):
    """The tables that exist for either kind."""

    success: Callable[[Results], Table]
    strata: Callable[[Results], Table]
    unreachable: Callable[[Results], Table]
    budgets: Callable[[Results], Table]
    profiles: Callable[[Results], Table]


def records_of(results: Results, kind: str, task: str = REACHABLE) -> list[Record]:
    """Return the records on robots of one kind, robot by robot."""
    wanted = [r for r in results.all("ik", task=task) if r.settings.get("kind") in (kind, "any")]
    order = list(dict.fromkeys(record.title for record in wanted if "solved" in record.arrays))
    order += [name for name in (record.title for record in wanted) if name not in order]
    return sorted(wanted, key=lambda record: order.index(record.title))


def measured(records: Sequence[Record]) -> list[Record]:
    """Return the records with targets in them."""
    return [record for record in records if "solved" in record.arrays]


def models(results: Results) -> Table:
    """Return the robots and what is asked of them."""
    one = {r.title: r.facts for kind in KINDS for r in measured(records_of(results, kind))}
    rows = [
        (robot, of["joints"], of["freedom"], ", ".join(of["tips"]), of["wanted"])
        for robot, of in one.items()
    ]
    return Table(
        "robots_list",
        "The robots",
        (
            Column("robot", words=True),
            Column("joints"),
            Column("degrees of freedom"),
            Column("tips", words=True),
            Column("wanted of each tip", words=True),
        ),
        tuple(rows),
        shows="Arms are the chains of links that end in the tip, hinges alone, with the limits of "
        "their files; continuous joints have two revolutions in either direction. The "
        "character is our own, of balls without and hinges with limits.",
        measured="The arms’ files are those of example-robot-data, without soft limits; every "
        "solver and the evaluation read the same text.",
        summary=Summary(f"{listed([str(row[0]) for row in rows])}.") if rows else Summary(),
    )


def who(results: Results) -> Table:
    """Return the solvers that take part."""
    present = {r.solver: r for r in results.all("ik", task=REACHABLE)}
    rows: list[tuple[Cell, ...]] = []
    for peer in registry.PEERS if present else ():
        versions = [
            present[peer.called(entry)].settings.get("version", "")
            for entry in peer.entries if peer.called(entry) in present
        ]  # fmt: skip
        version = next(iter(versions), "")
        kinds = listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in peer.entries])
        rows.append(
            (peer.title, peer.package, version or "not installed", peer.license, peer.can, kinds)
        )
    return Table(
        "robots_solvers",
        "The solvers",
        tuple(
            Column(title, words=True)
            for title in ("solver", "package", "version", "license", "takes", "takes part as")
        ),
        tuple(rows),
        shows="A solver that makes one attempt is also started again by the bench, from seeded "
        "random poses until it claims an answer within the limits.",
        measured="Settings are the packages’ own but for those in brackets and what their adapters "
        "in bench/peers say.",
        summary=Summary(
            f"{sum(row[2] != 'not installed' for row in rows)} of {len(rows)} installed."
        )
        if rows
        else Summary(),
    )


def _success(kind: str) -> Callable[[Results], Table]:
    def table(results: Results) -> Table:
        records = records_of(results, kind)
        return Table(
            f"robots_success_{KINDS[kind]}",
            f"Robots, {kind}: success, time and accuracy",
            (
                *_NAMES,
                Column("solved, uniform in joint space", note=INTERVAL),
                Column("solved, all strata within reach", note=INTERVAL),
                *(Column(f"time, {what}", "µs") for what in ("median", "95 %", "mean")),
                Column("position residual, median", "m"), Column("position residual, largest", "m"),
                Column("rotation residual, median", "rad"),
                Column("rotation residual, largest", "rad"),
                Column("claimed but not so"), Column("set-up", "ms"),
                Column("remark", words=True),
            ),
            tuple(_success_row(record) for record in records),
            shows="Times are of all targets within reach, those that failed included. Residuals "
            "are of those solved, not cut off at the tolerance. “Claimed but not so” counts "
            "answers that the solver calls solved and the evaluation does not. A solver that runs "
            "out of time has fewer targets; all have them in one order, the strata alternating.",
            measured=_how(records),
            summary=_success_summary(records),
        )  # fmt: skip

    return table


_NAMES = (Column("robot", words=True), Column("solver", words=True))


def _how(records: Sequence[Record]) -> str:
    return (
        f"{_MEASURED}within {settings(records, 'tolerance')} m and "
        f"{settings(records, 'tolerance_rotation')} rad, every limit kept to 1e-6 rad."
    )


def _success_row(record: Record) -> tuple[Cell, ...]:
    names: tuple[Cell, ...] = (record.title, record.solver)
    remark = record.notes.get("remark", "")
    if "solved" not in record.arrays:
        return (*names, *[None] * 11, remark)
    effort, solved = metrics.effort(record.arrays["seconds"]), record.arrays["solved"]
    residuals: list[Cell] = []
    for name in ("position", "rotation"):
        spread = metrics.spread(record.arrays[name][solved])
        residuals += [spread.median, spread.largest] if solved.any() else [None, None]
    return (
        *names,
        metrics.share(solved[record.arrays["stratum"] == 0]), metrics.share(solved),
        *(metrics.microseconds(seconds) for seconds in effort),
        *residuals,
        false_claims(record), metrics.milliseconds(float(record.arrays["setup"])), remark,
    )  # fmt: skip


def false_claims(record: Record) -> int | None:
    """Return how many claims the evaluation denies; None if the solver makes none."""
    claimed = record.arrays["claimed"]
    return (
        metrics.share((claimed == 1) & ~record.arrays["solved"]).hits if any(claimed >= 0) else None
    )


def _success_summary(records: Sequence[Record]) -> Summary:
    points = []
    for robot in dict.fromkeys(record.title for record in measured(records)):
        said = []
        for record in (r for r in measured(records) if r.title == robot):
            share, effort = (
                metrics.share(record.arrays["solved"]),
                metrics.effort(record.arrays["seconds"]),
            )
            rate = words(metrics.percent(share.hits, share.total))
            said.append(
                f"{record.solver} {rate} % in {words(metrics.microseconds(effort.median))} µs"
            )
        points.append(f"{robot}: {'; '.join(said)}")
    return (
        Summary("Solved within reach, and the median time of all:", tuple(points))
        if points
        else Summary()
    )


def _strata(kind: str) -> Callable[[Results], Table]:
    def table(results: Results) -> Table:
        records = measured(records_of(results, kind))
        strata = records[0].facts["strata"] if records else []
        return Table(
            f"robots_strata_{KINDS[kind]}",
            f"Robots, {kind}: success in each stratum",
            (*_NAMES, *(Column(f"{name}", note=INTERVAL) for name in strata)),
            tuple(_strata_row(record, len(strata)) for record in records),
            shows="Targets from random poses within the limits. Space: the tip spread evenly over "
            "the cells of a grid; outer shell and near the root: the twentieth of the poses whose "
            "tip is farthest from and nearest to the first joint; near singular: the twentieth "
            "with the smallest least singular value of the Jacobian; at a limit: one joint put at "
            "one of its limits.",
            measured=_how(records),
            summary=_strata_summary(records, strata),
        )

    return table


def _strata_row(record: Record, count: int) -> tuple[Cell, ...]:
    stratum, solved = record.arrays["stratum"], record.arrays["solved"]
    shares = [metrics.share(solved[stratum == i]) for i in range(count)]
    return (record.title, record.solver, *shares)


def _strata_summary(records: Sequence[Record], strata: Sequence[str]) -> Summary:
    hardest: dict[str, int] = {}
    for record in records:
        shares = _strata_row(record, len(strata))[2:]
        rates = [metrics.ratio(s.hits, s.total) for s in shares if isinstance(s, metrics.Share)]
        if rates and min(rates) < max(rates):
            name = strata[int(np.argmin(rates))]
            hardest[name] = hardest.get(name, 0) + 1
    if not hardest:
        return (
            Summary("No stratum is harder than the others to any solver.") if records else Summary()
        )
    counts = sorted(hardest.items(), key=lambda item: -item[1])
    return Summary(
        "Hardest, counted over solvers and robots: "
        + listed([f"{name} ({times})" for name, times in counts]) + "."
    )  # fmt: skip


def _unreachable(kind: str) -> Callable[[Results], Table]:
    def table(results: Results) -> Table:
        records = measured(records_of(results, kind, UNREACHABLE))
        return Table(
            f"robots_unreachable_{KINDS[kind]}",
            f"Robots, {kind}: targets out of reach",
            (
                *_NAMES, Column("targets"), Column("claimed as solved"),
                *(Column(f"time, {what}", "µs") for what in ("median", "95 %", "mean")),
                Column("distance left, median", "m"), Column("distance left, largest", "m"),
                Column("answers"),
            ),
            tuple(_unreachable_row(record) for record in records),
            shows="Targets farther from the first joint than all links in a row reach. What counts "
            "is how soon a solver gives up, and that it claims nothing.",
            measured=_how(records),
            summary=_unreachable_summary(records),
        )  # fmt: skip

    return table


def _unreachable_row(record: Record) -> tuple[Cell, ...]:
    left = record.arrays["position"][np.isfinite(record.arrays["position"])]
    distance = metrics.spread(left)
    return (
        record.title, record.solver, int(record.arrays["solved"].size), false_claims(record),
        *(metrics.microseconds(seconds) for seconds in metrics.effort(record.arrays["seconds"])),
        *((distance.median, distance.largest) if left.size else (None, None)), int(left.size),
    )  # fmt: skip


def _unreachable_summary(records: Sequence[Record]) -> Summary:
    claimed = [row for row in map(_unreachable_row, records) if row[3]]
    if not records:
        return Summary()
    if not claimed:
        return Summary("No solver claims a target that is out of reach.")
    points = (f"{row[0]}, {row[1]}: {words(row[3])} of {words(row[2])}" for row in claimed)
    return Summary("Claimed though out of reach:", tuple(points))


def _budgets(kind: str) -> Callable[[Results], Table]:
    def table(results: Results) -> Table:
        records = measured(records_of(results, kind))
        return Table(
            f"robots_budget_{KINDS[kind]}",
            f"Robots, {kind}: solved within an equal budget of time",
            (*_NAMES, *(Column(f"within {_duration(budget)}", "%") for budget in BUDGETS)),
            tuple(
                (
                    r.title,
                    r.solver,
                    *(metrics.percent(x, 1.0) for x in budget_curve(r, BUDGETS)),
                )
                for r in records
            ),
            shows="Share of the targets within reach that are solved within so much time for each.",
            measured=_how(records),
            summary=_leaders(records, budget_curve, BUDGETS, lambda b: f"within {_duration(b)}"),
        )

    return table


def budget_curve(record: Record, budgets: np.ndarray) -> np.ndarray:
    """Return the share of the targets within reach solved within each budget [s]."""
    return metrics.within_budget(record.arrays["seconds"], record.arrays["solved"], budgets)


def _leaders(
    records: Sequence[Record],
    curve: Callable[[Record, np.ndarray], np.ndarray],
    points: np.ndarray,
    named: Callable[[float], str],
) -> Summary:
    """Say who is ahead at each point, robot by robot."""
    said = []
    for robot in dict.fromkeys(record.title for record in records):
        mine = [record for record in records if record.title == robot]
        shares = np.array([curve(record, points) for record in mine])
        best = [
            f"{named(point)} {mine[int(np.argmax(column))].solver} "
            f"({words(metrics.percent(float(column.max()), 1.0))} %)"
            for point, column in zip(points, shares.T, strict=True) if column.max() > 0
        ]  # fmt: skip
        said.append(f"{robot}: {'; '.join(best)}")
    return Summary("Ahead:", tuple(said)) if said else Summary()


def _profiles(kind: str) -> Callable[[Results], Table]:
    def table(results: Results) -> Table:
        records = records_of(results, kind)
        made = profiles(records, RATIOS)
        return Table(
            f"robots_profile_{KINDS[kind]}",
            f"Robots, {kind}: performance profiles",
            (*_NAMES, *_ratio_columns()),
            tuple(
                (robot, solver, *(metrics.percent(x, 1.0) for x in curve))
                for robot, curves in made.items() for solver, curve in curves.items()
            ),
            shows="Share of the targets, among those within reach that any of these solvers "
            "solves, that a solver solves within so many times the time of the fastest on that "
            "target (Dolan and Moré 2002).",
            measured=f"{_how(records)} The targets are those that all solvers shown were given; a "
            "solver given less than an eighth of them is left out.",
            summary=_profile_summary(made),
        )  # fmt: skip

    return table


def _ratio_columns() -> list[Column]:
    return [Column(f"within {words(x)} times the fastest", "%") for x in RATIOS.tolist()]


def profiles(records: Sequence[Record], ratios: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """Return the profile of each solver on each robot, over the targets given to all of them."""
    made = {}
    for robot in dict.fromkeys(record.title for record in measured(records)):
        near = [r for r in measured(records) if r.title == robot]
        most = max(len(record.arrays["solved"]) for record in near)
        near = [record for record in near if ENOUGH * len(record.arrays["solved"]) >= most]
        least = min(len(record.arrays["solved"]) for record in near)
        seconds, solved = (
            np.array([record.arrays[name][:least] for record in near])
            for name in ("seconds", "solved")
        )
        curves = metrics.performance_profiles(seconds, solved, ratios)
        made[robot] = {record.solver: curve for record, curve in zip(near, curves, strict=True)}
    return made


def _profile_summary(made: dict[str, dict[str, np.ndarray]]) -> Summary:
    points = []
    for robot, curves in made.items():
        first = max(curves, key=lambda solver: curves[solver][0])
        rate = words(metrics.percent(float(curves[first][0]), 1.0))
        points.append(f"{robot}: {first}, on {rate} % of the targets")
    return Summary("Most often the fastest:", tuple(points)) if points else Summary()


def _duration(seconds: float) -> str:
    milli = metrics.milliseconds(seconds)
    return f"{words(metrics.microseconds(seconds))} µs" if milli < 1 else f"{words(milli)} ms"


TABLES = {
    kind: Tables(
        _success(kind), _strata(kind), _unreachable(kind), _budgets(kind), _profiles(kind)
    )
    for kind in KINDS
}  # fmt: skip
