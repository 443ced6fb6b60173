"""Robots and characters from files of others: how closely both engines agree with the reference."""

from collections.abc import Sequence

from ...harness.record import Record
from ...presentation.results import Results, counted, listed, problems, settings
from ...presentation.tables import Cell, Column, Summary, Table, words

SIZES = ("links", "joints", "freedoms")
QUANTITIES = ("positions", "rotations", "jacobians")


def agreement(results: Results) -> Table:
    """Return a row a file: its size, the largest differences, and what an engine does otherwise."""
    records = results.all("robot_models")
    return Table(
        "robot_models",
        "Robots and characters from files, beside both engines",
        (
            Column("file", words=True),
            Column("links"),
            Column("moving joints"),
            Column("freedoms"),
            Column("positions, of the extent"),
            Column("rotations"),
            Column("Jacobians"),
            Column("engines", words=True),
            Column("but", words=True),
        ),
        tuple(_row([r for r in records if r.problem == name]) for name in problems(records)),
        shows="The reference reads each file itself. Differences are the largest of all links in "
        "all configurations; positions are measured against the extent of the links, "
        "Jacobians against that and one radian. An engine that is known to place links elsewhere "
        "is left out of the numbers, and the cause is given.",
        measured=f"{settings(records, 'configurations') or 'No'} random configurations of each "
        "file, within the limits; links and joints are matched by name.",
        summary=_summary(records),
    )


def _row(records: Sequence[Record]) -> tuple[Cell, ...]:
    agreeing = [record for record in records if _agrees(record)]
    found: list[Cell] = [None] * (len(SIZES) + len(QUANTITIES))
    if agreeing:  # an engine that leaves mimic joints free counts more joints than there are
        fullest = min(agreeing, key=lambda record: (record.arrays["freedoms"], record.solver))
        found = [int(fullest.arrays[name]) for name in SIZES]
        found += [_largest(agreeing, name) for name in QUANTITIES]
    return (
        records[0].title,
        *found,
        listed([record.solver for record in agreeing]) or "none",
        "; ".join(remark for record in records if (remark := _remark(record))),
    )


def _agrees(record: Record) -> bool:
    """Return whether a record has numbers that a fault of the engine has no part in."""
    return "links" in record.arrays and not record.notes["cause"]


def _largest(records: Sequence[Record], quantity: str) -> float:
    return max(float(record.arrays[quantity]) for record in records)


def _remark(record: Record) -> str:
    """Return what is to be said of an engine and a file, "" if nothing."""
    if "links" not in record.arrays:
        return record.notes["unread"]
    if record.notes["cause"]:
        off = max(_largest([record], quantity) for quantity in QUANTITIES)
        return f"{record.solver} is off by {words(off)}: {record.notes['cause']}"
    if record.notes["free mimics"]:
        return f"{record.solver} with mimic joints left free: {record.notes['free mimics']}"
    return ""


def _summary(records: Sequence[Record]) -> Summary:
    agreeing = [record for record in records if _agrees(record)]
    if not agreeing:
        return Summary()
    worst = [words(_largest(agreeing, quantity)) for quantity in QUANTITIES]
    points = []
    for engine in dict.fromkeys(record.solver for record in records):
        mine = [record for record in records if record.solver == engine]
        read = [record for record in mine if "links" in record.arrays]
        off = sum(bool(record.notes["cause"]) for record in read)
        points.append(
            f"{engine}: {words(len(read))} of {counted(len(mine), 'file')} read, "
            f"{words(off)} of them otherwise than MuJoCo's documentation says"
            if off
            else f"{engine}: {words(len(read))} of {counted(len(mine), 'file')} read"
        )
    return Summary(
        f"Over {counted(len(problems(agreeing)), 'file')} positions differ by at most {worst[0]} "
        f"of the extent, rotations by {worst[1]}, Jacobians by {worst[2]}:",
        tuple(points),
    )
