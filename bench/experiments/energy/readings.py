"""What the records of long swings say: the energy that is left."""

from ...harness import metrics
from ...harness.record import Record


def left_after(record: Record, steps: int) -> float | None:
    """Return the energy after so many steps, as a share of the start's; None if not that many."""
    left, i = record.values.left, steps // record.details.every
    return float(left[i]) if i < left.size else None


def least(record: Record) -> float:
    """Return the least energy, as a share of the start's."""
    return metrics.extent(record.values.left)[0]


def greatest(record: Record) -> float:
    """Return the greatest energy, as a share of the start's."""
    return metrics.extent(record.values.left)[1]
