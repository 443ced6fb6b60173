"""What the records of long swings say: the energy that is left, as a share of the start's."""

from ...harness import metrics
from ...harness.record import Record


def left_after(record: Record, steps: int) -> float | None:
    """Return the energy after so many steps, None if there are not that many."""
    left, i = record.values.left, steps // record.details.every
    return float(left[i]) if i < left.size else None


def extent(record: Record) -> tuple[float, float]:
    """Return the least and the greatest energy."""
    return metrics.extent(record.values.left)
