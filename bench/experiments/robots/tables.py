"""Robots: who takes part, who solves how many targets, how fast, and which claims are false."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...peers.registry import Peer, PeerEntry
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.captions import Captions
from ...tables.columns import folded, text, words_in
from ...tables.entered import entered
from ...tables.layout import Layout
from ...tables.results import Results, counted, grouped, leaders, listed, settings, steadiness
from ...tables.table import INTERVAL, Cell, Column, Summary, in_unit, listing, words
from . import REACHABLE, readings
from .figures import FIGURES
from .readings import OUTCOMES, STARTS, Score, title_of
from .values import RobotDetails

_CAPTIONS = Captions(
    __file__,
    shift=words_in(readings.SHIFT, "µs"),
    penalty=words_in(readings.PENALTY, "ms"),
    resamples=str(metrics.RESAMPLES),
    limit_tolerance=words(LIMIT_TOLERANCE),
)
# The rule for solvers that a budget of time cut short.
RULE = _CAPTIONS.shared["rule"]


# Participants.


class Participant(NamedTuple):
    """A solver that was asked, its records on robots, and one record of each robot of all."""

    peer: Peer
    records: tuple[Record, ...]
    robots: dict[str, Record]

    @property
    def version(self) -> str:
        """Its version, "" if it is not installed."""
        return str(self.records[0].details.version)

    @property
    def entries(self) -> str:
        """The starts and settings with which it takes part."""
        return listed([f"{e.kind} ({e.note})" if e.note else e.kind for e in self.peer.entries])

    @property
    def measured_robots(self) -> str:
        """The robots that it was measured on, "" for none."""
        names = {record.title for record in self.records if "solved" in record.arrays}
        remaining = [robot for robot in self.robots if robot not in names]
        return title_of([robot for robot in self.robots if robot in names], remaining)

    @property
    def remark(self) -> str:
        """Why it was not measured on a robot, "" where it is not installed."""
        records = [r for r in self.records if r.details.remark and self.version]
        reasons = grouped(records, lambda record: record.details.remark)
        titles = {reason: dict.fromkeys(r.title for r in rs) for reason, rs in reasons.items()}
        return "; ".join(f"{listed(list(names))}: {reason}" for reason, names in titles.items())


def _participants(results: Results) -> list[Participant]:
    """Return the peers that have records, and the solvers that users entered."""
    records = [r for start in STARTS for r in results.all("ik", task=REACHABLE, kind=start)]
    robots = {record.title: record for record in records if "solved" in record.arrays}
    users = {r.solver: _as_peer(r) for r in records if r.facts.get("entrant") is True}
    participants = [
        Participant(peer, tuple(r for r in records if r.solver in names), robots)
        for peer in (*registry.PEERS, *users.values())
        for names in [set(map(peer.label_of, peer.entries))]
    ]
    return [participant for participant in participants if participant.records]


def _as_peer(record: Record) -> Peer:
    """Return a user's solver in the form of the solvers that the bench knows."""
    door = str(record.facts.get("door", ""))
    return Peer(record.solver, "", door, "", "", (PeerEntry(record.details.kind),))


def _participant_summary(rows: Sequence[Participant]) -> Summary:
    titles = {row.peer.title for row in rows}
    missing = [peer.title for peer in registry.PEERS if peer.title not in titles]
    not_asked = f"; not asked: {', '.join(missing)}" if missing else ""
    count = sum(bool(row.version) for row in rows)
    robots = rows[0].robots
    return Summary(
        f"{count} of {len(rows)} that were asked took part{not_asked}; "
        f"{counted(len(robots), 'robot')}:",
        tuple(map(_robot, robots.values())),
    )


def _robot(record: Record) -> str:
    """Return the joints of a robot, and the target of its effectors."""
    robot: RobotDetails = record.details
    freedoms = "" if robot.freedom == robot.joints else f", {robot.freedom} freedoms"
    effectors = listed(robot.effectors)
    return f"{record.title}: {robot.joints} joints{freedoms}, {robot.target} of {effectors}"


participants = Layout(
    **_CAPTIONS.of("participants"),
    subjects=_participants,
    columns=(
        text("solver", attrgetter("peer.title")),
        text("package", attrgetter("peer.package")),
        text("version", lambda row: row.version or "not installed"),
        text("license", attrgetter("peer.license")),
        text("robots", attrgetter("measured_robots")),
        text("solves", attrgetter("peer.can")),
        text("entries", attrgetter("entries")),
        text("remark", attrgetter("remark")),
    ),
    summary=_participant_summary,
)


# Scores.


