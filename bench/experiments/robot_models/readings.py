"""How far engines place the links of robots and characters from where the reference does."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ...harness.record import Record
from ...harness.results import Results, by_problem, listed
from ...peers import registry
from ...tables.table import words
from . import PEERS
from .values import FileDetails

QUANTITIES = ("positions", "rotations", "jacobians")


class Comparison(NamedTuple):
    """A file beside both engines, or a robot of the bench beside the engine of a peer.

    Attributes:
        title: of the file or robot.
        engines: those whose numbers these are.
        links, joints, freedoms: sizes by the engine that counts fewest, which leaves no mimic free.
        relative_positions: the largest difference of positions, of the extent of the links.
        positions: the same [m], of the effectors of a robot of the bench.
        rotations: the largest difference of entries of rotation matrices.
        jacobians: the largest difference of entries of Jacobians.
        remark: what is to be known of engines that do not read the file, or otherwise.
        records: what was measured.
    """

    title: str
    engines: str
    links: int | None
    joints: int | None
    freedoms: int | None
    relative_positions: float | None
    positions: float | None
    rotations: float | None
    jacobians: float | None
    remark: str
    records: Sequence[Record]


def comparisons(results: Results) -> list[Comparison]:
    """Return files beside both engines, and then robots of the bench beside those of peers."""
    files = by_problem(files_of(results.all("robot_models"))).values()
    return [*map(_file, files), *map(_robot, results.all("robot_models", task=PEERS))]


def files_of(records: Iterable[Record]) -> list[Record]:
    """Return the records on files of others."""
    return [record for record in records if record.facts.get("task") != PEERS]


def agreeing(records: Iterable[Record]) -> list[Record]:
    """Return the records on files with numbers that no fault of the engine has a part in."""
    return [r for r in files_of(records) if r.values and not r.details.cause]


def largest(records: Sequence[Record], quantity: str) -> float | None:
    """Return the largest difference in records, None if they have none."""
    values = (getattr(record.values, quantity) for record in records if record.values)
    return max(values, default=None)


def _file(records: Sequence[Record]) -> Comparison:
    valid = agreeing(records)
    fewest = min(valid, key=lambda record: (record.values.freedoms, record.solver), default=None)
    positions, rotations, jacobians = (largest(valid, quantity) for quantity in QUANTITIES)
    return Comparison(
        records[0].title,
        listed([record.solver for record in valid]) or "none",
        _size(fewest, "links"),
        _size(fewest, "joints"),
        _size(fewest, "freedoms"),
        positions,
        None,
        rotations,
        jacobians,
        "; ".join(filter(None, map(_remark, records))),
        records,
    )


def _size(record: Record | None, name: str) -> int | None:
    return getattr(record.values, name) if record else None


def _remark(record: Record) -> str:
    """Return what is to be said of an engine and a file, "" if nothing."""
    details: FileDetails = record.details
    if not record.values:
        return details.unread
    if details.cause:
        difference = max(getattr(record.values, quantity) for quantity in QUANTITIES)
        return f"{record.solver} is off by {words(difference)}: {details.cause}"
    mimics = f"{record.solver} with mimic joints left free: {details.free_mimics}"
    return mimics if details.free_mimics else ""


def _robot(record: Record) -> Comparison:
    positions, rotations = (largest([record], name) for name in ("positions", "rotations"))
    engine = f"{record.solver} {record.details.version}"
    remark = record.details.remark or registry.SINGLE_PRECISION.get(record.solver, "")
    unknown = (None, None, None, None)
    return Comparison(record.title, engine, *unknown, positions, rotations, None, remark, [record])
