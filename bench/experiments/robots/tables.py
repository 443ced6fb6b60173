"""Robots: who solves how many targets, how fast, and how far what is claimed is so.

Solvers that make one attempt and those that start again are never in one table: each of the
tables of `Tables` exists for either kind.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results, leaders, listed
from ...peers import registry
from ...peers.registry import Entry, Peer
from ...tables.columns import (
    LARGEST,
    MEDIAN,
    at,
    effort,
    places,
    remark,
    share,
    text,
    times,
    titled,
    words_in,
)
from ...tables.layout import Layout
from ...tables.table import Cell, Column, Summary, in_unit, listing, words
from . import REACHABLE, UNREACHABLE, figures
from .overall.tables import aggregate, problem_map
from .readings import (
    CRASH,
    KINDS,
    MARK,
    OUTCOMES,
    RULE,
    SCORE,
    SHIFT,
    TIES,
    best_known,
    beyond_best,
    budget_curve,
    by_robot,
    distances_within_limits,
    false_claims,
    fastest,
    how,
    is_ranked,
    measured,
    outcomes,
    penalised,
    profiles,
    ranked_by_success,
    ranked_by_time,
    records_of,
    solved,
    solved_within,
    total,
)

# Shares of the targets are shown for these budgets [s] and these ratios to the fastest.
BUDGETS = np.array([1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 1e-1])
# Those that a narrow table shows.
WHOLE = (1e-4, 1e-3, 1e-2, 1e-1)
RATIOS = np.array([1.0, 2.0, 5.0, 10.0, 100.0, 1000.0])
NAMES = (titled("robot"), text("solver", lambda record: record.solver))


class Tables(NamedTuple):
    """The tables that exist for either kind."""

    overall: Layout
    map: Layout
    success: Layout
    outcomes: Layout
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
    """A solver that was asked, and its version, "" if it is not installed."""

    peer: Peer
    version: str


def _participants(results: Results) -> list[Participant]:
    """Return the peers that have records, and those that users entered."""
    records = [r for r in results.all("ik", task=REACHABLE) if r.settings["kind"] in KINDS]
    present = {record.solver: str(record.settings.get("version", "")) for record in records}
    entered = [r for r in records if r.facts.get("entrant") is True]
    return [
        Participant(peer, version)
        for peer in (*registry.PEERS, *map(_as_peer, entered))
        for version in [present[n] for n in map(peer.called, peer.entries) if n in present][:1]
    ]


def _as_peer(record: Record) -> Peer:
    """Return what a record of a solver that was entered says of it."""
    kind = str(record.settings["kind"])
    return Peer(record.solver, "", str(record.facts.get("door", "")), "", "", (Entry(kind),))


def _kinds(peer: Peer) -> str:
    return listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in peer.entries])


def _who_summary(all: Sequence[Participant]) -> Summary:
    asked = {one.peer.title for one in all}
    others = [peer.title for peer in registry.PEERS if peer.title not in asked]
    rest = f"; not asked: {', '.join(others)}" if others else ""
    count = sum(bool(one.version) for one in all)
    return Summary(f"{count} of {len(all)} that were asked took part{rest}.")


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
    summary=_who_summary,
)


def _measured(kind: str, results: Results, task: str = REACHABLE) -> list[Record]:
    return measured(records_of(results, kind, task))


def success(kind: str) -> Layout:
    """Return how many targets are solved, how soon, and how closely."""
    columns = (
        share("solved", solved, best="greatest"),
        Column("claimed but not so", read=false_claims),
        Column("time, median", "µs", read=_median_of_times),
    )
    folded = (
        share("solved, uniform in joint space", partial(solved, stratum=0)),
        Column("beyond a limit", read=lambda record: outcomes(record)["beyond a limit"]),
        Column("time, median, 95 % from", "µs", read=at(1, _middle)),
        Column("time, median, 95 % to", "µs", read=at(2, _middle)),
        *times("time")[1:],
        Column(
            "time, geometric mean", "µs", best="least", read=lambda record: _score(record).value
        ),
        *_residuals("position", "m"),
        *_residuals("rotation", "rad"),
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
            text("mark", _mark),
            *(replace(_if_measured(column), folded=True) for column in folded),
            replace(remark(), folded=True),
        ),
        shows=f"{RULE} Medians are of all targets begun, those that failed included. Residuals "
        "are of those solved, not cut off at the tolerance. “Claimed but not so” counts "
        "answers that the solver calls solved and the evaluation does not. "
        f"{SCORE} {TIES}",
        measured=how,
        summary=_success_summary,
        ranked=is_ranked,
    )


def _mark(record: Record) -> str:
    """Return why a record is not ranked, or holds no numbers, and what its solver raised."""
    if "solved" not in record.arrays:
        return str(record.notes.get("remark", ""))
    return "; ".join(filter(None, (record.notes.get(MARK), record.trouble)))


def _if_measured(column: Column) -> Column:
    """Return the column, empty for a record without targets."""
    return replace(column, read=lambda r: column.read(r) if "solved" in r.arrays else None)


def _middle(record: Record) -> Sequence[Cell]:
    """Return the median time and its interval, None where too few targets tell [s]."""
    found = metrics.median_interval(record.arrays["seconds"])
    return [None if np.isnan(x) else x for x in found]


def _median_of_times(record: Record) -> float:
    return effort(record).median


def _score(record: Record) -> metrics.Interval:
    """Return the geometric mean of times, unsolved targets with their penalty [s]."""
    return metrics.shifted_geometric_mean(penalised(record), SHIFT)


def _residuals(name: str, unit: str) -> list[Column]:
    def read(record: Record) -> Sequence[Cell]:
        values = record.arrays[name][record.arrays["solved"]]
        return metrics.spread(values) if values.size else (None, None, None)

    return places(f"{name} residual", unit, (MEDIAN, LARGEST), read)


def _success_summary(records: Sequence[Record]) -> Summary:
    return listing(
        "Who solves the most targets within reach, and who takes the least time for them:",
        (
            f"{name}: {_most_solved(mine)}; {_soonest(mine)}"
            for name, mine in by_robot(records).items()
            if any(map(is_ranked, mine))
        ),
    )


def _most_solved(records: Sequence[Record]) -> str:
    ranking = ranked_by_success(records)
    first = next(record for record in records if record.solver == ranking.order[0])
    return f"{leaders(ranking)}, {words(metrics.share(solved(first)))}"


def _soonest(records: Sequence[Record]) -> str:
    ranking = ranked_by_time(records)
    first = next(record for record in records if record.solver == ranking.order[0])
    value, low, high = _score(first)
    return (
        f"least time {leaders(ranking)}, {words_in(value, 'µs')} "
        f"({words(in_unit(low, 'µs'))}–{words(in_unit(high, 'µs'))})"
    )


def outcome(kind: str) -> Layout:
    """Return what became of every target."""
    return Layout(
        f"With {kind}: what becomes of the targets?",
        f"robots_outcomes_{KINDS[kind]}",
        f"Robots, {kind}: what became of every target",
        subjects=partial(_measured, kind),
        columns=_outcome_columns,
        shows="Every target counts once, so that the parts are together all targets. Beyond a "
        "limit: the target is met, but by a pose that no joint may take. Wrong claim: off the "
        "target though called solved. Missed: off the target, and not called solved. Exception or "
        "crash: the solver raised, or its process was lost, and left no answer. No answer: it "
        "says that it has none. Not begun: the budget of time ran out before.",
        measured=how,
        summary=_outcome_summary,
        ranked=is_ranked,
    )


def _outcome_columns(records: Sequence[Record]) -> tuple[Column, ...]:
    """Return a column for each outcome; that of exceptions is shown if there are any."""
    empty = () if any(outcomes(record)[CRASH] for record in records) else (CRASH,)
    counts = [Column(n, read=partial(_count, n), folded=n in empty) for n in OUTCOMES]
    return (*NAMES, *counts, Column("targets", read=total, folded=True))


def _count(name: str, record: Record) -> int:
    return outcomes(record)[name]


def _outcome_summary(records: Sequence[Record]) -> Summary:
    """Say how many of all targets came to what but success, for each solver."""
    points = []
    for solver in dict.fromkeys(record.solver for record in records):
        mine = [record for record in records if record.solver == solver]
        counts = {name: sum(outcomes(record)[name] for record in mine) for name in OUTCOMES}
        failed = [f"{words(counts[name])} {name}" for name in OUTCOMES[1:] if counts[name]]
        if failed:
            points.append(f"{solver}: {listed(failed)}, of {words(sum(counts.values()))}")
    return listing("What was not solved:", points)


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
        f"one of its limits. {RULE}",
        measured=how,
        summary=_strata_summary,
        ranked=is_ranked,
    )


def _strata_columns(records: Sequence[Record]) -> tuple[Column, ...]:
    names = records[0].facts["strata"] if records else []
    columns = [share(n, partial(solved, stratum=i), best="greatest") for i, n in enumerate(names)]
    mark = text("mark", _mark)
    folded = [replace(column, folded=len(columns) > SHOWN) for column in columns[SHOWN:]]
    return (*NAMES, *columns[:SHOWN], *folded, replace(mark, folded=True))


# So many strata stand in a table, the others are folded.
SHOWN = 4


def _strata_summary(records: Sequence[Record]) -> Summary:
    """Say how many targets of each stratum the solvers that are ranked solve together."""
    ranked = [record for record in records if is_ranked(record)]
    points = []
    for i, name in enumerate(records[0].facts["strata"]):
        hits = [solved(record, i) for record in ranked]
        points.append((name, metrics.share(np.concatenate(hits)) if hits else metrics.share(_NO)))
    points.sort(key=lambda point: metrics.ratio(point[1].hits, point[1].total))
    made = (f"{name}: {words(share)}" for name, share in points if share.total)
    return listing(
        "Solved in each stratum, over robots and ranked solvers, the hardest first:", made
    )


_NO = np.zeros(0, dtype=bool)


class Missed(NamedTuple):
    """What a solver leaves of targets out of reach, and by how much that is more than it must."""

    record: Record
    beyond_best: np.ndarray

    @property
    def beyond_bound(self) -> np.ndarray:
        """By how much answers within limits miss more than geometry makes them [m], (answer,)."""
        left = distances_within_limits(self.record)
        bound = self.record.arrays.get("bound", np.full(left.size, np.nan))
        return (left - bound)[np.isfinite(left - bound)]


def _missed(kind: str, results: Results) -> list[Missed]:
    """Return the records of one kind; the best known answers are those of either kind."""
    every = [r for each in KINDS for r in _measured(each, results, task=UNREACHABLE)]
    best = best_known(every)
    mine = _measured(kind, results, task=UNREACHABLE)
    return [Missed(record, beyond_best(record, best)) for record in mine]


def _of_record(column: Column, **changed: Any) -> Column:
    """Return the column as one of targets missed."""
    return replace(column, read=lambda missed: column.read(missed.record), **changed)


def unreachable(kind: str) -> Layout:
    """Return what becomes of targets out of reach."""
    return Layout(
        f"With {kind}: what happens out of reach?",
        f"robots_unreachable_{KINDS[kind]}",
        f"Robots, {kind}: targets out of reach",
        subjects=partial(_missed, kind),
        columns=(
            *map(_of_record, NAMES),
            Column("claimed as solved", read=lambda missed: false_claims(missed.record)),
            _beyond("beyond the best known", MEDIAN, lambda missed: missed.beyond_best, "least"),
            _of_record(Column("time, median", "µs", read=_median_of_times)),
            _of_record(text("mark", _mark)),
            *(
                replace(column, folded=True)
                for column in (
                    _beyond("beyond the best known", LARGEST, lambda missed: missed.beyond_best),
                    _beyond("beyond the lower bound", MEDIAN, lambda missed: missed.beyond_bound),
                    *map(_of_record, places("distance left", "m", (MEDIAN, LARGEST), _left)),
                    _of_record(Column("targets", read=total)),
                    _of_record(Column("answers within limits", read=_kept)),
                    *(
                        _of_record(Column(name, read=partial(_count, name)))
                        for name in OUTCOMES[4:]
                    ),
                    *map(_of_record, times("time")[1:]),
                )
            ),
        ),
        shows="Targets farther from the first joint than all links in a row reach. What counts "
        "is that a solver claims nothing, how soon it gives up, and how near it comes: the best "
        "known answer to a target is the nearest within limits of any solver here, with one start "
        "or more; the lower bound is how much farther a target is than all links in a row. A "
        "solver of poses may trade distance for angle. Answers beyond a limit have no distance. "
        f"{RULE}",
        measured=lambda rows: how([missed.record for missed in rows]),
        summary=_unreachable_summary,
        ranked=lambda missed: is_ranked(missed.record),
    )


def _beyond(title: str, which: str, read: Callable[[Missed], np.ndarray], best: str = "") -> Column:
    """Return the column of how far answers miss by more than something."""

    def place(missed: Missed) -> float | None:
        found = read(missed)
        if not found.size:
            return None
        spread = metrics.spread(found)
        return spread.median if which == MEDIAN else spread.largest

    return Column(f"{title}, {which}", "m", read=place, best=best)


def _left(record: Record) -> Sequence[Cell]:
    """Return where the distances of all answers lie, within limits or not."""
    left = record.arrays["position"][np.isfinite(record.arrays["position"])]
    return metrics.spread(left) if left.size else (None, None, None)


def _kept(record: Record) -> int:
    return int(np.isfinite(distances_within_limits(record)).sum())


def _unreachable_summary(rows: Sequence[Missed]) -> Summary:
    records = [missed.record for missed in rows]
    claimed = [record for record in records if false_claims(record)]
    if not claimed:
        count = sum(int(np.count_nonzero(r.arrays["claimed"] >= 0)) for r in records)
        silent = list(dict.fromkeys(r.solver for r in records if false_claims(r) is None))
        beside = f" These make no claims: {listed(silent)}." if silent else ""
        sentence = "No solver that makes claims claims a target that is out of reach"
        return Summary(f"{sentence} (n = {words(count)}).{beside}")
    points = (
        f"{r.title}, {r.solver}: "
        f"{words(metrics.share((r.arrays['claimed'] == 1) & ~r.arrays['solved']))}"
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
                Column(
                    f"within {_duration(budget)}",
                    "%",
                    read=at(i, _within_budgets),
                    folded=budget not in WHOLE,
                )
                for i, budget in enumerate(BUDGETS.tolist())
            ),
        ),
        shows="Share of the targets within reach that are solved within so much time for each. "
        f"{RULE} {TIES}",
        measured=how,
        summary=_leaders,
        figures=(figures.budgets(kind),),
        ranked=is_ranked,
    )


def _within_budgets(record: Record) -> np.ndarray:
    return budget_curve(record, BUDGETS)


def _leaders(records: Sequence[Record]) -> Summary:
    """Say who is ahead at some budgets, robot by robot."""
    points = (f"{name}: {_ahead(mine)}" for name, mine in by_robot(records).items())
    return listing("Ahead:", (point for point in points if not point.endswith(": ")))


def _ahead(records: Sequence[Record]) -> str:
    said = []
    for budget in WHOLE:
        hits = {r.solver: solved_within(r, budget) for r in records if is_ranked(r)}
        ranking = metrics.ranking(hits)
        if ranking.order and hits[ranking.order[0]].any():
            share = words(metrics.share(hits[ranking.order[0]]))
            said.append(f"within {_duration(budget)} {leaders(ranking)} ({share})")
    return "; ".join(said)


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
        f"target (Dolan and Moré 2002). {RULE}",
        measured=lambda rows: how(rows[0].records if rows else []),
        summary=_profile_summary,
        figures=(figures.profiles(kind),),
    )


def _curve(row: Profile) -> Sequence[Cell]:
    """Return the shares, None of no targets."""
    return [None if np.isnan(share) else share for share in row.curve]


def _profile_summary(rows: Sequence[Profile]) -> Summary:
    """Say who is the fastest most often, robot by robot."""
    points = []
    for robot, mine in by_robot(rows[0].records).items():
        hits = fastest(mine)
        ranked = {r.solver: hits[r.solver] for r in mine if is_ranked(r) and hits[r.solver].size}
        ranking = metrics.ranking(ranked)
        if ranking.order and hits[ranking.order[0]].any():
            share = words(metrics.share(hits[ranking.order[0]]))
            points.append(f"{robot}: {leaders(ranking)}, on {share} of the targets")
    return listing("Most often the fastest, of the targets that any solves:", points)


def _duration(seconds: float) -> str:
    return words_in(seconds, "µs" if seconds < 1e-3 else "ms")


OF_KIND = {
    kind: Tables(
        aggregate(kind),
        problem_map(kind),
        success(kind),
        outcome(kind),
        strata(kind),
        unreachable(kind),
        budgets(kind),
        profile(kind),
    )
    for kind in KINDS
}
LAYOUTS = (who, models, *(layout for made in OF_KIND.values() for layout in made))
