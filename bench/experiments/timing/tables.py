"""How long forward kinematics, solves and steps take, beside the engines and a limit."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, by_problem
from ...presentation.tables import Cell, Column, Summary, Table, words
from .case import COMPILED, LIMIT, PLAIN


def kinematics(results: Results) -> Table:
    """Return the time of forward kinematics."""
    return _table(
        results,
        "kinematics",
        "timing_kinematics",
        "Time of forward kinematics, for one pose",
        "ns",
        1e9,
        "All joints’ positions and rotations. We check and normalise the quaternions given and "
        "return arrays; an engine’s results stay inside it. The limit reads as many bytes as the "
        "rotations given have and writes as many as positions and rotations have, by a compiled "
        "loop into memory that is there already; its bandwidth counts that memory is read before "
        "it is written.",
    )


def inverse_kinematics(results: Results) -> Table:
    """Return the time of solves."""
    return _table(
        results,
        "ik",
        "timing_ik",
        "Time of inverse kinematics, for one solve of the ten-ball chain",
        "µs",
        1e6,
        "The same targets, random starts and tolerance as in the table of success. Beside our "
        "Levenberg-Marquardt stands the same method as one Python loop on three kinematics.",
    )


def cloth(results: Results) -> Table:
    """Return the time of cloth steps."""
    return _table(
        results,
        "cloth",
        "timing_cloth",
        "Time of a cloth step, for one frame",
        "µs",
        1e6,
        "The state is written into MuJoCo and read back, as a caller would. The limit of "
        "local/global iterations counts their triangular solves alone: the factor’s nonzeros, read "
        "twice an iteration.",
    )


def _table(
    results: Results, subject: str, name: str, title: str, unit: str, scale: float, shows: str
) -> Table:
    records = results.all("timing", subject=subject)
    limits = {record.problem: record for record in records if record.solver == LIMIT}
    ours = {record.problem: record for record in records if record.solver == COMPILED}
    doers = [record for record in records if record.solver != LIMIT]
    columns = (
        Column("work", words=True),
        Column("by", words=True),
        Column("median", unit),
        Column("10th percentile", unit),
        Column("90th percentile", unit),
        Column("rounds"),
        Column("of our compiled time"),
    )
    return Table(
        name,
        title,
        columns + (LIMIT_COLUMNS if limits else ()),
        tuple(
            _row(record, ours.get(record.problem), scale)
            + (_limit_cells(record, limits.get(record.problem)) if limits else ())
            for record in doers
        ),
        shows=shows + (LIMIT_SENTENCE if limits else ""),
        measured="pytest-benchmark, one core unless all are named, after a first call that may "
        "compile; each time is a call’s divided by what it does. Spread over rounds of many calls.",
        summary=_summary(doers, limits, unit, scale),
    )


LIMIT_COLUMNS = (Column("times the limit"), Column("bandwidth at the limit", "GB/s"))
LIMIT_SENTENCE = (
    " The limit is the time of moving as many bytes as have to be read and written at the least, "
    "in memory as near as theirs."
)


def _row(record: Record, ours: Record | None, scale: float) -> tuple[Cell, ...]:
    took = metrics.timing(record.arrays["seconds"])
    return (
        record.title,
        record.solver,
        scale * took.median,
        scale * took.low,
        scale * took.high,
        took.rounds,
        None if ours is None or ours is record else _times(record, ours),
    )


def _limit_cells(record: Record, limit: Record | None) -> tuple[Cell, ...]:
    return (None, None) if limit is None else (_times(record, limit), _bandwidth(limit))


def _summary(
    doers: Sequence[Record], limits: dict[str, Record], unit: str, scale: float
) -> Summary:
    """Say who takes how long for what, plain Python left out, a point for each group of works."""
    groups: dict[str, list[str]] = {}
    for problem, records in by_problem(doers).items():
        group, work = records[0].facts["group"], records[0].facts["work"]
        mine = [record for record in records if record.solver != PLAIN]
        times = ", ".join(f"{_short(r.solver)} {words(scale * _median(r))}" for r in mine)
        beside = ""
        if mine and problem in limits:
            beside = f" ({words(_times(mine[0], limits[problem]))} times the limit)"
        groups.setdefault(group, []).append(f"{work}: {times} {unit}{beside}")
    points = (f"{group} – {'; '.join(works)}" for group, works in groups.items())
    return Summary("Medians, plain Python left out:", tuple(points))


def _short(solver: str) -> str:
    return "Plumbob" if solver == COMPILED else solver


def _bandwidth(limit: Record) -> float:
    return metrics.gigabytes_per_second(float(limit.arrays["moved"]), _median(limit))


def _times(record: Record, other: Record) -> float:
    return metrics.ratio(_median(record), _median(other))


def _median(record: Record) -> float:
    return metrics.timing(record.arrays["seconds"]).median
