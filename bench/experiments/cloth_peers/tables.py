"""The same cloth for every solver: steps to the minimiser, and motions to the truth.

The two problems have a table each. Solvers that minimise the objective of an implicit step are in
both, all others only in the table of motions.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...figures.chart import Panel, Series, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...peers.peer import LINEARISED
from ...problems import published
from ...problems.falling_cloth import FALLING, FRAME, GRAVITY, MASS, SIDE
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Row
from ...tables.results import Results, counted, grouped, label, listed, most_often
from ...tables.table import NO_SUMMARY, Summary, words
from . import LIU, MISSING, MOTION, MOTION_TARGETS, NEAR, ONE_STEP, SOLVED, STABILITY, TARGETS
from .measurement import AMPLITUDE, BISECTION, GROWTH, STABILITY_SIZE, STABILITY_STEPS
from .readings import Point, points

CAPTIONS = Captions(
    __file__,
    side=f"{SIDE:g}",
    mass=f"{MASS:g}",
    gravity=f"{GRAVITY:g}",
    fall=f"{FALLING * FRAME:g}",
    frame=words_in(FRAME, "ms"),
    solved=SOLVED,
    near=NEAR,
    stability_size=str(STABILITY_SIZE),
    amplitude=words(AMPLITUDE),
    growth=f"{GROWTH:g}",
    stability_steps=str(STABILITY_STEPS),
    bisection=words(BISECTION),
    liu_stiffness=words(int(published.LIU_2013_STIFFNESS)),
    liu_frame=words_in(published.LIU_2013_FRAME, "ms"),
    liu_tolerance=words(published.LIU_2013["newton"].settings["tolerance"]),
)
# Larger errors belong to diverged motions, and are not drawn.
MAX_ERROR = 10.0


def work_precision(name: str, task: str, results: Results) -> Sketch | None:
    """Show an error against the time for a frame: a curve for each solver.

    Each stiffness has a column, each size a row.
    """
    visible = [p for p in points(results, task) if p.seconds > 0 and 0 < p.error < MAX_ERROR]
    cloths = [point for point in visible if not point.own]
    stiffnesses = sorted({point.stiffness for point in cloths})
    panels = [
        Panel(
            f"{size} × {size}, {stiffness:,.0f} N/m",
            _curves([p for p in cloths if (p.particles, p.stiffness) == (size, stiffness)]),
        )
        for size in sorted({point.particles for point in cloths})
        for stiffness in stiffnesses
    ]
    own = grouped((point for point in visible if point.own), lambda point: point.own)
    panels += [Panel(cloth, _curves(group)) for cloth, group in own.items()]
    columns = len(stiffnesses) or len(panels)
    return declared_chart(CAPTIONS.figure(name), panels, results.entrants, columns=columns)


def _curves(visible: Sequence[Point]) -> tuple[Series, ...]:
    return tuple(
        series(solver, [1e3 * p.seconds for p in group], [p.error for p in group])
        for solver, group in grouped(visible, lambda point: point.solver).items()
    )


step_chart = partial(work_precision, "work_precision_step", ONE_STEP)
truth_chart = partial(work_precision, "work_precision_truth", MOTION)


def _missing(results: Results) -> list[Row]:
    """Return a row for each missing engine."""
    records = results.all("cloth", task=MISSING)
    return [{"cloth": "every cloth", "solver": r.solver, **r.notes} for r in records]


def _rows(
    results: Results, task: str, targets: Mapping[str, float], limits: Mapping[Any, Row]
) -> list[Row]:
    """Return a row for each solver on each cloth, and for each missing engine."""
    solvers = grouped(points(results, task), lambda point: (point.cloth, point.solver))
    rows = [_row(settings, targets, limits) for settings in solvers.values()]
    return [*rows, *_missing(results)]


def _row(settings: Sequence[Point], targets: Mapping[str, float], limits: Mapping[Any, Row]) -> Row:
    """Return the cells of a solver on a cloth: the cheapest setting for each target."""
    best, first = min(settings, key=lambda point: point.error), settings[0]
    row: Row = {
        "points": settings,
        "best": best,
        "cloth": first.cloth,
        "solver": first.solver,
        "smallest error": best.error if best.is_whole else "diverged",
        "setting for the smallest error": best.rung,
        "difference between sweeps": max(point.spread for point in settings),
        "slowest over fastest sweep": max(point.drift for point in settings),
        **({} if first.own else limits.get((first.solver, first.stiffness), {})),
    }
    for target, limit in targets.items():
        near = [point for point in settings if point.error <= limit]
        if near:
            cheapest = min(near, key=lambda point: point.seconds)
            row |= {f"time to {target}": cheapest.seconds, f"setting for {target}": cheapest.rung}
            row |= {target: cheapest}
    return row | {"remark": "; ".join(_remarks(row))}


def _remarks(row: Row) -> Iterator[str]:
    """Yield the remarks on a solver, each with its settings."""
    settings: list[Point] = row["points"]
    if settings[0].record.details.kind == LINEARISED and len(settings) == 1:
        yield "one linearised step"
    for remark, group in grouped(settings, lambda point: point.remark).items():
        if remark:
            rungs = f"{listed([point.rung for point in group])}: "
            yield (rungs if len(group) < len(settings) else "") + remark
    if "stability" in row and row["stability"].details.remark:
        yield row["stability"].details.remark


def _rounding(rows: Sequence[Row]) -> dict[str, str]:
    """Return the range of the errors of minimisers rounded to single precision."""
    records = [row["points"][0].record for row in rows if "points" in row]
    if not records:
        return dict.fromkeys(("rounding", "agreement"), "–")
    low, high = metrics.extent(np.concatenate([record.values.rounding for record in records]))
    ends = dict.fromkeys((words(low), words(high)))
    return {"rounding": " to ".join(ends), **_agreement(rows)}


def _agreement(rows: Sequence[Row]) -> dict[str, str]:
    """Return a sentence on the drift of times, and on solvers whose sweeps gave other errors."""
    measured = [row for row in rows if "points" in row]
    differing = {row["solver"]: 0 for row in measured if row["difference between sweeps"] > 0.0}
    drift = words(max([1.0, *(row["slowest over fastest sweep"] for row in measured)]))
    errors = f"equal to the bit but for {listed(list(differing))}" if differing else "the same bits"
    sweeps = max([1, *(point.sweeps for row in measured for point in row["points"])])
    sentence = f"The times of {counted(sweeps, 'sweep')} differ by a factor of at most {drift}"
    return {"agreement": f"{sentence}; the errors are {errors}."}


def _summary(title: str, targets: Mapping[str, float], rows: Sequence[Row]) -> Summary:
    measured = [row for row in rows if "points" in row]
    sentences = [
        f"{cloth}: {listed([f'to {target} {_fastest(group, target)}' for target in targets])}"
        for cloth, group in grouped(measured, lambda row: str(row["cloth"])).items()
    ]
    if not measured:
        return NO_SUMMARY
    target = [*targets][-1]
    arrivals = [row[target] for row in measured if target in row]
    firsts = [
        min(of_cloth, key=lambda point: point.seconds).solver
        for of_cloth in grouped(arrivals, lambda point: point.cloth).values()
    ]
    sentence = f"No solver reaches {target}, {title}."
    if firsts:
        sentence = f"The fastest to {target}, {title}, is {most_often(firsts, 'cloth')}."
    return Summary(sentence, tuple(sentences))


def _fastest(rows: Sequence[Row], target: str) -> str:
    """Return the fastest of all solvers, and the fastest of all other engines."""
    arrivals: list[Point] = [row[target] for row in rows if target in row]
    arrivals.sort(key=lambda point: point.seconds)
    rivals = [point for point in arrivals if point.engine != arrivals[0].engine]
    leaders = [*arrivals[:1], *rivals[:1]]
    names = [f"{point.solver}, {words_in(point.seconds, 'ms')}" for point in leaders]
    return " (then ".join(names) + ")" * (len(names) > 1) or "none"


one_step = CAPTIONS.layout(
    "cloth_peers_step",
    lambda results: _rows(results, ONE_STEP, TARGETS, {}),
    partial(_summary, "an error of one implicit step", TARGETS),
    measured=_rounding,
    figures=(step_chart,),
)


def _motion_rows(results: Results) -> list[Row]:
    limits = {
        (record.solver, stiffness): cells
        for record in results.all("cloth", task=STABILITY)
        for stiffness, cells in _limits(record)
    }
    return _rows(results, MOTION, MOTION_TARGETS, limits)


def _limits(record: Record) -> Iterator[tuple[float, Row]]:
    """Yield, by stiffness [N/m], the longest stable step and the limit of symplectic Euler [s]."""
    columns = record.values.stiffness, record.values.limit, 2.0 / record.values.frequency
    for stiffness, step, theory in np.transpose(columns).tolist():
        cells = {"2 / ω": theory, "stability": record}
        if not np.isnan(step):
            cells |= {"longest stable step": step, "stable up to": step / theory}
        yield stiffness, cells


def _certainty(rows: Sequence[Row]) -> dict[str, str]:
    """Return the change of the true motions by halved steps, and the range of their order."""
    records = [row["points"][0].record for row in rows if "points" in row]
    if not records:
        return dict.fromkeys(("unsure", "low", "high", "agreement"), "–")
    orders = np.concatenate([record.values.order for record in records])
    unsure = words_in(max(float(record.values.unsure.max()) for record in records), "%")
    low, high = metrics.extent(orders)
    numbers = {"unsure": unsure, "low": words(low), "high": words(high)}
    return {**numbers, **_agreement(rows)}


motion = CAPTIONS.layout(
    "cloth_peers_motion",
    _motion_rows,
    partial(_summary, "a distance from the true motion", MOTION_TARGETS),
    measured=_certainty,
    figures=(truth_chart,),
)


def _liu_row(record: Record) -> Row:
    frame = published.LIU_2013[record.solver]
    return {
        "record": record,
        "solver": label(record.solver),
        "setting for a frame": frame.work,
        "published time": frame.seconds,
        "our time": metrics.spread(record.values.seconds).median,
        "our error": record.values.error,
    }


def _liu_summary(rows: Sequence[Row]) -> Summary:
    sentences = (
        f"{row['solver']}, {row['setting for a frame']}: {words_in(row['our time'], 'ms')} with an "
        f"error of {words(row['our error'])}, published {words_in(row['published time'], 'ms')}"
        for row in rows
    )
    ratios = [row["published time"] / row["our time"] for row in rows]
    low, high = map(words, metrics.extent(np.array(ratios)))
    sentence = f"On another machine, our times are {low} to {high} times shorter."
    return Summary(sentence, tuple(sentences))


liu_2013 = CAPTIONS.layout(
    "cloth_liu_2013",
    lambda results: [
        _liu_row(record)
        for record in results.all("cloth", task=LIU)
        if record.solver in published.LIU_2013
    ],
    _liu_summary,
    measured=lambda rows: {"vertices": words(rows[0]["record"].values.vertices)},
    compared=0,
)

LAYOUTS = (one_step, motion, liu_2013)
