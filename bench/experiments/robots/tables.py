"""Robots: who solves how many targets, how fast, and how many claims are false."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from operator import attrgetter

from ...harness import metrics
from ...problems.robots import LIMIT_TOLERANCE
from ...tables.columns import folded, text, words_in
from ...tables.entered import entered
from ...tables.layout import Layout
from ...tables.results import leaders, listed, settings, steadiness
from ...tables.table import INTERVAL, Cell, Column, Summary, in_unit, listing, words
from . import figures
from .participants import participants
from .readings import (
    OUTCOMES,
    PENALTY,
    SHIFT,
    Score,
    fields,
    out_of_reach,
    overall,
    pooled_strata,
    scores,
    spread_of_paces,
)

_MEASURED = (
    "Every solver has the same text of the robot (a solver of yours the same robot as the protocol "
    "writes it), the same targets and the same seeded random starts. It works in a process of its "
    "own, on one core (TRAC-IK on two), and is timed target by target, as in a loop of solves: "
    "after the target before, solved again without counting where that takes less than a "
    "millisecond; conversions are left out. The solvers of a robot follow each other in an order "
    "drawn by lot. What one returns is evaluated by MuJoCo’s kinematics of the same text. "
    "TRAC-IK’s limits of time pass sooner on a busy machine. Solved means: "
)
# The rule for solvers that a budget of time cut short.
RULE = (
    "All shares are of all targets given: a solver whose budget of time ran out is marked “cut "
    "at”, the targets that it never began count as not solved, and it is not ranked."
)
_STARTS = "Solvers with one start are compared with each other, and so are those with restarts."
_TIES = (
    "Solvers tie unless one does better on so many of the same targets that chance would do as "
    "much in less than 5 % of cases (McNemar’s exact test for success, Fisher’s "
    "randomisation test of differences for times; Holm’s correction over rivals)."
)
# What a geometric mean of times is.
_MEAN = (
    f"The geometric mean is of times plus {words_in(SHIFT, 'µs')}, less that in the end; a target "
    f"that is not solved counts as {words_in(PENALTY, 'ms')}, or as what it took if that is longer."
)
_CLAIMS = "False successes are answers that the solver calls solved and the evaluation does not."


def _how(scores: Sequence[Score]) -> str:
    """Return how the numbers came about, and whether the machine was steady."""
    records = [record for score in scores for record in score.records]
    return (
        f"{_MEASURED}within {settings(records, 'tolerance')} m and "
        f"{settings(records, 'tolerance_rotation')} rad, every limit kept to "
        f"{words(LIMIT_TOLERANCE)} rad. {steadiness(spread_of_paces(records))}"
    ).rstrip()


def _number(title: str, reading: str, unit: str = "", best: str = "") -> Column:
    """Return the column of a reading of scores, empty where that is not a number."""
    read = attrgetter(reading)

    def cell(score: Score) -> Cell:
        value: Cell = read(score)
        return None if isinstance(value, float) and math.isnan(value) else value

    return Column(title, unit, read=cell, best=best)


def _residual(quantity: str, unit: str, place: str) -> Column:
    def read(score: Score) -> float | None:
        return getattr(score.residual(quantity), place) if score.share.hits else None

    return Column(f"{quantity} residual, {place}", unit, read=read)


def _mark(score: Score) -> str:
    return "; ".join(filter(None, (score.limits, score.leads, score.trouble)))


NAMES = (
    text("robots", attrgetter("robots")),
    text("starts", attrgetter("start")),
    text("solver", attrgetter("solver")),
)
SOLVED = replace(_number("solved", "share", best="greatest"), note=INTERVAL)
FALSE_SUCCESSES = _number("false successes", "false_claims")
MEAN = "time, geometric mean"
MEAN_TIME = _number(MEAN, "mean_time", "µs", best="least")
MEAN_TIME_INTERVAL = (
    _number(f"{MEAN}, 95 % from", "mean_time_interval.low", "µs"),
    _number(f"{MEAN}, 95 % to", "mean_time_interval.high", "µs"),
)
MEDIAN_TIME = _number("time, median", "median_time.value", "µs")
OTHER_TIMES = (
    _number("time, 95 %", "effort.p95", "µs"),
    _number("time, mean", "effort.mean", "µs"),
)
# Solvers with the same robots and starts are compared.
_of_scores = partial(Layout, measured=_how, compared=2, ranked=attrgetter("is_ranked"))


def _count(name: str, score: Score) -> int:
    return score.outcomes[name]


def _counts(names: Sequence[str]) -> list[Column]:
    return [Column(name, read=partial(_count, name)) for name in names]


def _points(scores: Sequence[Score]) -> Iterator[str]:
    """Yield who solves the most and who takes the least time, field by field."""
    for (robots, start), field in fields(scores).items():
        success, time = field[0].success, field[0].time
        if success.order:
            of = {score.solver: score for score in field}
            first, fastest = of[success.order[0]], of[time.order[0]]
            value, low, high = fastest.mean_time_interval
            yield (
                f"{robots}, {start}: {leaders(success)}, {words(first.share)}; least time "
                f"{leaders(time)}, {words_in(value, 'µs')} ({words(in_unit(low, 'µs'))}–"
                f"{words(in_unit(high, 'µs'))}, n = {words(fastest.share.total)})"
            )


def _summary(scores: Sequence[Score]) -> Summary:
    sentence = "Who solves the most targets within reach, and who takes the least time for them:"
    return listing(sentence, _points(scores))


over_all = _of_scores(
    "Who is best over all robots?",
    "robots_overall",
    "Robots: all robots and strata together",
    subjects=overall,
    columns=(
        *NAMES,
        SOLVED,
        FALSE_SUCCESSES,
        MEAN_TIME,
        text("mark", _mark),
        *folded([*MEAN_TIME_INTERVAL, *_counts(OUTCOMES[1:])]),
    ),
    shows="Every robot and every stratum counts alike, and solvers are compared over robots that "
    f"all of them take. {_STARTS} {RULE} {_CLAIMS} {_MEAN} Its interval is by the bootstrap: "
    f"targets drawn again {metrics.RESAMPLES} times within each robot, by seeded lots. {_TIES}",
    summary=_summary,
)

robot_by_robot = _of_scores(
    "Who is good at which robot?",
    "robots_by_robot",
    "Robots one by one: success, time and accuracy",
    subjects=scores,
    columns=(
        *NAMES,
        SOLVED,
        FALSE_SUCCESSES,
        MEDIAN_TIME,
        _number("times the least time", "times_the_least", best="least"),
        text("mark", _mark),
        *folded(
            [
                _number("time, median, 95 % from", "median_time.low", "µs"),
                _number("time, median, 95 % to", "median_time.high", "µs"),
                *OTHER_TIMES,
                MEAN_TIME,
                *MEAN_TIME_INTERVAL,
                *(
                    _residual(quantity, unit, place)
                    for quantity, unit in (("position", "m"), ("rotation", "rad"))
                    for place in ("median", "largest")
                ),
                Column("set-up", "ms", read=lambda score: score.records[0].values.setup),
            ]
        ),
    ),
    shows=f"{_STARTS} {RULE} {_CLAIMS} Median times are of all targets begun, those that failed "
    f"included. {_MEAN} “Times the least time” is that mean over the least of any solver. "
    f"Residuals are of the targets solved, not cut off at the tolerance. {_TIES}",
    summary=_summary,
    figures=figures.FIGURES,
)


def _outcome_columns(scores: Sequence[Score]) -> list[Column]:
    """Return a column for each outcome, folded if nothing came to it, and one for each stratum."""
    counts = [
        replace(column, folded=not any(map(column.read, scores))) for column in _counts(OUTCOMES)
    ]
    strata = [
        Column(f"solved, {name}", note=INTERVAL, read=partial(_stratum, i), best="greatest")
        for i, name in enumerate(scores[0].records[0].details.strata if scores else ())
    ]
    return [*NAMES, *counts, _number("targets", "total"), *folded(strata)]


def _stratum(stratum: int, score: Score) -> metrics.Share:
    return metrics.share(score.solved_in_stratum(stratum))


def _outcome_summary(scores: Sequence[Score]) -> Summary:
    """Say what became of targets that were not solved, and which strata are the hardest."""
    points = []
    for solver in dict.fromkeys(score.solver for score in scores):
        counts = sum((s.outcomes for s in scores if s.solver == solver), Counter())
        failures = [f"{words(counts[name])} {name}" for name in OUTCOMES[1:] if counts[name]]
        if failures:
            points.append(f"{solver}: {listed(failures)}, of {words(counts.total())}")
    for start in dict.fromkeys(score.start for score in scores):
        shares = pooled_strata([s for s in scores if s.start == start and s.is_ranked])
        strata = [f"{name} {words(share)}" for name, share in shares if share.total]
        if strata:
            points.append(f"{start}, strata from the hardest: {', '.join(strata)}")
    return listing("What was not solved, and which targets are hard:", points)


outcomes = _of_scores(
    "What becomes of the targets, and which are hard?",
    "robots_outcomes",
    "Robots: what became of every target, and success in each stratum",
    subjects=scores,
    columns=_outcome_columns,
    shows="Every target counts once, so that the parts are together all targets. Beyond a "
    "limit: the target is met, but by a pose that no joint may take. Wrong claim: off the "
    "target though called solved. Missed: off the target, and not called solved. Exception or "
    "crash: the solver raised, or its process was lost, and left no answer. No answer: it "
    "says that it has none. Not begun: the budget of time ran out before. Strata are of targets "
    "from random poses within the limits. Space: the effector spread evenly over "
    "the cells of a grid; outer shell and near the root: the twentieth of the poses whose "
    "effector is farthest from and nearest to the first joint; near singular: the twentieth "
    "with the smallest least singular value of the Jacobian; at a limit: one joint put at "
    f"one of its limits. {_STARTS} {RULE}",
    summary=_outcome_summary,
)


def _unreachable_summary(scores: Sequence[Score]) -> Summary:
    claims = [score for score in scores if score.false_claims]
    if claims:
        points = (f"{s.robots}, {s.solver}: {words(s.false_claim_share)}" for s in claims)
        return listing("Claimed though out of reach:", points)
    count = sum(score.claims for score in scores)
    silent = list(dict.fromkeys(s.solver for s in scores if s.false_claims is None))
    beside = f" These make no claims: {listed(silent)}." if silent else ""
    sentence = "No solver that makes claims claims a target that is out of reach"
    return Summary(f"{sentence} (n = {words(count)}).{beside}")


unreachable = _of_scores(
    "What happens out of reach?",
    "robots_unreachable",
    "Robots: targets out of reach",
    subjects=out_of_reach,
    columns=(
        *NAMES,
        FALSE_SUCCESSES,
        _number("beyond the best known, median", "excess_over_best.median", "m", best="least"),
        MEDIAN_TIME,
        text("mark", lambda score: "; ".join(filter(None, (score.limits, score.trouble)))),
        *folded(
            [
                _number("beyond the best known, largest", "excess_over_best.largest", "m"),
                _number("beyond the lower bound, median", "excess_over_bound.median", "m"),
                _number("distance left, median", "gap.median", "m"),
                _number("distance left, largest", "gap.largest", "m"),
                _number("targets", "total"),
                _number("answers within limits", "answers_within_limits"),
                *_counts(OUTCOMES[4:]),
                *OTHER_TIMES,
            ]
        ),
    ),
    shows="Targets farther from the first joint than all links in a row reach. What counts "
    "is that a solver claims nothing, how soon it gives up, and how near it comes: the best "
    "known answer to a target is the nearest within limits of any solver here, with one start "
    "or more; the lower bound is how much farther a target is than all links in a row. A "
    "solver of poses may trade distance for angle. Answers beyond a limit have no distance. "
    f"{RULE}",
    summary=_unreachable_summary,
)

LAYOUTS = (participants, over_all, robot_by_robot, outcomes, unreachable, entered)
