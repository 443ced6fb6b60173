"""The effect of resampling on the custom curve."""

from collections.abc import Sequence

import numpy as np

from ...harness.record import Record
from ...tables.columns import words_in
from ...tables.layout import Row
from ...tables.results import label, listed, solvers
from ...tables.table import Summary, words
from . import ARM
from .figures import CAPTIONS, arm_draws
from .values import ArmDrawing


def _row(record: Record) -> Row:
    drawing: ArmDrawing = record.values
    return {
        "record": record,
        "curve": "resampled" if record.values.evened else "as drawn",
        "points": len(drawing.curve),
        "gap, smallest": float(drawing.spacing.min()),
        "gap, median": float(np.median(drawing.spacing)),
        "gap, largest": float(drawing.spacing.max()),
        "rotation of a joint, mean": float(drawing.mean_angle.mean()),
        "rotation of a joint, largest": float(drawing.largest_angle.max()),
        "largest number of iterations": drawing.iterations.max(),
        "largest residual": drawing.residual.max(),
    }


def _summary(rows: Sequence[Row]) -> Summary:
    points = (
        f"{row['curve']}: {words(row['points'])} points, {words(row['gap, smallest'])} to "
        f"{words(row['gap, largest'])} m apart; a joint rotates by up to "
        f"{words_in(row['rotation of a joint, largest'], '°')} between frames"
        for row in rows
    )
    angles = [words_in(row["rotation of a joint, largest"], "°") for row in rows]
    angle = " when the curve is as drawn, and by up to ".join(angles[:2])
    resampled = " when it is resampled" * (len(rows) > 1)
    sentence = f"Between frames a joint rotates by up to {angle}{resampled}."
    return Summary(sentence, tuple(points))


def _solvers(rows: Sequence[Row]) -> dict[str, str]:
    return {"solvers": listed([label(name) for name in solvers(row["record"] for row in rows)])}


resampling = CAPTIONS.layout(
    "resampling",
    lambda results: map(_row, results.all("pictures", task=ARM)),
    _summary,
    measured=_solvers,
    figures=(arm_draws,),
)

LAYOUTS = (resampling,)
