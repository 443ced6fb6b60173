"""Robots and characters: how closely engines that read the same files agree with the reference."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

from ...harness.record import Record
from ...peers import registry
from ...tables.captions import Captions
from ...tables.columns import folded, text
from ...tables.layout import Layout
from ...tables.results import Results, by_problem, counted, grouped, listed, settings
from ...tables.table import Cell, Column, Summary, words
from . import PEERS
from .values import FileDetails

QUANTITIES = ("positions", "rotations", "jacobians")


class ModelComparison(NamedTuple):
    """A file in both engines, or a robot of the bench in the engine of a peer.

    The numbers are those of the valid records; the remark is on all others.
    """

    engines: str
    records: Sequence[Record]
    valid: Sequence[Record]
    remark: str

    @property
    def is_file(self) -> bool:
        """Whether it is a file of others, and no robot of the bench."""
        return self.records[0].facts.get("task") != PEERS

    def size(self, name: str) -> Cell:
        """Return a size by the engine that counts fewest: one that leaves mimics free has more."""
        if not (self.is_file and self.valid):
            return None
        fewest = min(self.valid, key=lambda record: (record.values.freedoms, record.solver))
        size: int = getattr(fewest.values, name)
        return size


def _comparisons(results: Results) -> list[ModelComparison]:
    """Return files in both engines, and then robots of the bench in those of peers."""
    records = results.all("robot_models")
    files = by_problem(r for r in records if r.facts.get("task") != PEERS).values()
    return [*map(_of_file, files), *map(_of_robot, results.all("robot_models", task=PEERS))]


def _of_file(records: Sequence[Record]) -> ModelComparison:
    valid = [record for record in records if record.values and not record.details.cause]
    engines = listed([record.solver for record in valid]) or "none"
    return ModelComparison(engines, records, valid, "; ".join(filter(None, map(_remark, records))))


def _remark(record: Record) -> str:
    details: FileDetails = record.details
    if not record.values:
        return details.unread
    if details.cause:
        difference = max(getattr(record.values, quantity) for quantity in QUANTITIES)
        return f"{record.solver} differs by {words(difference)}: {details.cause}"
    mimics = f"{record.solver} with mimic joints left free: {details.free_mimics}"
    return mimics if details.free_mimics else ""


def _of_robot(record: Record) -> ModelComparison:
    remark = record.details.remark or registry.SINGLE_PRECISION.get(record.solver, "")
    engine = f"{record.solver} {record.details.version}"
    return ModelComparison(engine, [record], [record], remark)


def _largest(quantity: str, records: Sequence[Record]) -> float | None:
    """Return the largest difference in records, None if they have none."""
    values = (getattr(record.values, quantity, None) for record in records)
    return max((value for value in values if value is not None), default=None)


def _measured(rows: Sequence[ModelComparison]) -> dict[str, str]:
    files, robots = (
        settings((r for row in rows if row.is_file == of for r in row.records), "configurations")
        for of in (True, False)
    )
    return {"files": files or "No", "robots": robots or "none"}


def _summary(rows: Sequence[ModelComparison]) -> Summary:
    files = [row for row in rows if row.is_file]
    valid = [record for file in files for record in file.valid]
    positions, rotations, jacobians = (words(_largest(q, valid)) for q in QUANTITIES)
    sentence = (
        f"Over {counted(sum(bool(f.valid) for f in files), 'file')} positions differ by at most "
        f"{positions} of the extent, rotations by {rotations}, Jacobians by {jacobians}:"
    )
    return Summary(sentence * bool(valid), tuple(_points(rows)))


def _points(rows: Sequence[ModelComparison]) -> Iterator[str]:
    """Yield how many files each engine reads, and how closely engines of peers place robots."""
    files = [record for row in rows if row.is_file for record in row.records]
    for engine, records in grouped(files, lambda record: record.solver).items():
        read = [record for record in records if record.values]
        different = sum(bool(record.details.cause) for record in read)
        deviation = f", {words(different)} of them otherwise than MuJoCo's documentation says"
        count = f"{words(len(read))} of {counted(len(records), 'file')} read"
        yield f"{engine}: {count}{deviation * bool(different)}"
    robots = (r for row in rows if not row.is_file for r in row.records if r.values)
    for engine, records in grouped(robots, lambda record: record.solver).items():
        positions, rotations = (words(_largest(quantity, records)) for quantity in QUANTITIES[:2])
        yield (
            f"{engine} on the bench’s robots: effectors within {positions} m and {rotations} in a "
            "rotation matrix"
        )


def _difference(quantity: str, row: ModelComparison, of_files: bool | None = None) -> Cell:
    return _largest(quantity, row.valid) if of_files in (None, row.is_file) else None


def _column(title: str, unit: str, quantity: str, of_files: bool | None = None) -> Column:
    read = partial(_difference, quantity, of_files=of_files)
    return Column(title, unit, group="largest difference", read=read)


readers = Layout(
    **Captions(__file__).of("readers", _measured),
    subjects=_comparisons,
    columns=(
        text("robot", lambda row: row.records[0].title),
        text("engines", lambda row: row.engines),
        Column("freedoms", read=lambda row: row.size("freedoms")),
        _column("positions, of the extent", "", "positions", of_files=True),
        _column("positions", "m", "positions", of_files=False),
        _column("rotations", "", "rotations"),
        _column("Jacobians", "", "jacobians"),
        text("remark", lambda row: row.remark),
        *folded(
            [
                Column("links", read=lambda row: row.size("links")),
                Column("moving joints", read=lambda row: row.size("joints")),
            ]
        ),
    ),
    summary=_summary,
)

LAYOUTS = (readers,)
