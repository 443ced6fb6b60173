"""What resampling makes of the custom curve."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...presentation.results import Results, label, listed, settings, solvers
from ...presentation.tables import Cell, Column, Summary, Table, words
from . import ARM


def resampling(results: Results) -> Table:
    """Return what resampling makes of the custom curve."""
    records = results.all("pictures", task=ARM)
    return Table(
        "resampling",
        "The custom curve before and after resampling",
        (
            Column("curve", words=True),
            Column("points"),
            Column("gap, least", "m"),
            Column("gap, median", "m"),
            Column("gap, largest", "m"),
            Column("rotation of a joint, mean", "°"),
            Column("rotation of a joint, largest", "°"),
            Column("iterations, largest"),
            Column("residual, largest", "m"),
        ),
        tuple(_resampling_row(record) for record in records),
        shows="The gap is the distance between neighbouring points; rotations are geodesic angles "
        "between neighbouring frames, a frame a point.",
        measured=f"Gaps kept from {settings(records, 'min_spacing')} to "
        f"{settings(records, 'max_spacing')} m; {listed([label(s) for s in solvers(records)])}, "
        "each frame started from the last solution.",
        summary=_resampling_summary(records),
    )


def _resampling_row(record: Record) -> tuple[Cell, ...]:
    gap = metrics.spread(record.arrays["spacing"])
    largest, mean = _rotations(record)
    return (
        "resampled" if record.settings["evened"] else "as drawn",
        len(record.arrays["curve"]), metrics.extent(record.arrays["spacing"])[0], gap.median,
        gap.largest, mean, largest, metrics.whole(record.arrays["iterations"])[2],
        metrics.spread(record.arrays["residual"]).largest,
    )  # fmt: skip


def _rotations(record: Record) -> tuple[float, float]:
    """Return the largest and the mean rotation of a joint [°]."""
    return (
        metrics.degrees(metrics.spread(record.arrays["largest_angle"]).largest),
        metrics.degrees(metrics.mean(record.arrays["mean_angle"])),
    )


def _resampling_summary(records: Sequence[Record]) -> Summary:
    points = [
        f"{row[0]}: {words(row[1])} points, {words(row[2])} to {words(row[4])} m apart; a joint "
        f"rotates by up to {words(row[6])}° between frames"
        for row in map(_resampling_row, records)
    ]
    return Summary("How evenly the points lie, and how smoothly the arm follows:", tuple(points))
