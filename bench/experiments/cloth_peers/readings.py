"""The settings of solvers on falling cloths as points: their errors and times."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...harness.record import Record
from ...peers import registry
from ...tables.results import Results
from ...tables.table import words


class Point(NamedTuple):
    """A solver with a setting on a cloth."""

    stiffness: float  # of the springs [N/m]
    particles: int  # along each side
    solver: str
    rung: str  # the setting
    values: dict[str, float]  # the measured numbers, by name
    record: Record

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
        return registry.find(self.solver).engine

    @property
    def seconds(self) -> float:
        """The time for a frame [s]."""
        return self.values["seconds"]

    @property
    def is_whole(self) -> bool:
        """Whether a motion reached its end."""
        return not self.values["diverged"] and self.values["frames"] == self.values["wanted"]

    @property
    def remark(self) -> str:
        """The remarks of its record on its cloth."""
        counts, sentences = self.record.values.remark_particles, self.record.details.remarks
        remarks = zip(counts, sentences, strict=True)
        return "; ".join(sentence for count, sentence in remarks if count == self.particles)

    def number(self, name: str) -> float | None:
        """Return a measured number, None where it is NaN."""
        number = self.values[name]
        return None if np.isnan(number) else number


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    every = [p for record in results.all("cloth", task=task) for p in _points_of(record)]
    return sorted(every, key=lambda point: (point.own, point.stiffness, point.particles))


def _points_of(record: Record) -> Iterator[Point]:
    if record.values is None:
        return
    count = record.values.particles.size
    columns = {name: array for name, array in record.arrays.items() if array.size == count}
    for i, rung in enumerate(record.details.rungs):
        values = {name: float(array[i]) for name, array in columns.items()}
        stiffness, particles = record.details.stiffness, int(values["particles"])
        yield Point(stiffness, particles, record.solver, rung, values, record)
