"""The same cloth for every solver: work against precision, motions, limits of stability."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from ...figures.chart import Axis, Chart, Panel, Series, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...problems.falling_cloth import FALLING, FRAME, GRAVITY, MASS, SIDE
from ...tables.captions import Captions
from ...tables.columns import words_in
from ...tables.layout import Layout
from ...tables.results import Results, grouped, label, listed
from ...tables.table import NO_SUMMARY, Summary, words
from ..published import problem as published
from . import LIU, MISSING, MOTION, ONE_STEP, STABILITY, TARGETS
from .measurement import AMPLITUDE, BISECTION, GROWTH, REPEATS, STABILITY_SIZE, STABILITY_STEPS
from .readings import Point, points

# The cells of a row by the titles of their columns, and its records.
Row = dict[str, Any]
CAPTIONS = Captions(
    __file__,
    side=f"{SIDE:g}",
    mass=f"{MASS:g}",
    gravity=f"{GRAVITY:g}",
    fall=f"{FALLING * FRAME:g}",
    frame=words_in(FRAME, "ms"),
    repeats=str(REPEATS),
    stability_size=str(STABILITY_SIZE),
    amplitude=words(AMPLITUDE),
    growth=f"{GROWTH:g}",
    stability_steps=str(STABILITY_STEPS),
    bisection=words(BISECTION),
    liu_stiffness=words(int(published.LIU_2013_STIFFNESS)),
    liu_frame=words_in(published.LIU_2013_FRAME, "ms"),
    liu_tolerance=words(published.LIU_2013["newton"].settings["tolerance"]),
)
# A motion within this distance of the true one [m] is hard to tell from it by eye.
NEAR = 1e-2
# Larger errors are those of motions that diverged, and are not drawn.
MAX_ERROR = 10.0
ERRORS = {
    "error": "error |x − x*| / |y − x*|",
    "implicit": "rms distance [m]",
    "true": "rms distance [m]",
}


def work_precision(name: str, task: str, error: str, results: Results) -> Sketch | None:
    """Show an error against the time for a frame: a curve for each solver.

    Each stiffness has a column, each size a row.
    """
    visible = [point for point in points(results, task) if _is_visible(point, error)]
    cloths = [point for point in visible if not point.own]
    stiffnesses = sorted({point.stiffness for point in cloths})
    panels = [
        Panel(
            f"{size} × {size}, {stiffness:,.0f} N/m",
            _curves([p for p in cloths if (p.particles, p.stiffness) == (size, stiffness)], error),
        )
        for size in sorted({point.particles for point in cloths})
        for stiffness in stiffnesses
    ]
    own = grouped((point for point in visible if point.own), lambda point: point.own)
    panels += [Panel(cloth, _curves(group, error)) for cloth, group in own.items()]
    return chart_sketch(
        Chart(
            **CAPTIONS.figure(name),
            panels=tuple(panels),
            x=Axis("time for a frame [ms]", log=True),
            y=Axis(ERRORS[error], log=True),
            columns=len(stiffnesses) or len(panels),
            entrants=results.entrants,
        )
    )


def _curves(visible: Sequence[Point], error: str) -> tuple[Series, ...]:
    return tuple(
        series(solver, [1e3 * p.seconds for p in group], [p.values[error] for p in group])
        for solver, group in grouped(visible, lambda point: point.solver).items()
    )


def _is_visible(point: Point, error: str) -> bool:
    """Return whether a point reached its end, with an error that can be drawn."""
    is_whole = "wanted" not in point.values or point.is_whole
    return is_whole and point.seconds > 0 and 0 < point.values[error] < MAX_ERROR


step_chart = partial(work_precision, "work_precision_step", ONE_STEP, "error")
implicit_chart = partial(work_precision, "work_precision_implicit", MOTION, "implicit")
truth_chart = partial(work_precision, "work_precision_truth", MOTION, "true")


def _missing(results: Results) -> list[Row]:
    """Return a row for each engine that is missing."""
    records = results.all("cloth", task=MISSING)
    return [{"cloth": "every cloth", "solver": r.solver, **r.notes} for r in records]


def _step_rows(results: Results) -> list[Row]:
    groups = grouped(points(results, ONE_STEP), lambda point: (point.cloth, point.solver))
    return [*map(_step_row, groups.values()), *_missing(results)]


def _step_row(settings: Sequence[Point]) -> Row:
    """Return a solver's errors and times on a cloth, of the cheapest setting for each target."""
    best = min(settings, key=lambda point: point.values["error"])
    error, first = best.values["error"], settings[0]
    row: Row = {
        "points": settings,
        "cloth": first.cloth,
        "solver": first.solver,
        "smallest error": "diverged" if np.isinf(error) else error,
        "setting for the smallest error": best.rung,
        "remark": first.remark,
    }
    for target in TARGETS:
        arrivals = [point for point in settings if point.values["error"] <= float(target)]
        if arrivals:
            cheapest = min(arrivals, key=lambda point: point.seconds)
            row |= {f"time to {target}": cheapest.seconds, f"setting for {target}": cheapest.rung}
            row |= {target: cheapest}
    return row


def _step_summary(rows: Sequence[Row]) -> Summary:
    measured = [row for row in rows if "points" in row]
    sentences = [
        f"{cloth}: {listed([f'to {target} {_fastest(group, target)}' for target in TARGETS])}"
        for cloth, group in grouped(measured, lambda row: str(row["cloth"])).items()
    ]
    return Summary("Fastest solver in one step:", tuple(sentences)) if measured else NO_SUMMARY


