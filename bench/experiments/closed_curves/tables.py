"""How far joints rotate from frame to frame along closed curves: the lab's third question."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...figures.chart import SPAN, Panel, series
from ...figures.chart_sketch import declared_chart
from ...figures.sketch import Sketch
from ...harness import metrics
from ...harness.record import Record
from ...tables.captions import Captions
from ...tables.columns import spread_of, words_in
from ...tables.layout import Row
from ...tables.results import Results, by_problem, grouped, label
from ...tables.table import Summary, in_unit, words
from .. import arm
from ..arm.values import FollowedMotion
from ..chain.tables import within_tolerance
from . import COLD, CURVE, DRIFT, NEAREST, WARM

MODES = (COLD, WARM, NEAREST)
# Rotations within this share of each other are equally large.
ALIKE = 0.01
_CAPTIONS = Captions(__file__)


def _rows(results: Results) -> list[Row]:
    """Return a row for each curve followed by a solver in all modes."""
    followed, drifts = (_by_mode(results, task) for task in (CURVE, DRIFT))
    return [
        _row(by_mode, drifts.get((problem.replace("arm/", "drift/"), solver), {}))
        for (problem, solver), by_mode in followed.items()
        if by_mode.keys() >= set(MODES)
    ]


def _by_mode(results: Results, task: str) -> dict[tuple[str, str], dict[str, Record]]:
    groups = grouped(results.all("tracking", task=task), lambda r: (r.problem, r.solver))
    return {key: {r.values.mode: r for r in records} for key, records in groups.items()}


def _row(by_mode: Mapping[str, Record], drifts: Mapping[str, Record]) -> Row:
    """Return the cells of a curve."""
    row: Row = {
        "by_mode": by_mode,
        "drifts": drifts,
        "curve": by_mode[WARM].title,
        "solver": label(by_mode[WARM].solver),
        "frames": by_mode[WARM].values.residual.size,
    }
    for mode, record in by_mode.items():
        motion: FollowedMotion = record.values
        row |= {
            f"largest rotation, {mode}": metrics.spread(motion.largest_angle[:-1]).largest,
            f"closing rotation, {mode}": float(motion.largest_angle[-1]),
            f"mean rotation, {mode}": metrics.mean(motion.mean_angle[:-1]),
            f"mean iterations, {mode}": metrics.mean(record.values.iterations),
            f"within tolerance, {mode}": metrics.share(within_tolerance(record)),
            f"largest path error, {mode}": spread_of(record, "residual")[2],
        }
    for mode, record in drifts.items():
        for i, angle in enumerate(record.values.drift, start=1):
            row[f"drift, {mode}, after {i}"] = float(angle)
    return row


def _summary(rows: Sequence[Row]) -> Summary:
    warm, nearest = (_count_smaller(rows, *modes) for modes in ((WARM, COLD), (NEAREST, WARM)))
    return Summary(
        "Starting each frame from the previous solution makes the largest rotation of a joint "
        f"smaller in {warm} of {len(rows)} cases; the nearest of several solutions makes the "
        f"rotation smaller still in {nearest}.",
        tuple(_points(rows)),
    )


def _count_smaller(rows: Sequence[Row], mode: str, other_mode: str) -> int:
    """Return the number of rows whose largest rotation is smaller in a mode than in another."""
    largest, other = (f"largest rotation, {name}" for name in (mode, other_mode))
    return sum((1.0 + ALIKE) * row[largest] < row[other] for row in rows)


def _points(rows: Sequence[Row]) -> Iterator[str]:
    for mode in MODES:
        worst = max(rows, key=lambda row: float(row[f"largest rotation, {mode}"]))
        angle = words_in(worst[f"largest rotation, {mode}"], "°")
        hits, total = np.sum([row[f"within tolerance, {mode}"][:2] for row in rows], axis=0)
        frames = f"{words(int(hits))} of {words(int(total))} frames"
        yield f"{mode}: {angle} ({worst['curve']}, {worst['solver']}); {frames}"


def jitter_chart(results: Results) -> Sketch | None:
    """Show the largest rotation of a joint on each curve, from rest and from the last solution."""
    curves = by_problem(results.all("arm", task=arm.CURVE, warm=False))
    spans = []
    for row, records in enumerate(curves.values()):
        for record in records:
            warm = results.find("arm", record.problem, record.solver, warm=True)
            motions = [motion for motion in (record, warm) if motion is not None]
            angles = [in_unit(motion.values.largest_angle.max(), "°") for motion in motions]
            spans.append(series(record.solver, angles, [row] * len(angles), form=SPAN))
    rows = tuple(str(records[0].values.curve) for records in curves.values())
    panels = [Panel("", tuple(spans))] if spans else []
    return declared_chart(_CAPTIONS.figure("jitter"), panels, results.entrants, rows=rows)


jitter = _CAPTIONS.layout("q3_jitter", _rows, _summary, figures=(jitter_chart,))

LAYOUTS = (jitter,)
