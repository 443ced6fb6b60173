"""Robots and characters: how closely engines reading the same files agree with the reference."""

from collections.abc import Iterable, Iterator, Sequence

from ...harness.record import Record
from ...peers import catalogue
from ...tables.captions import Captions
from ...tables.layout import Row
from ...tables.results import Results, by_problem, counted, grouped, listed, settings
from ...tables.table import Summary, words
from . import PEERS
from .values import FileWords

QUANTITIES = ("positions", "rotations", "jacobians")


def _rows(results: Results) -> list[Row]:
    """Return files in both engines, then robots of the bench in the peers' engines."""
    files, robots = _parted(results.all("robot_models"))
    return [*map(_of_file, by_problem(files).values()), *map(_of_robot, robots)]


def _parted(records: Iterable[Record]) -> tuple[list[Record], list[Record]]:
    """Return the records of others' files, and of the bench's own robots."""
    parts = grouped(records, lambda record: record.measured.get("task") == PEERS)
    return parts.get(False, []), parts.get(True, [])


def _of_file(records: Sequence[Record]) -> Row:
    """Return the row of a file, with numbers from the "valid" records.

    An engine with free mimics has too many freedoms.
    """
    valid = [record for record in records if record.has_numbers and not record.values.cause]
    row: Row = {"records": records, "valid": valid, "robot": records[0].title}
    row |= {"engines": listed([record.solver for record in valid]) or "none"}
    row |= {"remark": "; ".join(filter(None, map(_remark, records)))}
    if not valid:
        return row
    size = min(valid, key=lambda record: (record.values.freedoms, record.solver)).values
    positions, rotations, jacobians = (_largest(quantity, valid) for quantity in QUANTITIES)
    return row | {
        "freedoms": size.freedoms,
        "positions, of the extent": positions,
        "rotations": rotations,
        "Jacobians": jacobians,
        "links": size.links,
        "moving joints": size.joints,
    }


def _remark(record: Record) -> str:
    details: FileWords = record.values
    if not record.has_numbers:
        return details.unread
    if details.cause:
        difference = max(getattr(record.values, quantity) for quantity in QUANTITIES)
        return f"{record.solver} differs by {words(difference)}: {details.cause}"
    mimics = f"{record.solver} with mimic joints left free: {details.free_mimics}"
    return mimics if details.free_mimics else ""


def _of_robot(record: Record) -> Row:
    return {
        "records": [record],
        "valid": [],
        "robot": record.title,
        "engines": f"{record.solver} {record.values.version}",
        "positions": record.values.positions if record.has_numbers else None,
        "rotations": record.values.rotations if record.has_numbers else None,
        "remark": record.values.remark or catalogue.SINGLE_PRECISION.get(record.solver, ""),
    }


def _largest(quantity: str, records: Sequence[Record]) -> float | None:
    """Return the largest difference in records, None without any."""
    return max((getattr(record.values, quantity) for record in records), default=None)


def _records(rows: Sequence[Row]) -> tuple[list[Record], list[Record]]:
    return _parted(record for row in rows for record in row["records"])


def _measured(rows: Sequence[Row]) -> dict[str, str]:
    files, robots = (settings(records, "configurations") for records in _records(rows))
    return {"files": files or "No", "robots": robots or "none"}


def _summary(rows: Sequence[Row]) -> Summary:
    files = [row["valid"] for row in rows if row["valid"]]
    valid = [record for records in files for record in records]
    positions, rotations, jacobians = (words(_largest(q, valid)) for q in QUANTITIES)
    sentence = (
        f"Over {counted(len(files), 'file')} positions differ by at most "
        f"{positions} of the extent, rotations by {rotations}, Jacobians by {jacobians}."
    )
    return Summary(sentence * bool(valid), tuple(_points(*_records(rows))))


def _points(files: Sequence[Record], robots: Sequence[Record]) -> Iterator[str]:
    """Yield how many files each engine reads, and how closely engines of peers place robots."""
    for engine, records in grouped(files, lambda record: record.solver).items():
        read = [record for record in records if record.has_numbers]
        different = sum(bool(record.values.cause) for record in read)
        deviation = f", {words(different)} of them differently from MuJoCo's documentation"
        count = f"{words(len(read))} of {counted(len(records), 'file')} read"
        yield f"{engine}: {count}{deviation * bool(different)}"
    placed = (record for record in robots if record.values)
    for engine, records in grouped(placed, lambda record: record.solver).items():
        positions, rotations = (words(_largest(quantity, records)) for quantity in QUANTITIES[:2])
        yield (
            f"{engine} on the bench’s robots: effectors within {positions} m and {rotations} in a "
            "rotation matrix"
        )


readers = Captions(__file__).layout("readers", _rows, _summary, measured=_measured)

LAYOUTS = (readers,)
