"""Times of forward kinematics, solves and steps, compared with the engines and a plain copy."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...figures.chart import MARKS, Panel, Series, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...peers import catalogue
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Layout, Row
from ...tables.results import (
    PRECISION,
    Results,
    by_problem,
    grouped,
    leaders,
    most_often,
    solvers,
    steadiness,
)
from ...tables.table import UNITS, Column, Summary, words
from .case import COMPILED, LIMIT, PRESET

CAPTIONS = Captions(__file__)


def is_ranked(record: Record) -> bool:
    """Return whether an implementation is compared with others."""
    return catalogue.find(record.solver).ranked


def median_time(record: Record) -> float:
    """Return the median of all rounds [s]."""
    return metrics.timing(record.values.seconds).median


def ranked_by_time(records: Sequence[Record]) -> metrics.Ranking | None:
    """Return the solvers by the medians of shared sweeps, None without any."""
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
    return declared_chart(chart, panels, results.entrants, rows=rows)


def _marks(solver: str, records: Sequence[Record], works: list[str], scale: float) -> Series:
    times = np.array([metrics.timing(record.values.seconds)[:3] for record in records])
    median, low, high = scale * times.T
    y = [works.index(record.problem) for record in records]
    return series(solver, median, y, (low, high), form=MARKS)


def _rows(subject: str, results: Results) -> list[Row]:
    """Return a row for each time of a subject, without plain copies."""
    records = results.all("timing", subject=subject)
    works = by_problem(records)
    by_solver = {name: {r.solver: r for r in works[name]} for name in works}
    return [_row(r, by_solver[r.problem]) for r in records if r.solver != LIMIT]


def _row(record: Record, by_solver: dict[str, Record]) -> Row:
    """Return the row of a time, given all records of the work."""
    compiled, copy = by_solver.get(COMPILED), by_solver.get(LIMIT)
    median, low, high, rounds, interval = metrics.timing(record.values.seconds)
    half = (interval.high - interval.low) / (2.0 * median)
    baseline = None if compiled in (None, record) else compiled
    row = {
        "record": record,
        "work": record.title,
        "implementation": record.solver,
        "median": median,
        "95 % interval of the median, ±": None if math.isnan(half) else half,
        "relative to compiled": baseline and metrics.ratio(median, median_time(baseline)),
        "remark": "; ".join(_remarks(record, by_solver)),
        "10th percentile": low,
        "90th percentile": high,
        "rounds": rounds,
    }
    if copy is None:
        return row
    seconds = median_time(copy)
    return {
        **row,
        "copy": copy,
        "relative to a plain copy": metrics.ratio(median, seconds),
        "bandwidth of the copy": float(copy.values.moved) / seconds / 1e9,
    }


def _remarks(record: Record, by_solver: dict[str, Record]) -> Iterator[str]:
    """Yield the error left by a tolerance, the share of setting qpos, and noise."""
    if record.values.error is not None:
        yield f"error {words(record.values.error)}"
    if record.solver == catalogue.MUJOCO and (preset := by_solver.get(PRESET)):
        share = 1.0 - median_time(preset) / median_time(record)
        yield f"qpos[:] = q takes {100 * share:.0f} %"
    if record.values.noise > PRECISION:
        yield "noisy"


def _columns(unit: str, rows: Sequence[Row]) -> list[Column]:
    """Return the columns in the unit of a subject; without copies their columns are left out."""
    return [
        replace(column, unit=unit) if column.unit == "time" else column
        for column in CAPTIONS.columns("timing")
        if not rows or any(column.title in row for row in rows)
    ]


def _noise(rows: Sequence[Row]) -> float:
    """Return the largest variation of a fixed loop, NaN if unknown."""
    return max((row["record"].values.noise for row in rows), default=math.nan)


def _summary(unit: str, rows: Sequence[Row]) -> Summary:
    """Return the times of each work, a point for each group of works, of what is ranked."""
    points = []
    for name, group in grouped(rows, lambda row: str(row["record"].values.group)).items():
        works = grouped(group, lambda row: str(row["record"].values.work)).items()
        sentences = [f"{work}: {_times(unit, members)}" for work, members in works]
        points.append(f"{name} – {'; '.join(sentences)}")
    rivals = [row for row in rows if is_ranked(row["record"])]
    by_work = grouped(rivals, lambda row: str(row["work"])).values()
    rankings = [ranked_by_time([row["record"] for row in members]) for members in by_work]
    firsts = [ranking.order[0] for ranking in rankings if ranking]
    fastest = "No two implementations were timed together."
    if firsts:
        fastest = f"The fastest implementation is {most_often(firsts, 'comparison')}."
    noise = _noise(rows)
    warning = f" {steadiness(noise)}" if noise > PRECISION else ""
    return Summary(fastest + warning, tuple(points))


def _times(unit: str, rows: Sequence[Row]) -> str:
    """Return the times of some work, and the fastest implementation, with ties."""
    rivals = [row for row in rows if is_ranked(row["record"])]
    times = ", ".join(_time(row, unit) for row in rivals)
    if rivals and "copy" in rivals[0]:
        times += f" ({words(rivals[0]['relative to a plain copy'])} times a plain copy)"
    ranking = ranked_by_time([row["record"] for row in rivals])
    if ranking is None:
        return times + (" – timed separately, not ranked" if len(rivals) > 1 else "")
    return f"{times} – first: {leaders(ranking)}"


def _time(row: Row, unit: str) -> str:
    half = row["95 % interval of the median, ±"]
    width = "" if half is None else f" ± {round(100 * half, 1):g} %"
    return f"{_label(row['implementation'])} {words_in(row['median'], unit)}{width}"


def _layout(subject: str, unit: str) -> Layout:
    return CAPTIONS.layout(
        f"timing_{subject}",
        partial(_rows, subject),
        partial(_summary, unit),
        measured=lambda rows: {"steadiness": steadiness(_noise(rows))},
        columns=partial(_columns, unit),
        ranked=lambda row: is_ranked(row["record"]),
        figures=(partial(timing_chart, subject, unit),),
    )


kinematics, jacobians, inverse_kinematics, cloth = LAYOUTS = (
    _layout("kinematics", "ns"),
    _layout("jacobians", "ns"),
    _layout("ik", "µs"),
    _layout("cloth", "µs"),
)
