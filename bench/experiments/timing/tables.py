"""How long forward kinematics, solves and steps take, beside the engines and a limit."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

from ...harness import metrics
from ...harness.record import Record
from ...presentation.columns import at, text
from ...presentation.layout import Layout
from ...presentation.results import Results, by_problem
from ...presentation.tables import Column, Summary, in_unit, words
from . import figures
from .case import COMPILED, LIMIT, PLAIN


class Timed(NamedTuple):
    """A time, beside those of the same work by our compiled source and by the limit."""

    record: Record
    ours: Record | None
    limit: Record | None

    @property
    def timing(self) -> metrics.Timing:
        """Where the rounds lie [s]."""
        return metrics.timing(self.record.arrays["seconds"])


def _timed(subject: str, results: Results) -> list[Timed]:
    records = results.all("timing", subject=subject)
    ours, limits = (
        {record.problem: record for record in records if record.solver == solver}
        for solver in (COMPILED, LIMIT)
    )
    return [
        Timed(record, ours.get(record.problem), limits.get(record.problem))
        for record in records
        if record.solver != LIMIT
    ]


def _median(record: Record) -> float:
    return metrics.timing(record.arrays["seconds"]).median


def _multiple(record: Record, other: Record | None) -> float | None:
    """Return a time over another's of the same work, None if there is none."""
    if other is None or other is record:
        return None
    return metrics.ratio(_median(record), _median(other))


def _bandwidth(timed: Timed) -> float | None:
    if timed.limit is None:
        return None
    moved = float(timed.limit.arrays["moved"])
    return metrics.gigabytes_per_second(moved, _median(timed.limit))


LIMIT_SENTENCE = (
    " The limit is the time of moving as many bytes as have to be read and written at the least, "
    "in memory as near as theirs."
)
LIMIT_COLUMNS = (
    Column("times the limit", read=lambda timed: _multiple(timed.record, timed.limit)),
    Column("bandwidth at the limit", "GB/s", read=_bandwidth),
)


def _columns(unit: str, works: Sequence[Timed]) -> tuple[Column, ...]:
    places = ("10th percentile", "90th percentile")
    return (
        text("work", lambda timed: timed.record.title),
        text("by", lambda timed: timed.record.solver),
        Column("median", unit, read=at(0, _timing), best="least"),
        *(Column(name, unit, read=at(i, _timing), folded=True) for i, name in enumerate(places, 1)),
        Column("rounds", read=lambda timed: timed.timing.rounds, folded=True),
        Column("of our compiled time", read=lambda timed: _multiple(timed.record, timed.ours)),
        *(LIMIT_COLUMNS if any(timed.limit for timed in works) else ()),
    )


def _timing(timed: Timed) -> metrics.Timing:
    return timed.timing


def _summary(unit: str, works: Sequence[Timed]) -> Summary:
    """Say who takes how long for what, plain Python left out, a point for each group of works."""
    limits = {timed.record.problem: timed.limit for timed in works}
    groups: dict[str, list[str]] = {}
    for problem, records in by_problem(timed.record for timed in works).items():
        group, work = records[0].facts["group"], records[0].facts["work"]
        mine = [record for record in records if record.solver != PLAIN]
        times = ", ".join(f"{_short(r.solver)} {words(in_unit(_median(r), unit))}" for r in mine)
        multiple = _multiple(mine[0], limits[problem]) if mine else None
        beside = "" if multiple is None else f" ({words(multiple)} times the limit)"
        groups.setdefault(group, []).append(f"{work}: {times} {unit}{beside}")
    points = (f"{group} – {'; '.join(works)}" for group, works in groups.items())
    return Summary("Medians, plain Python left out:", tuple(points))


def _short(solver: str) -> str:
    return "Plumbob" if solver == COMPILED else solver


def _layout(question: str, subject: str, title: str, unit: str, shows: str) -> Layout:
    return Layout(
        question,
        f"timing_{subject}",
        title,
        subjects=partial(_timed, subject),
        columns=partial(_columns, unit),
        shows=lambda works: shows + (LIMIT_SENTENCE if any(timed.limit for timed in works) else ""),
        measured="pytest-benchmark, one core unless all are named, after a first call that may "
        "compile; each time is a call’s divided by what it does. Spread over rounds of many calls.",
        summary=partial(_summary, unit),
        figures=(figures.TIMINGS[subject],),
    )


kinematics = _layout(
    "Forward kinematics",
    "kinematics",
    "Time of forward kinematics, for one pose",
    "ns",
    "All joints’ positions and rotations. We check and normalise the quaternions given and "
    "return arrays; an engine’s results stay inside it. The limit reads as many bytes as the "
    "rotations given have and writes as many as positions and rotations have, by a compiled "
    "loop into memory that is there already; its bandwidth counts that memory is read before "
    "it is written.",
)
inverse_kinematics = _layout(
    "Inverse kinematics",
    "ik",
    "Time of inverse kinematics, for one solve of the ten-ball chain",
    "µs",
    "The same targets, random starts and tolerance as in the table of success. Beside our "
    "Levenberg-Marquardt stands the same method as one Python loop on three kinematics.",
)
cloth = _layout(
    "A step of the cloth",
    "cloth",
    "Time of a cloth step, for one frame",
    "µs",
    "The state is written into MuJoCo and read back, as a caller would. The limit of "
    "local/global iterations counts only their triangular solves: the factor’s nonzeros, read "
    "twice an iteration.",
)


LAYOUTS = (kinematics, inverse_kinematics, cloth)
