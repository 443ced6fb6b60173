"""Times of forward kinematics, Jacobians, solves and steps, beside the engines and a plain copy.

The cases of a group take turns in a process of their own.
"""

import functools
import math
import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter, process_time
from timeit import Timer
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import set_backend, set_num_threads

from ..clock import pace
from ..measure import metrics
from ..measure.block import Block, Measured, Scale
from ..measure.isolation import in_a_fresh_process
from ..measure.progress import announce
from ..measure.record import Record
from ..measure.values import Fact, Floats2, Values
from ..peers import catalogue
from ..peers.protocol import describe

COMPILED, PREPARED = catalogue.COMPILED.name, catalogue.PREPARED.name
PLAIN, LIMIT = catalogue.PLAIN.name, catalogue.LIMIT.name
PRESET, TIGHT = catalogue.PRESET.name, catalogue.TIGHT.name
# Time limit of a case [s].
PATIENCE = 1800.0
# Sweeps over the cases of a group, in random order: the drift of the machine affects all. Nine is
# the least number with a median's interval inside the extremes.
SWEEPS = 9
# Rounds of a case in all sweeps.
ROUNDS = 200
# A call shorter than this time [s] is repeated once, uncounted, before each of its later sweeps.
# Caches are then as in a loop of calls.
QUICK = 1e-3


class RoundTimes(Values, frozen=True, kw_only=True):
    """The seconds of an operation, (sweep, round), and the bytes moved as a yardstick."""

    subject: Fact[str]
    group: Fact[str]
    work: Fact[str]
    noise: Fact[float] = math.nan  # half the width of the middle 80 % of a fixed loop's times
    together: Fact[str] = ""  # a word that all cases timed in turns have in common
    seconds: Floats2
    moved: float
    error: float | None = None  # that a tolerance leaves, relative to the length of the step


KINDS = {"": RoundTimes}


class TimedWork(NamedTuple):
    """Work to be timed with every implementation."""

    problem: str  # the name in the records
    subject: str  # kinematics, ik or cloth: each has a table and a figure
    group: str  # the model that the work is done on, such as "10 balls"
    title: str  # the name of the work within its group

    @property
    def facts(self) -> dict[str, str]:
        """The names, as facts of a block."""
        title = f"{self.group}, {self.title}"
        return {"subject": self.subject, "group": self.group, "work": self.title, "title": title}


