"""What the records of growing cloths say: times of iterations and of their parts, memory."""

from collections.abc import Sequence

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry

OURS = registry.SUPERNODAL.name
LABELS = {library.name: library.label for library in registry.FACTORS}


def library(record: Record) -> str:
    """Return by which library a cloth was factored, and why not where it is missing."""
    missing = record.details.missing
    return LABELS.get(record.solver, record.solver) + (f": {missing}" if missing else "")


def value(record: Record, name: str) -> float | None:
    """Return a number, the median of several; None where it was not measured."""
    if name == "particles":
        return float(record.details.particles)
    if name == "iteration":
        step = value(record, "step")
        return None if step is None else step / record.details.iterations
    numbers = getattr(record.values, name, None)
    return None if numbers is None else metrics.spread(numbers).median


def ratio(record: Record, name: str, other: str) -> float | None:
    """Return a number over another one, None where either was not measured."""
    dividend, divisor = value(record, name), value(record, other)
    return None if dividend is None or divisor is None else metrics.ratio(dividend, divisor)


def beside_cholmod(records: Sequence[Record]) -> dict[int, list[float]]:
    """Return first factor, solve and memory of ours over those of CHOLMOD, by particles."""
    sizes: dict[int, dict[str, Record]] = {}
    for record in records:
        if record.values:
            sizes.setdefault(record.details.particles, {})[record.solver] = record
    pairs = {n: [by[name] for name in LABELS] for n, by in sizes.items() if by.keys() >= {*LABELS}}
    return {
        particles: [
            metrics.ratio(value(ours, name) or 0.0, value(cholmod, name) or 0.0)
            for name in ("factor", "solve", "memory")
        ]
        for particles, (ours, cholmod) in pairs.items()
    }
