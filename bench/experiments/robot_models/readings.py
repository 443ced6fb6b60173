"""How far engines place the links of robots and characters from where the reference does."""

from collections.abc import Sequence
from typing import NamedTuple

from ...harness.record import Record
from ...peers import registry
from ...tables.results import Results, by_problem, listed
from ...tables.table import words
from . import PEERS
from .values import FileDetails

QUANTITIES = ("positions", "rotations", "jacobians")


class Comparison(NamedTuple):
    """A file beside both engines, or a robot of the bench beside the engine of a peer.

    The numbers are those of the records that are valid; the remark is on all others.
    """

    engines: str
    records: Sequence[Record]
    valid: Sequence[Record]
    remark: str

    @property
    def is_file(self) -> bool:
        """Whether it is a file of others, and no robot of the bench."""
        return self.records[0].facts.get("task") != PEERS

    def largest(self, quantity: str) -> float | None:
        """Return the largest difference of a quantity, None if there is none."""
        return largest(self.valid, quantity)

    def size(self, name: str) -> int | None:
        """Return a size by the engine that counts fewest: one that leaves mimics free has more."""
        if not (self.is_file and self.valid):
            return None
        fewest = min(self.valid, key=lambda record: (record.values.freedoms, record.solver))
        size: int = getattr(fewest.values, name)
        return size


def comparisons(results: Results) -> list[Comparison]:
    """Return files beside both engines, and then robots of the bench beside those of peers."""
    records = results.all("robot_models")
    files = by_problem(r for r in records if r.facts.get("task") != PEERS).values()
    return [*map(_file, files), *map(_robot, results.all("robot_models", task=PEERS))]


def largest(records: Sequence[Record], quantity: str) -> float | None:
    """Return the largest difference in records, None if they have none."""
    values = (getattr(record.values, quantity, None) for record in records)
    return max((value for value in values if value is not None), default=None)


def _file(records: Sequence[Record]) -> Comparison:
    valid = [record for record in records if record.values and not record.details.cause]
    engines = listed([record.solver for record in valid]) or "none"
    return Comparison(engines, records, valid, "; ".join(filter(None, map(_remark, records))))


def _remark(record: Record) -> str:
    details: FileDetails = record.details
    if not record.values:
        return details.unread
    if details.cause:
        difference = max(getattr(record.values, quantity) for quantity in QUANTITIES)
        return f"{record.solver} is off by {words(difference)}: {details.cause}"
    mimics = f"{record.solver} with mimic joints left free: {details.free_mimics}"
    return mimics if details.free_mimics else ""


def _robot(record: Record) -> Comparison:
    remark = record.details.remark or registry.SINGLE_PRECISION.get(record.solver, "")
    return Comparison(f"{record.solver} {record.details.version}", [record], [record], remark)