def _fastest(rows: Sequence[Row], target: str) -> str:
    """Return the fastest of all solvers, and the fastest of all other engines."""
    arrivals: list[Point] = [row[target] for row in rows if target in row]
    arrivals.sort(key=lambda point: point.seconds)
    rivals = [point for point in arrivals if point.engine != arrivals[0].engine]
    leaders = [*arrivals[:1], *rivals[:1]]
    names = [f"{point.solver}, {words_in(point.seconds, 'ms')}" for point in leaders]
    return " (then ".join(names) + ")" * (len(names) > 1) or "none"


one_step = Layout(
    **CAPTIONS.of("cloth_peers_step"),
    subjects=_step_rows,
    summary=_step_summary,
    figures=(step_chart,),
)


def _motion_rows(results: Results) -> list[Row]:
    limits = {
        (record.solver, stiffness): cells
        for record in results.all("cloth", task=STABILITY)
        for stiffness, cells in _limits(record)
    }
    rows = [
        _motion_row(point, {} if point.own else limits.get((point.solver, point.stiffness), {}))
        for point in points(results, MOTION)
    ]
    return rows + _missing(results)


def _limits(record: Record) -> Iterator[tuple[float, Row]]:
    """Yield, by stiffness [N/m], the longest stable step and the limit of symplectic Euler [s]."""
    columns = record.values.stiffness, record.values.limit, 2.0 / record.values.frequency
    for stiffness, step, theory in np.transpose(columns).tolist():
        cells = {"2 / ω": theory, "stability": record}
        if not np.isnan(step):
            cells |= {"longest stable step": step, "stable up to": step / theory}
        yield stiffness, cells


def _motion_row(point: Point, limit: Row) -> Row:
    frame, details = point.number("seconds"), point.record.details
    stability = limit["stability"].details.remark if limit else ""
    return {
        "point": point,
        "cloth": point.cloth,
        "solver": point.solver,
        "setting for a frame": point.rung,
        "distance from implicit Euler": point.number("implicit"),
        "distance from the truth": point.number("true"),
        "time for a frame": frame,
        "remark": "; ".join(filter(None, (_fate(point), stability))),
        "frames": int(point.values["frames"]),
        "time for a simulated second": frame and metrics.ratio(frame, details.frame),
        **limit,
    }


def _fate(point: Point) -> str:
    """Return why a motion did not reach its end, "" if it did."""
    if point.values["diverged"]:
        return "diverged"
    if point.is_whole:
        return ""
    return point.remark or f"out of time before frame {int(point.values['frames']) + 1}"


def _motion_summary(rows: Sequence[Row]) -> Summary:
    motions: list[Point] = [row["point"] for row in rows if "point" in row]
    if not motions:
        return NO_SUMMARY
    diverged = list(dict.fromkeys(point.solver for point in motions if point.values["diverged"]))
    sentence = "No motion diverged."
    if diverged:
        sentence = f"Diverged with some settings: {listed(diverged)}."
    whole = grouped((point for point in motions if point.is_whole), lambda point: point.cloth)
    sentences = [f"{cloth}: {_nearest(group)}" for cloth, group in whole.items()]
    nearest = " Nearest solver to the truth:" if sentences else ""
    return Summary(sentence + nearest, (*sentences, *_stable(rows)))


def _nearest(whole: Sequence[Point]) -> str:
    best = min(whole, key=lambda point: point.values["true"])
    sentence = f"{best.solver} by {best.rung}, {words(best.values['true'])} m"
    near = [point for point in whole if point.values["true"] <= NEAR]
    if not near:
        return sentence
    fastest = min(near, key=lambda point: point.seconds)
    return (
        f"{sentence}; the fastest within {words(NEAR)} m {fastest.solver} by {fastest.rung}, "
        f"{words_in(fastest.seconds, 'ms')} a frame"
    )


def _stable(rows: Sequence[Row]) -> Iterable[str]:
    shares = {row["solver"]: row["stable up to"] for row in rows if "stable up to" in row}
    if shares:
        names = [f"{solver} {words(share)}" for solver, share in shares.items()]
        yield f"longest stable step in units of 2 / ω: {listed(names)}"


def _certainty(rows: Sequence[Row]) -> dict[str, str]:
    """Return the change of the true motions by halved steps [m], and the range of their order."""
    records = {id(row["point"].record): row["point"].record for row in rows if "point" in row}
    if not records:
        return dict.fromkeys(("unsure", "low", "high"), "–")
    orders = np.concatenate([record.values.order for record in records.values()])
    unsure = max(float(record.values.unsure.max()) for record in records.values())
    low, high = metrics.extent(orders)
    return {"unsure": words(unsure), "low": words(low), "high": words(high)}


motion = Layout(
    **CAPTIONS.of("cloth_peers_motion", _certainty),
    subjects=_motion_rows,
    ranked=lambda row: "point" not in row or row["point"].is_whole,
    summary=_motion_summary,
    figures=(implicit_chart, truth_chart),
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


def _vertices(rows: Sequence[Row]) -> dict[str, str]:
    return {"vertices": words(int(rows[0]["record"].values.vertices))}


def _liu_summary(rows: Sequence[Row]) -> Summary:
    sentences = (
        f"{row['solver']}, {row['setting for a frame']}: {words_in(row['our time'], 'ms')} with an "
        f"error of {words(row['our error'])}, published {words_in(row['published time'], 'ms')}"
        for row in rows
    )
    return Summary(f"A frame of {_vertices(rows)['vertices']} vertices:", tuple(sentences))


liu_2013 = Layout(
    **CAPTIONS.of("cloth_liu_2013", _vertices),
    subjects=lambda results: [
        _liu_row(record)
        for record in results.all("cloth", task=LIU)
        if record.solver in published.LIU_2013
    ],
    summary=_liu_summary,
    compared=0,
)

LAYOUTS = (one_step, motion, liu_2013)
