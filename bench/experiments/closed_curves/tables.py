"""How far joints rotate from frame to frame along closed curves: the lab's third question."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...figures.chart import SPAN, Axis, Chart, Panel, series
from ...figures.sketch import Sketch, chart_sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import folded, greatest, least, spread_of, text, words_in
from ...tables.layout import Layout
from ...tables.results import Results, by_problem, grouped, label, settings
from ...tables.table import Column, Summary, in_unit, words
from .. import arm
from ..chain.tables import within_tolerance
from . import COHERENT, COLD, CURVE, DRIFT, WARM

MODES = (COLD, WARM, COHERENT)
# The step that closes a curve is as large as the others if it exceeds them by at most this share.
ALIKE = 0.01


class CurveMotions(NamedTuple):
    """The motions of a solver along a curve, by mode, and its drift over repetitions.

    Only the curve that is repeated has drifts.
    """

    by_mode: Mapping[str, Record]
    drifts: Mapping[str, Record]

    @property
    def shared_iterations(self) -> int:
        """The iterations over all frames at once: the least that any frame has more than warm."""
        coherent, warm = (self.by_mode[mode].values.iterations for mode in (COHERENT, WARM))
        return int(metrics.extent(coherent - warm)[0])

    def drift(self, mode: str, repetition: int) -> float | None:
        """Return the drift after a repetition [rad], None where it was not measured."""
        record = self.drifts.get(mode)
        return float(record.values.drift[repetition - 1]) if record else None


def _motions(results: Results) -> list[CurveMotions]:
    """Return the curves that were followed in all modes."""
    followed, drifts = (_by_mode(results, task) for task in (CURVE, DRIFT))
    return [
        CurveMotions(by_mode, drifts.get((problem.replace("arm/", "drift/"), solver), {}))
        for (problem, solver), by_mode in followed.items()
        if by_mode.keys() >= set(MODES)
    ]


def _by_mode(results: Results, task: str) -> dict[tuple[str, str], dict[str, Record]]:
    groups = grouped(results.all("tracking", task=task), lambda r: (r.problem, r.solver))
    return {key: {r.details.mode: r for r in records} for key, records in groups.items()}


def _largest_angle(record: Record) -> float:
    """Return the largest rotation of a joint between neighbouring frames [rad]."""
    return metrics.spread(record.values.largest_angle[:-1]).largest


def _closing_angle(record: Record) -> float:
    """Return the largest rotation of a joint from the last frame back to the first [rad]."""
    return float(record.values.largest_angle[-1])


def _summary(rows: Sequence[CurveMotions]) -> Summary:
    pairs = [(row.by_mode[WARM], row.by_mode[COHERENT]) for row in rows]
    smoother = sum(_largest_angle(coherent) < _largest_angle(warm) for warm, coherent in pairs)
    closed = sum(_closing_angle(c) <= (1.0 + ALIKE) * _largest_angle(c) for _, c in pairs)
    return Summary(
        "A coherent motion solves all frames together, so that the joints rotate as little as they "
        "can from each frame to the next. The largest rotation of a joint is smaller than with "
        f"warm starts in {smoother} of {len(rows)} cases, and in {closed} the step from the last "
        "frame back to the first is no larger than others. The largest of all, and the frames "
        "within tolerance:",
        tuple(_points(rows)),
    )


def _points(rows: Sequence[CurveMotions]) -> Iterator[str]:
    for mode in MODES:
        records = [row.by_mode[mode] for row in rows]
        worst = max(records, key=_largest_angle)
        hits = metrics.share(np.concatenate(list(map(within_tolerance, records))))
        angle = f"{words_in(_largest_angle(worst), '°')} ({worst.title}, {label(worst.solver)})"
        yield f"{mode}: {angle}; {words(hits.hits)} of {words(hits.total)} frames"
    counts = [row.shared_iterations for row in rows]
    yield f"all frames are changed together {words(min(counts))} to {words(max(counts))} times"
    warm = [drift for row in rows if (drift := row.drift(WARM, 3)) is not None]
    closed = [row.drift(COHERENT, i) or 0.0 for row in rows if row.drifts for i in (1, 2, 3)]
    if warm and closed:
        yield (
            f"after three repetitions warm starts leave the arm {words_in(min(warm), '°')} to "
            f"{words_in(max(warm), '°')} from its first pose; the drift of the closed coherent "
            f"motion is never more than {words_in(max(closed), '°')}"
        )


def jitter_chart(results: Results) -> Sketch | None:
    """Show the largest rotation of a joint on each curve, from rest and from the last solution."""
    curves = by_problem(results.all("arm", task=arm.CURVE, warm=False))
    if not curves:
        return None
    spans = []
    for row, records in enumerate(curves.values()):
        for record in records:
            warm = results.one("arm", record.problem, record.solver, warm=True)
            motions = [motion for motion in (record, warm) if motion is not None]
            angles = [in_unit(motion.values.largest_angle.max(), "°") for motion in motions]
            spans.append(series(record.solver, angles, [row] * len(angles), form=SPAN))
    return chart_sketch(
        Chart(
            "jitter",
            "Largest rotation of a joint between neighbouring frames",
            "Hollow: every frame solved from the rest pose; filled: every frame started from the "
            "last solution.",
            (Panel("", tuple(spans)),),
            Axis("largest rotation of a joint between frames [°], log scale", log=True),
            columns=1,
            rows=tuple(str(records[0].details.curve) for records in curves.values()),
            entrants=results.entrants,
            hollow="from rest",
            filled="from the last solution",
        )
    )


def _columns(
    title: str, read: Callable[[Record], Any], unit: str = "", modes: Sequence[str] = MODES
) -> list[Column]:
    """Return a column for each mode."""

    def read_in(mode: str) -> Callable[[CurveMotions], Any]:
        return lambda row: read(row.by_mode[mode])

    return [Column(f"{title}, {mode}", unit, read=read_in(mode), group=title) for mode in modes]


def _drift(mode: str, repetition: int) -> Column:
    title = f"drift, {mode}"
    read = partial(CurveMotions.drift, mode=mode, repetition=repetition)
    return Column(f"{title}, after {repetition}", "°", read=read, best="least", group=title)


def _mean_iterations(record: Record) -> float:
    return metrics.mean(record.values.iterations)


def _measured(rows: Sequence[CurveMotions]) -> dict[str, str]:
    records = [record for row in rows for record in row.by_mode.values()]
    return {name: settings(records, name) for name in ("tolerance", "max_iterations")}


jitter = Layout(
    **Captions(__file__).of("q3_jitter", _measured),
    subjects=_motions,
    columns=(
        text("curve", lambda row: row.by_mode[WARM].title),
        text("solver", lambda row: label(row.by_mode[WARM].solver)),
        *least(_columns("largest rotation", _largest_angle, "°")),
        *least(_columns("closing rotation", _closing_angle, "°", (WARM, COHERENT))),
        *_columns("mean iterations", _mean_iterations, modes=(WARM, COHERENT)),
        *folded(
            [
                *_columns("mean iterations", _mean_iterations, modes=(COLD,)),
                Column("iterations over all frames at once", read=lambda m: m.shared_iterations),
                *greatest(
                    _columns("within tolerance", lambda r: metrics.share(within_tolerance(r)))
                ),
                *_columns("largest path error", lambda r: spread_of(r, "residual")[2], "m"),
                *_columns("mean rotation", lambda r: metrics.mean(r.values.mean_angle[:-1]), "°"),
                *(_drift(mode, i) for mode in (WARM, COHERENT) for i in (1, 2, 3)),
                Column("frames", read=lambda row: row.by_mode[WARM].values.residual.size),
            ]
        ),
    ),
    summary=_summary,
    figures=(jitter_chart,),
)

LAYOUTS = (jitter,)
