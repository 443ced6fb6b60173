"""Robots and characters: how closely engines that read the same files agree with the reference."""

from collections.abc import Sequence
from operator import attrgetter

from ...harness.record import Record
from ...harness.results import counted, problems, settings
from ...tables.columns import folded, text
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from . import PEERS
from .readings import QUANTITIES, Comparison, agreeing, comparisons, files_of, largest


def _records(comparisons: Sequence[Comparison]) -> list[Record]:
    return [record for comparison in comparisons for record in comparison.records]


def _measured(comparisons: Sequence[Comparison]) -> str:
    records = _records(comparisons)
    configurations = settings(files_of(records), "configurations") or "No"
    of_robots = settings([r for r in records if r.facts.get("task") == PEERS], "configurations")
    return (
        f"{configurations} random configurations of each file and {of_robots or 'none'} of each "
        "robot, within the limits; links and joints are matched by name."
    )


def _summary(comparisons: Sequence[Comparison]) -> Summary:
    records = _records(comparisons)
    valid = agreeing(records)
    peers = [r for r in records if r.facts.get("task") == PEERS and r.values]
    points = [
        *(_reads(records, engine) for engine in _engines(files_of(records)) if valid),
        *(_farthest([r for r in peers if r.solver == engine]) for engine in _engines(peers)),
    ]
    if not valid:
        return Summary("Largest differences from the reference:" * bool(points), tuple(points))
    worst = [words(largest(valid, quantity)) for quantity in QUANTITIES]
    return Summary(
        f"Over {counted(len(problems(valid)), 'file')} positions differ by at most {worst[0]} "
        f"of the extent, rotations by {worst[1]}, Jacobians by {worst[2]}:",
        tuple(points),
    )


def _engines(records: Sequence[Record]) -> list[str]:
    return list(dict.fromkeys(record.solver for record in records))


def _reads(records: Sequence[Record], engine: str) -> str:
    mine = [record for record in files_of(records) if record.solver == engine]
    read = [record for record in mine if record.values]
    different = sum(bool(record.details.cause) for record in read)
    otherwise = f", {words(different)} of them otherwise than MuJoCo's documentation says"
    count = f"{words(len(read))} of {counted(len(mine), 'file')} read"
    return f"{engine}: {count}{otherwise * bool(different)}"


def _farthest(records: Sequence[Record]) -> str:
    positions, rotations = (words(largest(records, name)) for name in QUANTITIES[:2])
    return (
        f"{records[0].solver} on the bench’s robots: effectors within {positions} m and "
        f"{rotations} in a rotation matrix"
    )


readers = Layout(
    "Do other engines read the same robots and characters?",
    "readers",
    "Robots and characters, as engines read them",
    columns=(
        text("robot", attrgetter("title")),
        text("engines", attrgetter("engines")),
        Column("freedoms", read=attrgetter("freedoms")),
        *(
            Column(title, unit, read=attrgetter(name), group="largest difference")
            for title, unit, name in (
                ("positions, of the extent", "", "relative_positions"),
                ("positions", "m", "positions"),
                ("rotations", "", "rotations"),
                ("Jacobians", "", "jacobians"),
            )
        ),
        text("remark", attrgetter("remark")),
        *folded(
            [
                Column("links", read=attrgetter("links")),
                Column("moving joints", read=attrgetter("joints")),
            ]
        ),
    ),
    subjects=comparisons,
    shows="The reference reads each file itself. For files, differences are the largest of all "
    "links in all configurations; positions are measured against the extent of the links, "
    "Jacobians against that and one radian. An engine that is known to place links elsewhere "
    "is left out of the numbers, and the cause is given. For the bench’s own robots, each engine "
    "of a peer reads the same text as the reference, and the differences are of the effectors. "
    "Rotations are compared entry by entry as matrices; rounding in double precision leaves 1e-15.",
    measured=_measured,
    summary=_summary,
)

LAYOUTS = (readers,)