def _measured(scores: Sequence[Score]) -> dict[str, str]:
    """Return the tolerances, and whether the machine was steady."""
    records = [record for score in scores for record in score.records]
    paces = [float(r.conditions["pace"]) for r in records if r.conditions.get("pace")]
    noise = metrics.relative_spread(np.array(paces)) if len(paces) > 1 else math.nan
    tolerances = {name: settings(records, name) for name in ("tolerance", "tolerance_rotation")}
    return {**tolerances, "steadiness": steadiness(noise)}


def _number(
    title: str, read: str | Callable[[Score], Cell], unit: str = "", best: str = ""
) -> Column:
    """Return a column of numbers, empty where a score has none."""
    number = attrgetter(read) if isinstance(read, str) else read

    def cell(score: Score) -> Cell:
        value: Cell = number(score)
        return None if isinstance(value, float) and math.isnan(value) else value

    return Column(title, unit, read=cell, best=best)


def _spread(title: str, unit: str, read: Callable[[Score], metrics.Floats]) -> list[Column]:
    """Return the columns of the median and the largest of some finite numbers."""

    def spread(score: Score) -> metrics.Spread:
        numbers = read(score)
        return metrics.spread(numbers[np.isfinite(numbers)])

    return [
        _number(f"{title}, median", lambda score: spread(score).median, unit),
        _number(f"{title}, largest", lambda score: spread(score).largest, unit),
    ]


def _residuals(quantity: str, unit: str) -> list[Column]:
    def read(score: Score) -> metrics.Floats:
        return score.begun(quantity)[score.begun("solved")]

    return _spread(f"{quantity} residual", unit, read)


def _counts(names: Sequence[str]) -> list[Column]:
    def count(name: str, score: Score) -> int:
        return score.outcomes[name]

    return [Column(name, read=partial(count, name)) for name in names]


def _mark(score: Score) -> str:
    return "; ".join(filter(None, (score.limits, score.leads, score.trouble)))


NAMES = (
    text("robots", attrgetter("robots")),
    text("starts", attrgetter("start")),
    text("solver", attrgetter("solver")),
)
SOLVED = replace(_number("solved", "share", best="greatest"), note=INTERVAL)
FALSE_SUCCESSES = _number("false successes", lambda s: s.false_successes.hits if s.claims else None)
_MEAN = "time, geometric mean"
MEAN_TIME = _number(_MEAN, "mean_time", "µs", best="least")
MEAN_TIME_INTERVAL = (
    _number(f"{_MEAN}, 95 % low", "mean_time_interval.low", "µs"),
    _number(f"{_MEAN}, 95 % high", "mean_time_interval.high", "µs"),
)
MEDIAN_TIME = _number("time, median", "median_time.value", "µs")
OTHER_TIMES = (
    _number("time, 95 %", lambda score: metrics.effort(score.begun("seconds")).p95, "µs"),
    _number("time, mean", lambda score: metrics.mean(score.begun("seconds")), "µs"),
)


def _layout(name: str, **fields: object) -> Layout:
    """Return a table of scores; solvers with the same robots and starts are compared."""
    captions = {**_CAPTIONS.of(name, _measured), **fields}
    return Layout(**captions, compared=2, ranked=attrgetter("is_ranked"))


def _points(scores: Sequence[Score]) -> Iterator[str]:
    """Yield who solves the most and who takes the least time, field by field."""
    for (robots, start), field in grouped(scores, lambda s: (s.robots, s.start)).items():
        success, time = field[0].success, field[0].time
        if success.order:
            solvers = {score.solver: score for score in field}
            best, fastest = solvers[success.order[0]], solvers[time.order[0]]
            mean, low, high = fastest.mean_time_interval
            yield (
                f"{robots}, {start}: {leaders(success)}, {words(best.share)}; least time "
                f"{leaders(time)}, {words_in(mean, 'µs')} ({words(in_unit(low, 'µs'))}–"
                f"{words(in_unit(high, 'µs'))}, n = {words(fastest.share.total)})"
            )


def _summary(scores: Sequence[Score]) -> Summary:
    sentence = "Who solves the most targets within reach, and who takes the least time for them:"
    return listing(sentence, _points(scores))


over_all = _layout(
    "robots_overall",
    subjects=readings.overall,
    columns=(
        *NAMES,
        SOLVED,
        FALSE_SUCCESSES,
        MEAN_TIME,
        text("mark", _mark),
        *folded([*MEAN_TIME_INTERVAL, *_counts(OUTCOMES[1:])]),
    ),
    summary=_summary,
)

