"""What resampling makes of the custom curve."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...tables.columns import text, words_in
from ...tables.layout import Layout
from ...tables.results import label, listed, settings, solvers
from ...tables.table import Column, Summary, words
from . import ARM, figures
from .values import ArmDrawing


def _curve(record: Record) -> str:
    return "resampled" if record.details.evened else "as drawn"


def _summary(records: Sequence[Record]) -> Summary:
    sentence = "How evenly the points lie, and how smoothly the arm follows:"
    return Summary(sentence, tuple(f"{_curve(r)}: {_point(r.values)}" for r in records))


def _point(drawing: ArmDrawing) -> str:
    least, largest = map(words, metrics.extent(drawing.spacing))
    return (
        f"{words(len(drawing.curve))} points, {least} to {largest} m apart; a joint rotates by up "
        f"to {words_in(float(drawing.largest_angle.max()), '°')} between frames"
    )


resampling = Layout(
    "What does resampling the custom curve change?",
    "resampling",
    "The custom curve before and after resampling",
    subjects=lambda results: results.all("pictures", task=ARM),
    columns=(
        text("curve", _curve),
        *(
            Column(title, unit, group=title.partition(", ")[0], read=read)
            for title, unit, read in (
                ("points", "", lambda r: len(r.values.curve)),
                ("gap, least", "m", lambda r: r.values.spacing.min()),
                ("gap, median", "m", lambda r: metrics.spread(r.values.spacing).median),
                ("gap, largest", "m", lambda r: r.values.spacing.max()),
                ("rotation of a joint, mean", "°", lambda r: r.values.mean_angle.mean()),
                ("rotation of a joint, largest", "°", lambda r: r.values.largest_angle.max()),
                ("iterations, largest", "", lambda r: r.values.iterations.max()),
                ("residual, largest", "m", lambda r: r.values.residual.max()),
            )
        ),
    ),
    shows="The gap is the distance between neighbouring points; rotations are geodesic angles "
    "between neighbouring frames, a frame a point.",
    measured=lambda records: (
        f"Gaps kept from {settings(records, 'min_spacing')} to "
        f"{settings(records, 'max_spacing')} m; {listed([label(s) for s in solvers(records)])}, "
        "each frame started from the last solution."
    ),
    summary=_summary,
    figures=(figures.arm_draws,),
)


LAYOUTS = (resampling,)
