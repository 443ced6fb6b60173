"""Published tables, and the same set-up here."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, label, settings
from ...presentation.tables import INTERVAL, Cell, Column, Summary, Table, words
from . import FABRIK, TOOLBOX, TRAC_IK
from . import problem as published

HERE = "here"


def trac_ik(results: Results) -> Table:
    """Return TRAC-IK's table, and what the solvers do here."""
    records = results.all("ik", task=TRAC_IK)
    rows: list[tuple[Cell, ...]] = []
    for robot in dict.fromkeys(rate.robot for rate in published.TRAC_IK):
        here = [r for r in records if r.facts["robot"] == robot]
        rows += [
            (robot, rate.solver, rate.source, None, rate.percent, None, rate.milliseconds)
            for rate in published.TRAC_IK if here and rate.robot == robot
        ]  # fmt: skip
        rows += [_trac_ik_row(robot, record) for record in here]
    return Table(
        "published_trac_ik",
        "TRAC-IK’s published table, and here",
        (
            Column("robot", words=True), Column("solver", words=True), Column("from", words=True),
            Column("solved", note=INTERVAL), Column("solved", "%"), Column("time, median", "ms"),
            Column("time, mean", "ms"),
        ),
        tuple(rows),
        shows="Full poses at 1e-5 m and rad in each of six components, every search from the "
        "middle of the limits, at most 5 ms for TRAC-IK; times of all targets, those that failed "
        "included.",
        measured="Published: 10,000 reachable random poses on a machine of its time. Here: as many "
        "of our own as the column says, evaluated by MuJoCo at the norm of three such components; "
        "the PR2’s continuous joints have two revolutions in either direction.",
        summary=_trac_ik_summary(records),
    )  # fmt: skip


def _trac_ik_row(robot: str, record: Record) -> tuple[Cell, ...]:
    if "solved" not in record.arrays:
        return (robot, record.solver, record.notes.get("remark", ""), *[None] * 4)
    share = metrics.share(record.arrays["solved"])
    effort = metrics.effort(record.arrays["seconds"])
    return (
        robot, record.solver, HERE, share, metrics.percent(share.hits, share.total),
        metrics.milliseconds(effort.median), metrics.milliseconds(effort.mean),
    )  # fmt: skip


def _trac_ik_summary(records: Sequence[Record]) -> Summary:
    points = []
    for record in records:
        if "solved" in record.arrays:
            robot = record.facts["robot"]
            row = _trac_ik_row(robot, record)
            points.append(f"{robot}, {record.solver}: {words(row[3])}, mean {words(row[6])} ms")
    return Summary("Here:", tuple(points)) if points else Summary()


def toolbox(results: Results) -> Table:
    """Return the Robotics Toolbox's table of one search, and what the solvers do here."""
    records = [r for r in results.all("ik", task=TOOLBOX) if "solved" in r.arrays]
    return Table(
        "published_toolbox",
        "The Robotics Toolbox tutorial’s table of one search, and here",
        (
            Column("solver", words=True), Column("published, infeasible", "%"),
            Column("here, by its own word", "%"),
            Column("here, not solved within the limits", note=INTERVAL),
            Column("time, median", "µs"),
        ),
        tuple(_toolbox_row(record) for record in records),
        shows="UR5, random poses and starts, one search of at most "
        f"{words(published.TOOLBOX_ITERATIONS)} iterations; infeasible is what the search does not "
        "solve. The published searches look at no limits, nor do the toolbox’s here; the last "
        "share counts answers beyond the limits as not solved.",
        measured="Published: 10,000 poses, the tutorial’s own Python loops (Haviland and Corke "
        "2022). Here the toolbox’s compiled ones, and ours; half the squared error within "
        f"{words(published.TOOLBOX_HALF_SQUARE)}.",
        summary=_toolbox_summary(records),
    )  # fmt: skip


def _toolbox_row(record: Record) -> tuple[Cell, ...]:
    failed = metrics.share(~record.arrays["solved"])
    own = metrics.share(record.arrays["claimed"] != 1)
    return (
        record.solver, record.facts.get("infeasible"), metrics.percent(own.hits, own.total), failed,
        metrics.microseconds(metrics.effort(record.arrays["seconds"]).median),
    )  # fmt: skip


def _toolbox_summary(records: Sequence[Record]) -> Summary:
    points = []
    for record in records:
        solver, before, own, failed, _ = _toolbox_row(record)
        beside = "" if before is None else f", published {words(before)} %"
        points.append(
            f"{solver}: {words(own)} % infeasible by its own word{beside}; {words(failed)}"
        )
    return Summary("Not solved by one search:", tuple(points)) if points else Summary()


def fabrik(results: Results) -> Table:
    """Return table 1 of the paper on FABRIK, and our iterations."""
    records = results.all("ik", task=FABRIK)
    solvers = list(dict.fromkeys(record.solver for record in records))
    columns = [
        Column(f"{stratum}, {what}")
        for stratum in published.FABRIK_DISTANCES
        for what in ("published, mean", "here, mean", "here, largest")
    ]
    return Table(
        "published_fabrik",
        "Iterations in the paper on FABRIK, and here",
        (Column("solver", words=True), *columns),
        tuple(_fabrik_row(results, solver) for solver in solvers),
        shows="Iterations for one target, ten joints, no limits. Here a target out of reach is "
        "recognised as such by geometry where the chain is straight.",
        measured="Published: Aristidou and Lasenby 2011, table 1, 20 runs, MATLAB, read in a "
        "secondary source; chain, target and tolerance are not stated there. Here a guess: "
        f"{published.FABRIK_LINKS} links of 0.1 m from straight, {published.FABRIK_RUNS} seeded "
        f"directions, targets at {' and '.join(map(str, published.FABRIK_DISTANCES.values()))} m, "
        f"to {settings(records, 'tolerance')} m.",
        summary=_fabrik_summary(results, solvers),
    )


def _fabrik_row(results: Results, solver: str) -> tuple[Cell, ...]:
    cells: list[Cell] = [label(solver)]
    for i, stratum in enumerate(published.FABRIK_DISTANCES):
        found = results.all("ik", task=FABRIK, stratum=stratum)
        record = next((r for r in found if r.solver == solver), None)
        cells.append(published.FABRIK[solver][i] if solver in published.FABRIK else None)
        counts = None if record is None else record.arrays["iterations"]
        cells.append(None if counts is None else metrics.mean(counts))
        cells.append(None if counts is None else metrics.whole(counts)[2])
    return tuple(cells)


def _fabrik_summary(results: Results, solvers: Sequence[str]) -> Summary:
    points = [
        f"{row[0]}: {words(row[2])} here, {words(row[1])} published"
        for row in (_fabrik_row(results, solver) for solver in solvers)
    ]
    return (
        Summary("Mean iterations towards a reachable target:", tuple(points))
        if points
        else Summary()
    )
