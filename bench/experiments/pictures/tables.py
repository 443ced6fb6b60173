"""What resampling makes of the custom curve."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import label, listed, settings, solvers
from ...tables.columns import LARGEST, MEDIAN, spread, spread_of, text, words_in
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from . import ARM, figures


def _curve(record: Record) -> str:
    return "resampled" if record.settings["evened"] else "as drawn"


def _least_gap(record: Record) -> float:
    return metrics.extent(record.arrays["spacing"])[0]


def _mean_angle(record: Record) -> float:
    return metrics.mean(record.arrays["mean_angle"])


def _summary(records: Sequence[Record]) -> Summary:
    points = [
        f"{_curve(record)}: {words(len(record.arrays['curve']))} points, "
        f"{words(_least_gap(record))} to {words(spread_of(record, 'spacing')[2])} m apart; a joint "
        f"rotates by up to {words_in(spread_of(record, 'largest_angle')[2], '°')} between frames"
        for record in records
    ]
    return Summary("How evenly the points lie, and how smoothly the arm follows:", tuple(points))


resampling = Layout(
    "What does resampling the custom curve change?",
    "resampling",
    "The custom curve before and after resampling",
    subjects=lambda results: results.all("pictures", task=ARM),
    columns=(
        text("curve", _curve),
        Column("points", read=lambda record: len(record.arrays["curve"])),
        Column("gap, least", "m", read=_least_gap),
        *spread("gap", "spacing", "m", (MEDIAN, LARGEST)),
        Column("rotation of a joint, mean", "°", read=_mean_angle),
        *spread("rotation of a joint", "largest_angle", "°", [LARGEST]),
        *spread("iterations", "iterations", of=[LARGEST]),
        *spread("residual", "residual", "m", [LARGEST]),
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