robot_by_robot = _layout(
    "robots_by_robot",
    subjects=readings.scores,
    columns=(
        *NAMES,
        SOLVED,
        FALSE_SUCCESSES,
        MEDIAN_TIME,
        _number("time relative to fastest", "relative_time", best="least"),
        text("mark", _mark),
        *folded(
            [
                _number("time, median, 95 % low", "median_time.low", "µs"),
                _number("time, median, 95 % high", "median_time.high", "µs"),
                *OTHER_TIMES,
                MEAN_TIME,
                *MEAN_TIME_INTERVAL,
                *_residuals("position", "m"),
                *_residuals("rotation", "rad"),
                Column("set-up", "ms", read=lambda score: score.records[0].values.setup),
            ]
        ),
    ),
    summary=_summary,
    figures=FIGURES,
)


def _outcome_columns(scores: Sequence[Score]) -> list[Column]:
    """Return a column for each outcome, folded if it never occurs, and one for each stratum."""
    counts = [
        replace(column, folded=not any(map(column.read, scores))) for column in _counts(OUTCOMES)
    ]
    names = scores[0].records[0].details.strata if scores else ()
    strata = [
        Column(f"solved, {name}", note=INTERVAL, read=partial(_stratum, i), best="greatest")
        for i, name in enumerate(names)
    ]
    return [*NAMES, *counts, _number("targets", "total"), *folded(strata)]


def _stratum(stratum: int, *scores: Score) -> metrics.Share:
    """Return how many targets of a stratum some solvers solve."""
    return metrics.share(np.concatenate([s.solved_in_stratum(stratum) for s in scores]))


def _outcome_summary(scores: Sequence[Score]) -> Summary:
    """Return the outcomes of targets that were not solved, and the hardest strata."""
    points = []
    for solver, group in grouped(scores, lambda score: score.solver).items():
        counts = sum((score.outcomes for score in group), Counter())
        failures = [f"{words(counts[name])} {name}" for name in OUTCOMES[1:] if counts[name]]
        if failures:
            points.append(f"{solver}: {listed(failures)}, of {words(counts.total())}")
    for start, group in grouped(scores, lambda score: score.start).items():
        ranked = [score for score in group if score.is_ranked]
        names = ranked[0].records[0].details.strata if ranked else []
        shares = {name: _stratum(i, *ranked) for i, name in enumerate(names)}
        hardest = sorted(shares, key=lambda name: metrics.ratio(*shares[name][:2]))
        strata = [f"{name} {words(shares[name])}" for name in hardest if shares[name].total]
        if strata:
            points.append(f"{start}, strata from the hardest: {', '.join(strata)}")
    return listing("What was not solved, and which targets are hard:", points)


outcomes = _layout(
    "robots_outcomes", subjects=readings.scores, columns=_outcome_columns, summary=_outcome_summary
)


def _unreachable_summary(scores: Sequence[Score]) -> Summary:
    liars = [score for score in scores if score.false_successes.hits]
    if liars:
        points = (f"{s.robots}, {s.solver}: {words(s.false_successes)}" for s in liars)
        return listing("Claimed as solved though out of reach:", points)
    count = sum(score.claims for score in scores)
    silent = list(dict.fromkeys(s.solver for s in scores if not s.claims))
    without_claims = f" These make no claims: {listed(silent)}." if silent else ""
    sentence = "No solver that makes claims claims a target that is out of reach"
    return Summary(f"{sentence} (n = {words(count)}).{without_claims}")


def _over_best(score: Score) -> metrics.Floats:
    """Return by how much the distances exceed the best ones [m]."""
    return score.distances - score.best_distances[: score.distances.size]


def _over_bound(score: Score) -> metrics.Floats:
    """Return by how much the distances exceed the least that geometry allows [m]."""
    bounds = [record.arrays.get("bound", np.nan) for record in score.records]
    return score.distances - np.hstack(bounds)


median_over_best, largest_over_best = _spread("distance above best", "m", _over_best)

unreachable = _layout(
    "robots_unreachable",
    subjects=readings.out_of_reach,
    columns=(
        *NAMES,
        FALSE_SUCCESSES,
        replace(median_over_best, best="least"),
        MEDIAN_TIME,
        text("mark", lambda score: "; ".join(filter(None, (score.limits, score.trouble)))),
        *folded(
            [
                largest_over_best,
                _spread("distance above lower bound", "m", _over_bound)[0],
                *_spread("distance to target", "m", lambda score: score.begun("position")),
                _number("targets", "total"),
                _number("answers within limits", lambda s: int(np.isfinite(s.distances).sum())),
                *_counts(OUTCOMES[4:]),
                *OTHER_TIMES,
            ]
        ),
    ),
    summary=_unreachable_summary,
)

LAYOUTS = (participants, over_all, robot_by_robot, outcomes, unreachable, entered)
