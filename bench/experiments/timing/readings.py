"""What the records of the timing say: times, their precision, and who is first."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...tables.results import PRECISION, Results
from .case import COMPILED, LIMIT


class Timed(NamedTuple):
    """A time, beside those of the same work by our compiled source and by a plain copy."""

    record: Record
    ours: Record | None
    copy: Record | None

    @property
    def timing(self) -> metrics.Timing:
        """Where the rounds lie [s]."""
        return metrics.timing(self.record.values.seconds)

    @property
    def precision(self) -> float | None:
        """Half the width of the median's interval over the median, None if nothing is known."""
        median, low, high = self.timing.interval
        return None if math.isnan(low) else (high - low) / (2.0 * median)

    @property
    def mark(self) -> str:
        """Whether the machine was too noisy while it was timed."""
        return "noisy" if self.record.details.noise > PRECISION else ""

    @property
    def of_ours(self) -> float | None:
        """The time over that of our compiled source, None for itself and where there is none."""
        return None if self.record is self.ours else _ratio(self.record, self.ours)

    @property
    def of_copy(self) -> float | None:
        """The time over that of a plain copy, None where there is none."""
        return _ratio(self.record, self.copy)

    @property
    def bandwidth(self) -> float | None:
        """The bandwidth of the copy [GB/s], None where there is none."""
        if self.copy is None:
            return None
        moved = float(self.copy.values.moved)
        return metrics.gigabytes_per_second(moved, median_time(self.copy))


def timed(subject: str, results: Results) -> list[Timed]:
    """Return the times of a subject, but for plain copies."""
    records = results.all("timing", subject=subject)
    ours, copies = (
        {record.problem: record for record in records if record.solver == solver}
        for solver in (COMPILED, LIMIT)
    )
    return [
        Timed(record, ours.get(record.problem), copies.get(record.problem))
        for record in records
        if record.solver != LIMIT
    ]


def median_time(record: Record) -> float:
    """Return the median of all rounds [s]."""
    return metrics.timing(record.values.seconds).median


def _ratio(record: Record, other: Record | None) -> float | None:
    return None if other is None else metrics.ratio(median_time(record), median_time(other))


def noise(works: Sequence[Timed]) -> float:
    """Return by how much a fixed loop varied where it varied most, NaN if that is not known."""
    return max((timed.record.details.noise for timed in works), default=math.nan)


def written(solver: str) -> str:
    """Return how a solver is written in sentences."""
    return "Plumbob" if solver == COMPILED else solver


def ranked_by_time(records: Sequence[Record]) -> metrics.Ranking | None:
    """Return who takes the least time by the medians of shared sweeps, None if they share none."""
    sweeps = {written(record.solver): _of_sweeps(record) for record in records}
    apart = len({record.details.together for record in records}) > 1
    if apart or len(sweeps) < 2 or len({len(medians) for medians in sweeps.values()}) > 1:
        return None
    return metrics.ranking(sweeps)


def _of_sweeps(record: Record) -> metrics.Floats:
    """Return how good each sweep was, the logarithm of one over its median, (sweep,)."""
    seconds = record.values.seconds
    return -np.log(np.median(seconds, axis=-1) if seconds.ndim == 2 else seconds)
