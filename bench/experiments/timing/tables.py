"""How long forward kinematics, solves and steps take, beside the engines and a plain copy."""

import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import PRECISION, Results, by_problem, leaders, steadiness
from ...tables.columns import at, text, words_in
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from . import figures
from .case import COMPILED, LIMIT, PLAIN


class Timed(NamedTuple):
    """A time, beside those of the same work by our compiled source and by a plain copy."""

    record: Record
    ours: Record | None
    copy: Record | None

    @property
    def timing(self) -> metrics.Timing:
        """Where the rounds lie [s]."""
        return metrics.timing(self.record.arrays["seconds"])

    @property
    def precision(self) -> float | None:
        """Half the width of the median's interval over the median, None if nothing is known."""
        return _precision(self.record)

    @property
    def mark(self) -> str:
        """Whether the machine was too noisy while it was timed."""
        return "noisy" if self.record.facts.get("noise", 0.0) > PRECISION else ""


def _timed(subject: str, results: Results) -> list[Timed]:
    records = results.all("timing", subject=subject)
    ours, copies = (
        {record.problem: record for record in records if record.solver == solver}
        for solver in (COMPILED, LIMIT)
    )
    return [
        Timed(record, ours.get(record.problem), copies.get(record.problem))
        for record in records
        if record.solver != LIMIT
    ]


def _precision(record: Record) -> float | None:
    median, low, high = metrics.timing(record.arrays["seconds"]).interval
    return None if math.isnan(low) else (high - low) / (2.0 * median)


def median_time(record: Record) -> float:
    """Return the median of all rounds [s]."""
    return metrics.timing(record.arrays["seconds"]).median


def _multiple(record: Record, other: Record | None) -> float | None:
    """Return a time over another's of the same work, None if there is none."""
    if other is None or other is record:
        return None
    return metrics.ratio(median_time(record), median_time(other))


def _bandwidth(timed: Timed) -> float | None:
    if timed.copy is None:
        return None
    moved = float(timed.copy.arrays["moved"])
    return metrics.gigabytes_per_second(moved, median_time(timed.copy))


COPY_SENTENCE = (
    " A plain copy is a loop that reads and writes as many bytes, in memory as near as theirs. It "
    "is a yardstick and no lower bound: caches may serve other work better."
)
COPY_COLUMNS = (
    Column("times a plain copy", read=lambda t: _multiple(t.record, t.copy), folded=True),
    Column("bandwidth of the copy", "GB/s", read=_bandwidth, folded=True),
)


def _columns(unit: str, works: Sequence[Timed]) -> tuple[Column, ...]:
    places = ("10th percentile", "90th percentile")
    return (
        text("work", lambda timed: timed.record.title),
        text("by", lambda timed: timed.record.solver),
        Column("median", unit, read=at(0, _timing), best="least"),
        Column("median known to ±", "%", read=lambda timed: timed.precision),
        Column("of our compiled time", read=lambda timed: _multiple(timed.record, timed.ours)),
        text("mark", lambda timed: timed.mark),
        *(Column(name, unit, read=at(i, _timing), folded=True) for i, name in enumerate(places, 1)),
        Column("rounds", read=lambda timed: timed.timing.rounds, folded=True),
        *(COPY_COLUMNS if any(timed.copy for timed in works) else ()),
    )


def _timing(timed: Timed) -> metrics.Timing:
    return timed.timing


def _summary(unit: str, works: Sequence[Timed]) -> Summary:
    """Say who takes how long for what, plain Python left out, a point for each group of works."""
    copies = {timed.record.problem: timed.copy for timed in works}
    groups: dict[str, list[str]] = {}
    for problem, records in by_problem(timed.record for timed in works).items():
        group, work = records[0].facts["group"], records[0].facts["work"]
        mine = [record for record in records if record.solver != PLAIN]
        times = ", ".join(f"{_short(r.solver)} {_time(r, unit)}" for r in mine)
        multiple = _multiple(mine[0], copies[problem]) if mine else None
        beside = "" if multiple is None else f" ({words(multiple)} times a plain copy)"
        groups.setdefault(group, []).append(f"{work}: {times}{beside}{_first(mine)}")
    points = (f"{group} – {'; '.join(works)}" for group, works in groups.items())
    noise = _noise(works)
    warning = f"{steadiness(noise)} " if noise > PRECISION else ""
    said = "Medians, known in 95 % of cases to what stands behind ±, plain Python left out:"
    return Summary(warning + said, tuple(points))


def _noise(works: Sequence[Timed]) -> float:
    """Return by how much a fixed loop varied where it varied most, NaN if that is not known."""
    return max((timed.record.facts.get("noise", math.nan) for timed in works), default=math.nan)


def _time(record: Record, unit: str) -> str:
    precision = _precision(record)
    known = "" if precision is None else f" ± {round(100 * precision, 1):g} %"
    return f"{words_in(median_time(record), unit)}{known}"


def _first(records: Sequence[Record]) -> str:
    """Say who is first of several, or who ties."""
    ranking = ranked_by_time(records)
    if ranking is None:
        return " – timed apart, and not ranked" if len(records) > 1 else ""
    return f" – first: {leaders(ranking)}"


def ranked_by_time(records: Sequence[Record]) -> metrics.Ranking | None:
    """Return who takes the least time by the medians of shared sweeps, None if they share none."""
    sweeps = {_short(r.solver): _of_sweeps(r) for r in records}
    apart = len({r.facts.get("together") for r in records}) > 1
    if apart or len(sweeps) < 2 or len({len(medians) for medians in sweeps.values()}) > 1:
        return None
    return metrics.ranking(sweeps)


def _of_sweeps(record: Record) -> metrics.Floats:
    """Return how good each sweep was, the logarithm of one over its median, (sweep,)."""
    seconds = record.arrays["seconds"]
    return -np.log(np.median(seconds, axis=-1) if seconds.ndim == 2 else seconds)


def _short(solver: str) -> str:
    return "Plumbob" if solver == COMPILED else solver


def _how(works: Sequence[Timed]) -> str:
    return (
        "pytest-benchmark, one core unless all are named, after a first call that may compile; "
        "each time is a call’s divided by what it does. All that is compared alternates in an "
        "order drawn by a seed, sweep after sweep; the interval is of the medians of sweeps, by "
        "order statistics, and two tie unless Fisher’s randomisation test of their differences, "
        f"sweep by sweep, gives less than 5 %. {steadiness(_noise(works))}"
    ).rstrip()


def _layout(question: str, subject: str, title: str, unit: str, shows: str) -> Layout:
    return Layout(
        question,
        f"timing_{subject}",
        title,
        subjects=partial(_timed, subject),
        columns=partial(_columns, unit),
        shows=lambda works: shows + (COPY_SENTENCE if any(timed.copy for timed in works) else ""),
        measured=_how,
        summary=partial(_summary, unit),
        figures=(figures.TIMINGS[subject],),
    )


kinematics = _layout(
    "Forward kinematics",
    "kinematics",
    "Time of forward kinematics, for one pose",
    "ns",
    "All joints’ positions and rotations. We check and normalise the quaternions given and "
    "return arrays; an engine’s results stay inside it. The copy reads as many bytes as the "
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
    "MuJoCo starts from a state that it has saved, and its results stay inside it. The copy beside "
    "local/global iterations moves what their triangular solves read: the factor’s nonzeros, twice "
    "an iteration.",
)


LAYOUTS = (kinematics, inverse_kinematics, cloth)
