"""What the records of one cloth say, a point for each solver with one setting."""

from collections.abc import Iterator
from typing import NamedTuple

from ...harness.record import Record
from ...harness.results import Results
from ...tables.table import words


class Point(NamedTuple):
    """A solver with one setting on one cloth.

    Attributes:
        stiffness: of the springs [N/m].
        particles: along each side.
        solver: the method.
        rung: the setting.
        values: what was measured, by name.
        record: where it is from.
    """

    stiffness: float
    particles: int
    solver: str
    rung: str
    values: dict[str, float]
    record: Record

    @property
    def own(self) -> str:
        """The name of a user's cloth, "" of ours."""
        return str(self.record.facts.get("cloth", ""))

    @property
    def cloth(self) -> str:
        """How its cloth is written."""
        return self.own or f"{self.particles} × {self.particles}, {words(int(self.stiffness))} N/m"

    @property
    def is_whole(self) -> bool:
        """Whether a motion got to its end."""
        return not self.values["diverged"] and self.values["frames"] == self.values["wanted"]


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    found = [p for record in results.all("cloth", task=task) for p in _points_of(record)]
    return sorted(found, key=lambda point: (point.own, point.stiffness, point.particles))


def _points_of(record: Record) -> Iterator[Point]:
    if "particles" not in record.arrays:
        return
    count = record.arrays["particles"].size
    whole = {name: values for name, values in record.arrays.items() if values.size == count}
    for i, rung in enumerate(record.facts["rungs"]):
        values = {name: float(array[i]) for name, array in whole.items()}
        stiffness, particles = record.settings["stiffness"], int(values["particles"])
        yield Point(stiffness, particles, record.solver, rung, values, record)
