"""What the records of falling cloths say: errors, times, limits of stability."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...harness import metrics
from ...harness.record import Record
from ...peers import registry
from ...tables.results import Results
from ...tables.table import words
from ..published import problem as published
from . import LIU, MOTION, ONE_STEP, STABILITY
from .values import Stability

# A motion as near as this to the true one [m] is hard to tell from it by eye.
NEAR = 1e-2

T = TypeVar("T")


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
        return str(self.record.details.cloth)

    @property
    def cloth(self) -> str:
        """How its cloth is written."""
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
        """Whether a motion got to its end."""
        return not self.values["diverged"] and self.values["frames"] == self.values["wanted"]

    @property
    def remark(self) -> str:
        """What its record says of its cloth."""
        counts, sentences = self.record.values.remark_particles, self.record.details.remarks
        remarks = zip(counts, sentences, strict=True)
        return "; ".join(sentence for count, sentence in remarks if count == self.particles)

    def number(self, name: str) -> float | None:
        """Return a value, None where it is not a number."""
        value = self.values[name]
        return None if np.isnan(value) else value


def points(results: Results, task: str) -> list[Point]:
    """Return all points of a task, cloth by cloth: stiffness first, then particles."""
    cloths = [p for record in results.all("cloth", task=task) for p in _points_of(record)]
    return sorted(cloths, key=lambda point: (point.own, point.stiffness, point.particles))


def _points_of(record: Record) -> Iterator[Point]:
    if record.values is None:
        return
    count = record.values.particles.size
    whole = {name: values for name, values in record.arrays.items() if values.size == count}
    for i, rung in enumerate(record.details.rungs):
        values = {name: float(array[i]) for name, array in whole.items()}
        stiffness, particles = record.details.stiffness, int(values["particles"])
        yield Point(stiffness, particles, record.solver, rung, values, record)


def grouped(members: Sequence[T], key: Callable[[T], Any]) -> dict[Any, list[T]]:
    """Return the members of each group, in order."""
    groups: dict[Any, list[T]] = {}
    for member in members:
        groups.setdefault(key(member), []).append(member)
    return groups


class Steps(NamedTuple):
    """One step by one solver on one cloth, with each of its settings."""

    points: Sequence[Point]

    @property
    def first(self) -> Point:
        """The point of its first setting."""
        return self.points[0]

    @property
    def best(self) -> Point:
        """The point of the least error."""
        return min(self.points, key=lambda point: point.values["error"])

    @property
    def least_error(self) -> float | str:
        """The least error, a word where all settings diverged."""
        error = self.best.values["error"]
        return "diverged" if np.isinf(error) else error

    def cheapest(self, target: str) -> Point | None:
        """Return the point of the least time to an error of so much, None if none has it."""
        seconds, errors = (
            np.array([p.values[name] for p in self.points]) for name in ("seconds", "error")
        )
        i = metrics.cheapest_within(seconds, errors, float(target))
        return None if i is None else self.points[i]


def steps(results: Results) -> list[Steps]:
    """Return one step by each solver on each cloth."""
    groups = grouped(points(results, ONE_STEP), lambda point: (point.cloth, point.solver))
    return [Steps(group) for group in groups.values()]


def fastest(rows: Sequence[Steps], target: str) -> list[Point]:
    """Return the points that are soonest at an error: of all, then of all other engines."""
    reached = [point for row in rows if (point := row.cheapest(target)) is not None]
    reached.sort(key=lambda point: point.seconds)
    return reached[:1] + [p for p in reached if p.engine != reached[0].engine][:1]


class Limit(NamedTuple):
    """The longest stable step of a solver on a hanging cloth [s], None if there is none.

    The theory is 2 / ω, the limit of symplectic Euler [s], the share the step in units of it.
    """

    record: Record
    step: float | None
    theory: float
    share: float | None


def limits(results: Results) -> dict[tuple[str, float], Limit]:
    """Return the limits of stability by solver and stiffness [N/m]."""
    return {
        (record.solver, stiffness): limit
        for record in results.all("cloth", task=STABILITY)
        for stiffness, limit in _limits(record)
    }


def _limits(record: Record) -> Iterator[tuple[float, Limit]]:
    values: Stability = record.values
    columns = (values.stiffness.tolist(), values.limit.tolist(), (2.0 / values.frequency).tolist())
    for stiffness, step, theory in zip(*columns, strict=True):
        limit = (None, theory, None) if np.isnan(step) else (step, theory, step / theory)
        yield stiffness, Limit(record, *limit)


class Motion(NamedTuple):
    """A motion by one solver with one setting, and its limit of stability if that was measured."""

    point: Point
    limit: Limit | None

    @property
    def remark(self) -> str:
        """What came of it, and of its limit."""
        limit = self.limit.record.details.remark if self.limit else ""
        return "; ".join(filter(None, (self._fate, limit)))

    @property
    def _fate(self) -> str:
        if self.point.values["diverged"]:
            return "diverged"
        if self.point.is_whole:
            return ""
        frame = int(self.point.values["frames"]) + 1
        return self.point.remark or f"out of time before frame {frame}"

    @property
    def simulated_second(self) -> float | None:
        """The time for a simulated second [s]."""
        frame = self.point.number("seconds")
        return None if frame is None else metrics.ratio(frame, self.point.record.details.frame)


def motions(results: Results) -> list[Motion]:
    """Return the motions by every solver, cloth by cloth."""
    stable = limits(results)
    return [
        Motion(point, None if point.own else stable.get((point.solver, point.stiffness)))
        for point in points(results, MOTION)
    ]


def nearest(whole: Sequence[Point]) -> tuple[Point, Point | None]:
    """Return the motion nearest to the truth, and the fastest of those that are near."""
    close = [point for point in whole if point.values["true"] <= NEAR]
    fast = min(close, key=lambda point: point.seconds, default=None)
    return min(whole, key=lambda point: point.values["true"]), fast


def certainty(rows: Sequence[Motion]) -> tuple[float, float, float]:
    """Return by how much halving its steps moves a true motion [m], and the range of its order."""
    records = {id(row.point.record): row.point.record for row in rows}.values()
    unsure = max(float(record.values.unsure.max()) for record in records)
    return unsure, *metrics.extent(np.concatenate([record.values.order for record in records]))


def as_published(results: Results) -> list[Record]:
    """Return the records of the cloth of Liu et al. (2013)."""
    records = results.all("cloth", task=LIU)
    return [r for r in records if r.solver in published.LIU_2013]


def median_time(record: Record) -> float:
    """Return the median time for a frame [s]."""
    return metrics.spread(record.values.seconds).median
