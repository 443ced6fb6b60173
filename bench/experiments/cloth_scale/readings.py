"""What the records of growing cloths say: times of iterations and of their parts, memory."""

from collections.abc import Sequence
from typing import NamedTuple

from ...harness import metrics
from ...harness.record import Record
from ...harness.results import Results
from ...peers import registry

OURS = registry.SUPERNODAL.name
LABELS = {library.name: library.label for library in registry.FACTORS}


class Scaled(NamedTuple):
    """A cloth factored by one library, and stepped if by ours; medians of rounds."""

    record: Record

    @property
    def library(self) -> str:
        """By which library, and why not where it is missing."""
        name = LABELS.get(self.record.solver, self.record.solver)
        missing = self.record.details.missing
        return f"{name}: {missing}" if missing else name

    @property
    def particles(self) -> int:
        """How many there are."""
        return int(self.record.details.particles)

    @property
    def iterations(self) -> int:
        """How many make a step."""
        return int(self.record.details.iterations)

    def value(self, name: str) -> float | None:
        """Return a time [s] or another number, None where it was not measured."""
        if name == "iteration":
            step = self.value("step")
            return None if step is None else step / self.iterations
        value = getattr(self.record.values, name, None)
        return None if value is None else metrics.spread(value).median

    def over(self, name: str, other: str | int) -> float | None:
        """Return a value over another one, or over a number."""
        value, divisor = self.value(name), self.value(other) if isinstance(other, str) else other
        return None if value is None or divisor is None else metrics.ratio(value, divisor)


def cloths(results: Results) -> list[Scaled]:
    """Return all cloths, as they were measured."""
    return [Scaled(record) for record in results.all("cloth_scale")]


def ratios(rows: Sequence[Scaled]) -> dict[int, list[float]]:
    """Return first factor, solve and memory of ours over those of CHOLMOD, by particles."""
    sizes: dict[int, dict[str, Scaled]] = {}
    for row in rows:
        if row.record.values:
            sizes.setdefault(row.particles, {})[row.record.solver] = row
    return {
        particles: [_ratio(pair, name) for name in ("factor", "solve", "memory")]
        for particles, pair in sizes.items()
        if LABELS.keys() <= pair.keys()
    }


def _ratio(pair: dict[str, Scaled], name: str) -> float:
    ours, theirs = (pair[library].value(name) for library in LABELS)
    return metrics.ratio(ours or 0.0, theirs or 0.0)
