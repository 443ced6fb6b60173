"""One table over all robots, and a map of who is how good where."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import methodcaller

from ....harness import metrics
from ....harness.results import leaders, listed
from ....tables.columns import text, words_in
from ....tables.layout import Layout
from ....tables.table import INTERVAL, Column, Summary, in_unit, listing, words
from ..readings import KINDS, OUTCOMES, RULE, SCORE, TIES, how
from . import figures
from .readings import Line, Overall, lines, most_solved, overall


def aggregate(kind: str) -> Layout:
    """Return what solvers come to over all robots and strata."""
    folded = (
        Column("time, 95 % from", "µs", read=lambda row: row.score.low),
        Column("time, 95 % to", "µs", read=lambda row: row.score.high),
        *(Column(name, read=methodcaller("count", name)) for name in OUTCOMES[1:]),
    )
    return Layout(
        f"With {kind}: who is best over all robots?",
        f"robots_overall_{KINDS[kind]}",
        f"Robots, {kind}: all robots and strata together",
        subjects=partial(overall, kind=kind),
        columns=(
            text("over", lambda row: row.robots),
            text("solver", lambda row: row.solver),
            Column("solved", note=INTERVAL, read=lambda row: row.share, best="greatest"),
            Column("claimed but not so", read=lambda row: row.false_claims),
            Column("time, geometric mean", "µs", read=lambda row: row.score.value, best="least"),
            text("mark", lambda row: row.marks),
            *(replace(column, folded=True) for column in folded),
        ),
        shows="Every robot and every stratum counts alike, and solvers are compared over robots "
        f"that all of them take. {RULE} {SCORE} Its interval is by the bootstrap: targets "
        f"drawn again {metrics.RESAMPLES} times within each robot, by seeded lots. {TIES}",
        measured=lambda rows: how([record for row in rows for record in row.records]),
        summary=_summary,
        ranked=lambda row: row.is_ranked,
    )


def _summary(rows: Sequence[Overall]) -> Summary:
    groups: dict[str, list[Overall]] = {}
    for row in rows:
        groups.setdefault(row.robots, []).append(row)
    return listing(
        "Who solves the most, and who takes the least time:",
        (f"{robots}: {_led(mine)}" for robots, mine in groups.items() if mine[0].success.order),
    )


def _led(rows: Sequence[Overall]) -> str:
    by = {row.solver: row for row in rows}
    success, time = rows[0].success, rows[0].time
    score = by[time.order[0]].score
    return (
        f"{leaders(success)}, {words(by[success.order[0]].share)}; least time {leaders(time)}, "
        f"{words_in(score.value, 'µs')} "
        f"({words(in_unit(score.low, 'µs'))}–{words(in_unit(score.high, 'µs'))}, "
        f"n = {words(by[time.order[0]].share.total)})"
    )


def problem_map(kind: str) -> Layout:
    """Return what each solver comes to on each robot."""
    return Layout(
        f"With {kind}: who is good at what?",
        f"robots_map_{KINDS[kind]}",
        f"Robots, {kind}: solvers and robots",
        subjects=partial(lines, kind=kind),
        columns=_columns,
        shows="Targets solved, and the geometric mean of times over the least of any solver on "
        f"that robot; empty where a solver does not take the robot. {RULE} {SCORE}",
        measured=lambda made: how([r for line in made for r in line.records.values()]),
        summary=_map_summary,
        figures=(figures.heat_map(kind),),
        compared=0,
    )


def _map_summary(made: Sequence[Line]) -> Summary:
    """Say on how many robots each solver is first, or ties with who is."""
    robots = {robot for line in made for robot in line.records}
    targets = sum(max(_targets(made, robot)) for robot in robots)
    return listing(
        "Solves the most targets of a robot, or ties with who does "
        f"(n = {words(targets)} targets of {words(len(robots))} robots):",
        (f"{solver}: on {words(count)}" for solver, count in most_solved(made).most_common()),
    )


def _targets(made: Sequence[Line], robot: str) -> list[int]:
    return [share.total for line in made if (share := line.share(robot))]


def _columns(made: Sequence[Line]) -> tuple[Column, ...]:
    robots = list(dict.fromkeys(robot for line in made for robot in line.records))
    shares = [_share(robot) for robot in robots]
    ratios = [_ratio(robot) for robot in robots]
    cuts = text("cut on", lambda line: listed([r for r in robots if line.is_cut(r)]))
    folded = [*(replace(column, folded=True) for column in (*shares[5:], *ratios, cuts))]
    return (text("solver", lambda line: line.solver), *shares[:5], *folded)


def _share(robot: str) -> Column:
    return Column(f"{robot}, solved", note=INTERVAL, read=lambda line: line.share(robot))


def _ratio(robot: str) -> Column:
    return Column(f"{robot}, times the least time", read=lambda line: line.times_the_best(robot))
