"""Robots: who takes part, who solves how many targets, how fast, and which claims are false."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import catalogue
from ...peers.peer import Peer, Run
from ...tables.columns import words_in
from ...tables.entered import entrant_table
from ...tables.layout import Layout, Row
from ...tables.results import Results, counted, grouped, leaders, listed, most_often
from ...tables.table import INTERVAL, Column, Summary, in_unit, listing, words
from . import REACHABLE, readings
from .figures import CAPTIONS, FIGURES
from .readings import OUTCOMES, STARTS, Score, title_of
from .values import RobotWords

# The rule for unranked solvers.
RULE = CAPTIONS.shared["rule"]
MEAN = "time, geometric mean"


# Participants.


def _participants(results: Results) -> list[Row]:
    """Return the peers with records, and the solvers entered by users."""
    records = [r for start in STARTS for r in results.all("ik", task=REACHABLE, kind=start)]
    robots = {record.title: record for record in records if "solved" in record.arrays}
    users = {r.solver: _as_peer(r) for r in records if r.facts.get("entrant") is True}
    rows = []
    for peer in (*catalogue.PEERS, *users.values()):
        names = set(map(peer.label_of, peer.runs))
        if own := [record for record in records if record.solver in names]:
            rows.append(_participant(peer, own, robots))
    return rows


def _as_peer(record: Record) -> Peer:
    """Return a user's solver in the form of the bench's solvers."""
    door = str(record.facts.get("door", ""))
    return Peer(record.solver, "", door, "", "", "", (Run(record.details.kind),))


def _participant(peer: Peer, records: Sequence[Record], robots: Mapping[str, Record]) -> Row:
    """Return the row of a solver; `robots` holds a record of each robot of all."""
    version = str(records[0].details.version)
    names = {record.title for record in records if "solved" in record.arrays}
    robot_names = [
        [robot for robot in robots if (robot in names) == is_in] for is_in in (True, False)
    ]
    remarks = {r.title: r.details.remark for r in records if r.details.remark and version}
    reasons = grouped(remarks, remarks.__getitem__)
    every = [getattr(record.values, "overhead", None) for record in records]
    overheads = [overhead for overhead in every if overhead is not None and overhead >= 0.0]
    return {
        "records": records,
        "robot_records": robots,
        "solver": peer.name,
        "package": peer.package,
        "version": version or "not installed",
        "license": peer.license,
        "algorithm": peer.algorithm,
        "robots": title_of(robot_names[0], robot_names[1]),
        "solves": peer.can,
        "entries": listed(list(map(_entry, peer.runs))),
        "harness overhead, median": _cell(float(np.median(overheads)) if overheads else math.nan),
        "remark": "; ".join(f"{listed(names)}: {reason}" for reason, names in reasons.items()),
    }


def _entry(entry: Run) -> str:
    """Return the start of an entry, its note, and who makes its restarts."""
    maker = "made by the bench" if entry.restarts else ""
    notes = "; ".join(filter(None, (entry.note, maker)))
    return f"{entry.kind} ({notes})" if notes else entry.kind


def _participant_summary(rows: Sequence[Row]) -> Summary:
    titles = {row["solver"] for row in rows}
    missing = [peer.name for peer in catalogue.PEERS if peer.name not in titles]
    not_asked = f"; not selected: {', '.join(missing)}" if missing else ""
    count = sum(row["version"] != "not installed" for row in rows)
    robots = rows[0]["robot_records"].values()
    return Summary(
        f"{count} of {len(rows)} selected solvers took part, on "
        f"{counted(len(robots), 'robot')}{not_asked}.",
        tuple(map(_robot, robots)),
    )


def _robot(record: Record) -> str:
    """Return the joints of a robot, and the target of its effectors."""
    robot: RobotWords = record.details
    freedoms = "" if robot.freedom == robot.joints else f", {robot.freedom} freedoms"
    effectors = listed(robot.effectors)
    return f"{record.title}: {robot.joints} joints{freedoms}, {robot.target} of {effectors}"


participants = CAPTIONS.layout("participants", _participants, _participant_summary)


# Scores.


def _row(score: Score) -> Row:
    """Return the cells common to all tables of scores."""
    seconds, claims = score.seconds, score.attempted("claims")
    false_successes = metrics.share((claims == 1) & ~score.attempted("solved"))
    trouble = next((record.trouble for record in score.records if record.trouble), "")
    return {
        "score": score,
        "claims": int(np.sum(claims >= 0)),
        "false success rate": false_successes,
        "trouble": trouble,
        "robots": score.robots,
        "starts": score.start,
        "solver": score.solver,
        "group": score.group,
        "disputed answers": score.disputed,
        "targets": score.total,
        "false successes": false_successes.hits if (claims >= 0).any() else None,
        "mark": "; ".join(filter(None, (score.limits, score.leads, trouble))),
        **_interval("time, median", metrics.median_interval(seconds)),
        "time, 95 %": _cell(metrics.spread(seconds).p95),
        "time, mean": _cell(metrics.mean(seconds)),
        **{name: score.outcomes[name] for name in OUTCOMES},
    }


def _reachable_row(score: Score) -> Row:
    reached = score.attempted("solved")
    sizes = [readings.rounds_of(record).shape[1] for record in score.records]
    mean = metrics.Interval(math.nan, math.nan, math.nan)
    if score.is_timed:
        mean = metrics.shifted_geometric_mean(score.penalised, readings.SHIFT, sizes)
    return {
        **_row(score),
        "solved": score.share if score.is_finished else None,
        "solved, by seed": _list_by_seed([100.0 * rate for rate in score.shares_by_seed]),
        **_interval(MEAN, mean),
        f"{MEAN}, by seed": _list_by_seed([1e6 * time for time in score.mean_times_by_seed]),
        "time relative to fastest": _cell(score.relative_time),
        **_spread("position residual", score.attempted("position")[reached]),
        **_spread("rotation residual", score.attempted("rotation")[reached]),
        "set-up": score.records[0].values.setup,
    }


def _list_by_seed(numbers: Sequence[float]) -> str | None:
    """Return the numbers of several seeds, in the order of the seeds; None of a single seed."""
    return ", ".join(map(words, numbers)) if len(numbers) > 1 else None


def _unreachable_row(score: Score) -> Row:
    row, distances = _row(score), score.distances
    bounds = np.hstack([record.arrays.get("bound", np.nan) for record in score.records])
    return {
        **row,
        "mark": "; ".join(filter(None, (score.limits, row["trouble"]))),
        **_spread("distance above best", distances - score.best_distances[: distances.size]),
        **_spread("distance above lower bound", distances - bounds),
        **_spread("distance to target", score.attempted("position")),
        "answers within limits": int(np.isfinite(distances).sum()),
    }


def _cell(number: float) -> float | None:
    return None if math.isnan(number) else number


def _interval(title: str, interval: metrics.Interval) -> Row:
    titles = (title, f"{title}, 95 % low", f"{title}, 95 % high")
    return dict(zip(titles, map(_cell, interval), strict=True))


def _spread(title: str, numbers: metrics.Floats) -> Row:
    """Return the cells of the median and the largest of the finite numbers."""
    spread = metrics.spread(numbers[np.isfinite(numbers)])
    return {f"{title}, median": _cell(spread.median), f"{title}, largest": _cell(spread.largest)}


def _measured(rows: Sequence[Row]) -> dict[str, str]:
    """Return by how much times drifted."""
    return {"steadiness": readings.drift(row["score"] for row in rows)}


def _leads(row: Row) -> dict[str, bool]:
    """Return whether a solver is first, or ties with the first, by the titles of columns."""
    score: Score = row["score"]
    if not score.success.order:
        return {}
    solved, time = (
        len(ranking.order) > 1 and score.solver in ranking.first
        for ranking in (score.success, score.time)
    )
    return {"solved": solved, MEAN: time, "time relative to fastest": time}


def _layout(
    name: str,
    scores: Callable[[Results], Iterable[Score]],
    row: Callable[[Score], Row],
    **fields: Any,
) -> Layout:
    """Return a table of scores; solvers with the same robots and starts are compared."""
    return CAPTIONS.layout(
        name,
        lambda results: map(row, scores(results)),
        measured=_measured,
        compared=2,
        ranked=lambda row: row["score"].is_ranked,
        leads=_leads,
        **fields,
    )


def _points(rows: Sequence[Row]) -> Iterator[str]:
    """Yield who solves the most and who takes the least time, field by field."""
    for (robots, start), field in _fields(rows).items():
        success, time = field[0]["score"].success, field[0]["score"].time
        if success.order:
            solvers = {row["solver"]: row for row in field}
            solved = words(solvers[success.order[0]]["solved"])
            speed = f"; shortest time {_time(time, solvers)}" if time.order else ""
            yield f"{robots}, {start}: {leaders(success)}, {solved}{speed}"


def _time(time: metrics.Ranking, solvers: Mapping[str, Row]) -> str:
    """Return the fastest solvers, and the mean time of the first with its interval."""
    fastest = solvers[time.order[0]]
    low, high = (
        words(in_unit(fastest[f"{MEAN}, 95 % {bound}"], "µs")) for bound in ("low", "high")
    )
    count = words(len(fastest["score"].seconds))
    return f"{leaders(time)}, {words_in(fastest[MEAN], 'µs')} ({low}–{high}, n = {count})"


def _fields(rows: Sequence[Row]) -> dict[tuple[str, str], list[Row]]:
    return grouped(rows, lambda row: (str(row["robots"]), str(row["starts"])))


def _summary(rows: Sequence[Row]) -> Summary:
    scores = [field[0]["score"] for field in _fields(rows).values()]
    solved, fastest = (
        most_often([ranking.order[0] for ranking in rankings if ranking.order], "comparison")
        for rankings in ([s.success for s in scores], [s.time for s in scores])
    )
    sentence = f"Most targets are solved by {solved}, and {fastest} is the fastest."
    return listing(sentence, _points(rows))


over_all = _layout("robots_overall", readings.overall, _reachable_row, summary=_summary)
robot_by_robot = _layout(
    "robots_by_robot", readings.scores, _reachable_row, summary=_summary, figures=FIGURES
)


def _outcome_row(score: Score) -> Row:
    strata = enumerate(score.records[0].details.strata)
    return {**_row(score), **{f"solved, {name}": _stratum(i, score) for i, name in strata}}


def _stratum(stratum: int, *scores: Score) -> metrics.Share:
    """Return how many targets of a stratum some solvers solve."""
    return metrics.share(np.concatenate([s.solved_in_stratum(stratum) for s in scores]))


def _outcome_columns(rows: Sequence[Row]) -> list[Column]:
    """Return the columns of outcomes, folded if all zero, and of strata."""

    def column(title: str, **looks: Any) -> Column:
        return Column(title, read=lambda row: row[title], **looks)

    strata = [title for title in (rows[0] if rows else ()) if title.startswith("solved, ")]
    return [
        *CAPTIONS.columns("robots_outcomes"),
        *(column(name, folded=not any(row[name] for row in rows)) for name in OUTCOMES),
        column("targets"),
        column("disputed answers"),
        *(column(title, note=INTERVAL, best="greatest", folded=True) for title in strata),
    ]


def _outcome_summary(rows: Sequence[Row]) -> Summary:
    """Return the outcomes of unsolved targets, and the hardest strata."""
    points = []
    for solver, group in grouped(rows, lambda row: str(row["solver"])).items():
        counts: Counter[str] = sum((row["score"].outcomes for row in group), Counter())
        failures = [f"{words(counts[name])} {name}" for name in OUTCOMES[1:] if counts[name]]
        if failures:
            points.append(f"{solver}: {listed(failures)}, of {words(counts.total())}")
    for start, group in grouped(rows, lambda row: str(row["starts"])).items():
        ranked = [row["score"] for row in group if row["score"].is_ranked]
        names = ranked[0].records[0].details.strata if ranked else []
        shares = {name: _stratum(i, *ranked) for i, name in enumerate(names)}
        hardest = sorted(shares, key=lambda name: metrics.ratio(*shares[name][:2]))
        strata = [f"{name} {words(shares[name])}" for name in hardest if shares[name].total]
        if strata:
            points.append(f"{start}, strata from the hardest: {', '.join(strata)}")
    counts = sum((row["score"].outcomes for row in rows), Counter())
    unsolved = Counter({name: counts[name] for name in OUTCOMES[1:]})
    name, count = unsolved.most_common(1)[0]
    sentence = f"Of {words(unsolved.total())} unsolved targets {words(count)} count as “{name}”."
    return listing(sentence, points)


outcomes = _layout(
    "robots_outcomes",
    readings.scores,
    _outcome_row,
    columns=_outcome_columns,
    summary=_outcome_summary,
)


def _unreachable_summary(rows: Sequence[Row]) -> Summary:
    points = [
        f"{row['robots']}, {row['solver']}: {words(row['false success rate'])}"
        for row in rows
        if row["false successes"]
    ]
    if points:
        return listing("Reported as solved, but out of reach:", points)
    count = sum(row["claims"] for row in rows)
    silent = list(dict.fromkeys(row["solver"] for row in rows if row["false successes"] is None))
    without_claims = (
        f" These solvers do not report success or failure: {listed(silent)}." if silent else ""
    )
    sentence = "No solver reports a target out of reach as solved"
    return Summary(f"{sentence} (n = {words(count)}).{without_claims}")


unreachable = _layout(
    "robots_unreachable", readings.out_of_reach, _unreachable_row, summary=_unreachable_summary
)

LAYOUTS = (participants, over_all, robot_by_robot, outcomes, unreachable, entrant_table)