@dataclass(frozen=True)
class TimedCase:
    """Work to be timed with an implementation."""

    work: TimedWork
    solver: str  # the implementation
    prepare: Callable[[], Callable[[], Any]]  # sets up and returns the call to be timed
    operations: int = 1  # poses, solves or steps of one call; times are for one
    moved: int = 0  # bytes that one call reads and writes, for a yardstick of memory
    backend: str = "numba"  # of the reference
    cores: int | None = 1  # None for all
    error: Callable[[], float] | None = None  # of the result, where it depends on a tolerance

    @property
    def name(self) -> str:
        """Problem and solver."""
        return f"{self.work.problem}, {self.solver}"


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield a block a case; its size is the time for measuring [s]."""
    run = secrets.token_hex(8)
    for case in cases():
        measure = partial(measure_case, run, case, scale.seconds)
        settings, seconds = {"operations": case.operations}, scale.seconds
        yield Block("timing", case.work.problem, case.solver, measure, settings, size=seconds,
                    facts=case.work.facts, budget=seconds)  # fmt: skip


@functools.cache
def cases() -> tuple[TimedCase, ...]:
    """Return the cases of all subjects; engines are imported only now."""
    from .parts import timing_cases

    return tuple(timing_cases.cases())


def compared(subject: str, group: str) -> list[TimedCase]:
    """Return the cases of a group, which are compared."""
    return [c for c in cases() if (c.work.subject, c.work.group) == (subject, group)]


def measure_case(run: str, case: TimedCase, seconds: float) -> Measured:
    """Return the rounds of a case, measured together with its group.

    Its facts are the variation of a fixed loop meanwhile, and a word common to the group.

    Raises:
        RuntimeError: if there are no rounds; the message says why.
    """
    group = case.work.subject, case.work.group
    results, i = _measure_group(run, *group, seconds), compared(*group).index(case)
    if trouble := results["troubles"][i]:
        raise RuntimeError(trouble)
    rounds = np.array(results["rounds"][i]) / case.operations
    error = {"error": case.error()} if case.error else {}
    return {"seconds": rounds, "moved": case.moved / case.operations, **error, **results["facts"]}


@functools.lru_cache(maxsize=1)  # the blocks of a group follow one another
def _measure_group(run: str, subject: str, group: str, seconds: float) -> dict[str, Any]:
    results = in_a_fresh_process(PATIENCE, sweep, subject, group, seconds)
    noise = metrics.relative_spread(np.array(results["paces"]))
    return {**results, "facts": {"noise": noise, "together": secrets.token_hex(4)}}


def sweep(subject: str, group: str, seconds: float) -> dict[str, Any]:
    """Time each case of a group for so long [s], sweep after sweep.

    Return the rounds of each case [s], (sweep, round), its first exception, and the time of a fixed
    loop beside each measurement.
    """
    cases = compared(subject, group)
    timers = [_rounds(case, seconds) for case in cases]
    rounds: list[list[list[float]]] = [[] for _ in cases]
    troubles, paces, generator = [""] * len(cases), [], np.random.default_rng(len(cases))
    for i in range(SWEEPS):
        announce(f"{group}, sweep {i + 1} of {SWEEPS}")
        for number in generator.permutation(len(cases)):
            paces.append(pace())
            if troubles[number]:
                continue
            case = cases[number]
            try:
                with set_backend(case.backend), set_num_threads(case.cores):
                    rounds[number].append(next(timers[number]))
            except Exception as error:
                rounds[number], troubles[number] = [], describe(error)
    return {"rounds": rounds, "troubles": troubles, "paces": paces}


def _rounds(case: TimedCase, seconds: float) -> Iterator[list[float]]:
    """Yield the times of a call in the rounds of each sweep [s].

    The call is prepared, compiled and counted before the first.
    """
    call = case.prepare()
    call()  # may compile
    timer = Timer(call, timer=process_time if case.cores == 1 else perf_counter)
    loops, count = shape(timer, seconds)
    first = [t / loops for t in timer.repeat(count, loops)]
    yield first
    while True:
        if min(first) < QUICK:
            call()
        yield [t / loops for t in timer.repeat(count, loops)]


def shape(timer: Timer, seconds: float) -> tuple[int, int]:
    """Return the calls of a round, and the rounds of a sweep, that take so long in total.

    The processor's clock takes longer than a short call, so many calls are timed at once.
    """
    shortest = seconds / ROUNDS
    loops, single = 1, timer.timeit(1)
    for _ in range(2):
        loops = max(1, math.ceil(shortest / single))
        single = min(timer.repeat(5, loops)) / loops if single < shortest else single
    loops = max(1, math.ceil(shortest / single))
    return loops, max(1, int(seconds / SWEEPS / (loops * single)))


# What is shown.

import re

from ..figures.chart import MARKS, Panel, Series, declared_chart, series
from ..figures.sketch import Sketch
from ..tables.captions import Captions
from ..tables.columns import folded, text, words_in
from ..tables.layout import Layout
from ..tables.results import (
    PRECISION,
    Results,
    by_problem,
    first_of_kinds,
    grouped,
    leaders,
    only_first,
    solvers,
    steadiness,
)
from ..tables.table import UNITS, Column, Summary, words

CAPTIONS = Captions(__file__)


def is_ranked(record: Record) -> bool:
    """Return whether an implementation is compared with others."""
    return catalogue.find(record.solver).ranked


def ranked_by_time(records: Sequence[Record]) -> metrics.Ranking | None:
    """Return the ranked solvers by the medians of shared sweeps, None without any."""
    records = list(filter(is_ranked, records))
    sweeps = {_label(record.solver): _scores(record) for record in records}
    groups = {record.values.together for record in records}
    if len(groups) > 1 or len(sweeps) < 2 or len({len(medians) for medians in sweeps.values()}) > 1:
        return None
    return metrics.ranking(sweeps)


def _label(solver: str) -> str:
    return "Plumbob" if solver == COMPILED else solver


def _scores(record: Record) -> metrics.Floats:
    """Return the negative logarithm of the median of each sweep, (sweep,)."""
    seconds = record.values.seconds
    return -np.log(np.median(seconds, axis=-1) if seconds.ndim == 2 else seconds)


class TimeRow(NamedTuple):
    """A time, the plain copy of as many bytes, and the medians of the work by solver [s]."""

    time: Record
    copy: Record | None
    medians: dict[str, float]
    spread: metrics.Timing  # median, interval and percentiles of the rounds [s]
    ranking: metrics.Ranking | None  # of the work

    @property
    def kind(self) -> str:
        """The kind of the work: "one pose a call", "many poses a call"."""
        return re.sub(r"^[\d,]+ (?=poses|targets)", "many ", self.time.values.work)

    @property
    def half_width(self) -> float | None:
        """Half of the interval of the median, over the median; None if unknown."""
        interval = self.spread.interval
        half = (interval.high - interval.low) / (2.0 * self.spread.median)
        return None if math.isnan(half) else half

    def relative_to(self, solver: str) -> float | None:
        """Return the median over that of another solver, None without it."""
        if solver == self.time.solver or solver not in self.medians:
            return None
        return metrics.ratio(self.spread.median, self.medians[solver])

    @property
    def bandwidth(self) -> float | None:
        """The bandwidth of the copy [GB/s]."""
        return float(self.copy.values.moved) / self.medians[LIMIT] / 1e9 if self.copy else None


def _rows(subject: str, results: Results) -> list[TimeRow]:
    """Return a row for each time of a subject, without plain copies."""
    rows = []
    for records in by_problem(results.all("timing", subject=subject)).values():
        spreads = {record.solver: metrics.timing(record.values.seconds) for record in records}
        medians = {solver: spread.median for solver, spread in spreads.items()}
        times = {record.solver: record for record in records}
        copy, ranking = times.pop(LIMIT, None), ranked_by_time(records)
        rows += [TimeRow(t, copy, medians, spreads[name], ranking) for name, t in times.items()]
    return rows


def _remarks(row: TimeRow) -> Iterator[str]:
    """Yield the error left by a tolerance, the share of setting qpos, and noise."""
    values = row.time.values
    if values.error is not None:
        yield f"error {words(values.error)}"
    if row.time.solver == catalogue.MUJOCO and (preset := row.medians.get(PRESET)):
        share = 1.0 - preset / row.medians[catalogue.MUJOCO]
        yield f"qpos[:] = q takes {100 * share:.0f} %"
    if values.noise > PRECISION:
        yield "noisy"


def _columns(unit: str, rows: Sequence[TimeRow]) -> list[Column]:
    """Return the columns in the unit of a subject; without copies their columns are left out."""
    columns = [
        text("work", lambda row: row.time.title),
        text("implementation", lambda row: row.time.solver),
        Column("median", unit, best="least", read=lambda row: row.spread.median),
        Column("95 % interval of the median, ±", "%", read=lambda row: row.half_width),
        Column("relative to compiled", read=lambda row: row.relative_to(COMPILED)),
        text("remark", lambda row: "; ".join(_remarks(row))),
        *folded(text("kind of work", lambda row: row.kind)),
        Column("10th percentile", unit, folded=True, read=lambda row: row.spread.low),
        Column("90th percentile", unit, folded=True, read=lambda row: row.spread.high),
        Column("rounds", folded=True, read=lambda row: row.spread.rounds),
    ]
    if not rows or any(row.copy for row in rows):
        columns += [
            Column("relative to a plain copy", folded=True, read=lambda r: r.relative_to(LIMIT)),
            Column("bandwidth of the copy", "GB/s", folded=True, read=lambda row: row.bandwidth),
        ]
    return columns


def _noise(rows: Sequence[TimeRow]) -> float:
    """Return the largest variation of a fixed loop, NaN if unknown."""
    return max((row.time.values.noise for row in rows), default=math.nan)


def _summary(unit: str, rows: Sequence[TimeRow]) -> Summary:
    """Return the times of each work, a point for each group of works, of what is ranked."""
    points = []
    for name, group in grouped(rows, lambda row: row.time.values.group).items():
        works = grouped(group, lambda row: row.time.values.work).items()
        sentences = [f"{work}: {_times(unit, members)}" for work, members in works]
        points.append(f"{name} – {'; '.join(sentences)}")
    ranked = {row.time.title: row for row in rows if row.ranking}
    firsts = [(row.kind, only_first(row.ranking)) for row in ranked.values() if row.ranking]
    fastest = "No two implementations were timed together."
    if firsts:
        fastest = f"Ties aside, the fastest is {first_of_kinds(firsts, 'comparison')}."
    noise = _noise(rows)
    warning = f" {steadiness(noise)}" if noise > PRECISION else ""
    return Summary(fastest + warning, tuple(points))


def _times(unit: str, rows: Sequence[TimeRow]) -> str:
    """Return the times of some work, and the fastest implementation, with ties."""
    rivals = [row for row in rows if is_ranked(row.time)]
    times = ", ".join(_time(row, unit) for row in rivals)
    if rivals and rivals[0].copy:
        times += f" ({words(rivals[0].relative_to(LIMIT))} times a plain copy)"
    ranking = rows[0].ranking
    if ranking is None:
        return times + (" – timed separately, not ranked" if len(rivals) > 1 else "")
    return f"{times} – first: {leaders(ranking)}"


def _time(row: TimeRow, unit: str) -> str:
    half = row.half_width
    width = "" if half is None else f" ± {round(100 * half, 1):g} %"
    return f"{_label(row.time.solver)} {words_in(row.spread.median, unit)}{width}"


def _leads(row: TimeRow) -> dict[str, bool]:
    """Return whether an implementation is first, or ties with the first."""
    is_first = row.ranking is not None and _label(row.time.solver) in row.ranking.first
    return {"median": is_first} if is_ranked(row.time) else {}


def timing_chart(subject: str, unit: str, results: Results) -> Sketch | None:
    """Show the medians of a subject: a row for each work, a mark for each implementation."""
    records = results.all("timing", subject=subject)
    works = by_problem(records)
    by_solver = (
        _marks(solver, [r for r in records if r.solver == solver], list(works), UNITS[unit])
        for solver in solvers(records)
    )
    rows = tuple(group[0].title for group in works.values())
    chart, panels = CAPTIONS.figure(f"timing_{subject}"), [Panel("", tuple(by_solver))]
    return declared_chart(chart, panels, results.user_solvers, rows=rows)


def _marks(solver: str, records: Sequence[Record], works: list[str], scale: float) -> Series:
    times = np.array([metrics.timing(record.values.seconds)[:3] for record in records])
    median, low, high = scale * times.T
    y = [works.index(record.problem) for record in records]
    return series(solver, median, y, (low, high), form=MARKS)


def _layout(subject: str, unit: str) -> Layout:
    return CAPTIONS.layout(
        f"timing_{subject}",
        partial(_rows, subject),
        partial(_summary, unit),
        measured=lambda rows: {"steadiness": steadiness(_noise(rows))},
        columns=partial(_columns, unit),
        ranked=lambda row: is_ranked(row.time),
        leads=_leads,
        figures=(partial(timing_chart, subject, unit),),
    )


kinematics, jacobians, inverse_kinematics, cloth = LAYOUTS = (
    _layout("kinematics", "ns"),
    _layout("jacobians", "ns"),
    _layout("ik", "µs"),
    _layout("cloth", "µs"),
)
