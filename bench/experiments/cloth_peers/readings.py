"""The settings of solvers on falling cloths as points: their errors and times.

A point joins all sweeps: the errors of the first, and the median time.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...harness.record import Record
from ...peers import catalogue
from ...tables.results import Results, grouped
from ...tables.table import words


class Point(NamedTuple):
    """A solver with a setting on a cloth."""

    stiffness: float  # of the springs [N/m]
    particles: int  # along each side
    solver: str
    rung: str  # the setting
    values: dict[str, float]  # the measured numbers, by name
    record: Record  # of the first sweep
    spread: float = 0.0  # largest difference between the errors of two sweeps
    drift: float = 1.0  # the longest of the sweeps' times over the shortest
    sweeps: int = 1

    @property
    def own(self) -> str:
        """The name of a user's cloth, "" of ours."""
        return str(self.record.details.cloth)

    @property
    def cloth(self) -> str:
        """The name of its cloth in tables."""
        return self.own or f"{self.particles} × {self.particles}, {words(int(self.stiffness))} N/m"

    @property
    def engine(self) -> str:
        """The engine of its solver."""
        return catalogue.find(self.solver).engine

    @property
    def seconds(self) -> float:
        """The time for a frame [s]."""
        return self.values["seconds"]

    @property
    def error(self) -> float:
        """The error of a step or a motion; infinite if not reached."""
        return self.values["error"]

    @property
    def is_whole(self) -> bool:
        """Whether the setting reached the end."""
        return bool(np.isfinite(self.error))

    @property
    def remark(self) -> str:
        """The remark on this setting, else ""."""
        remarks = dict(zip(self.record.details.rungs, self.record.details.remarks, strict=False))
        return remarks.get(self.rung, "")


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    records = [record for record in results.all("cloth", task=task) if record.values is not None]
    sweeps = grouped(records, lambda record: (record.problem, record.solver))
    every = [point for group in sweeps.values() for point in _points_of(group)]
    return sorted(every, key=lambda point: (point.own, point.stiffness, point.particles))


def _points_of(sweeps: Sequence[Record]) -> Iterator[Point]:
    """Yield the points of a solver on a cloth, by all sweeps."""
    sweeps = sorted(sweeps, key=lambda record: record.details.sweep)
    by_sweep = [dict(_rungs(record)) for record in sweeps]
    record, details = sweeps[0], sweeps[0].details
    for (particles, rung), values in by_sweep[0].items():
        same = [rungs[particles, rung] for rungs in by_sweep if (particles, rung) in rungs]
        seconds = np.array([other["seconds"] for other in same])
        errors = np.array([other["error"] for other in same])
        spread = float(np.ptp(errors)) if np.isfinite(errors).all() else 0.0
        drift = float(seconds.max() / seconds.min()) if seconds.min() > 0.0 else 1.0
        values["seconds"] = float(np.median(seconds))
        point = (details.stiffness, particles, record.solver, rung, values, record)
        yield Point(*point, spread, drift, len(same))


def _rungs(record: Record) -> Iterator[tuple[tuple[int, str], dict[str, float]]]:
    """Yield particles and setting of each rung with its numbers."""
    count = len(record.details.rungs)
    columns = {name: array for name, array in record.arrays.items() if array.size == count}
    for i, rung in enumerate(record.details.rungs):
        values = {name: float(array[i]) for name, array in columns.items()}
        yield (int(values["particles"]), rung), values
