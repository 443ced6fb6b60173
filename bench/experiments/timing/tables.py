"""How long forward kinematics, solves and steps take, beside the engines and a limit."""

from collections.abc import Sequence
from functools import partial

from ...harness import metrics
from ...harness.record import Record
from ...presentation.columns import at, text, titled
from ...presentation.entry import Entry
from ...presentation.results import Results, by_problem
from ...presentation.tables import Column, Summary, Table, in_unit, tabulate, words
from . import figures
from .case import COMPILED, LIMIT, PLAIN


def kinematics(results: Results) -> Table:
    """Return the time of forward kinematics."""
    return _table(
        results,
        "kinematics",
        "Time of forward kinematics, for one pose",
        "ns",
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
        "Time of inverse kinematics, for one solve of the ten-ball chain",
        "µs",
        "The same targets, random starts and tolerance as in the table of success. Beside our "
        "Levenberg-Marquardt stands the same method as one Python loop on three kinematics.",
    )


def cloth(results: Results) -> Table:
    """Return the time of cloth steps."""
    return _table(
        results,
        "cloth",
        "Time of a cloth step, for one frame",
        "µs",
        "The state is written into MuJoCo and read back, as a caller would. The limit of "
        "local/global iterations counts their triangular solves alone: the factor’s nonzeros, read "
        "twice an iteration.",
    )


def _table(results: Results, subject: str, title: str, unit: str, shows: str) -> Table:
    records = results.all("timing", subject=subject)
    limits, ours = _by_problem(records, LIMIT), _by_problem(records, COMPILED)
    limited = [
        Column("times the limit", read=lambda record: _multiple(record, limits)),
        Column("bandwidth at the limit", "GB/s", read=lambda record: _bandwidth(record, limits)),
    ]
    return tabulate(
        f"timing_{subject}",
        title,
        (
            titled("work"),
            text("by", lambda record: record.solver),
            *(
                Column(place, unit, read=at(i, _timing))
                for i, place in enumerate(("median", "10th percentile", "90th percentile"))
            ),
            Column("rounds", read=lambda record: _timing(record).rounds),
            Column("of our compiled time", read=lambda record: _multiple(record, ours)),
            *(limited if limits else ()),
        ),
        [record for record in records if record.solver != LIMIT],
        shows=shows + (LIMIT_SENTENCE if limits else ""),
        measured="pytest-benchmark, one core unless all are named, after a first call that may "
        "compile; each time is a call’s divided by what it does. Spread over rounds of many calls.",
        summary=partial(_summary, limits, unit),
    )


LIMIT_SENTENCE = (
    " The limit is the time of moving as many bytes as have to be read and written at the least, "
    "in memory as near as theirs."
)


def _by_problem(records: Sequence[Record], solver: str) -> dict[str, Record]:
    return {record.problem: record for record in records if record.solver == solver}


def _summary(limits: dict[str, Record], unit: str, records: Sequence[Record]) -> Summary:
    """Say who takes how long for what, plain Python left out, a point for each group of works."""
    groups: dict[str, list[str]] = {}
    for works in by_problem(records).values():
        group, work = works[0].facts["group"], works[0].facts["work"]
        mine = [record for record in works if record.solver != PLAIN]
        times = ", ".join(f"{_short(r.solver)} {words(in_unit(_median(r), unit))}" for r in mine)
        multiple = _multiple(mine[0], limits) if mine else None
        beside = "" if multiple is None else f" ({words(multiple)} times the limit)"
        groups.setdefault(group, []).append(f"{work}: {times} {unit}{beside}")
    points = (f"{group} – {'; '.join(works)}" for group, works in groups.items())
    return Summary("Medians, plain Python left out:", tuple(points))


def _short(solver: str) -> str:
    return "Plumbob" if solver == COMPILED else solver


def _multiple(record: Record, others: dict[str, Record]) -> float | None:
    """Return a time over that of the same work by another, None if there is no other."""
    other = others.get(record.problem)
    if other is None or other is record:
        return None
    return metrics.ratio(_median(record), _median(other))


def _bandwidth(record: Record, limits: dict[str, Record]) -> float | None:
    limit = limits.get(record.problem)
    if limit is None:
        return None
    return metrics.gigabytes_per_second(float(limit.arrays["moved"]), _median(limit))


def _timing(record: Record) -> metrics.Timing:
    return metrics.timing(record.arrays["seconds"])


def _median(record: Record) -> float:
    return _timing(record).median


ENTRIES = (
    Entry("Forward kinematics", kinematics, (figures.kinematics,)),
    Entry("Inverse kinematics", inverse_kinematics, (figures.inverse_kinematics,)),
    Entry("A step of the cloth", cloth, (figures.cloth,)),
)
