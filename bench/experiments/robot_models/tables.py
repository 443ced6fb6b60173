"""Robots and characters from files of others: how closely both engines agree with the reference."""

from collections.abc import Sequence
from functools import partial

from ...harness.record import Record
from ...harness.results import Results, by_problem, counted, listed, problems, settings
from ...peers import registry
from ...tables.columns import text, titled
from ...tables.layout import Layout
from ...tables.table import Column, Summary, words
from . import PEERS

SIZES = {"links": "links", "moving joints": "joints", "freedoms": "freedoms"}
QUANTITIES = {
    "positions, of the extent": "positions",
    "rotations": "rotations",
    "Jacobians": "jacobians",
}


def _of_files(results: Results) -> list[Record]:
    return [r for r in results.all("robot_models") if r.facts.get("task") != PEERS]


def _all(files: Sequence[Sequence[Record]]) -> list[Record]:
    return [record for file in files for record in file]


def _size(file: Sequence[Record], name: str) -> int | None:
    """Return a size by the engine that counts fewest: one that leaves mimics free counts more."""
    agreeing = _agreeing(file)
    if not agreeing:
        return None
    fullest = min(agreeing, key=lambda record: (record.arrays["freedoms"], record.solver))
    return int(fullest.arrays[name])


def _agreeing(file: Sequence[Record]) -> list[Record]:
    """Return the records with numbers that a fault of the engine has no part in."""
    return [r for r in file if "links" in r.arrays and not r.notes["cause"]]


def _most(file: Sequence[Record], name: str) -> float | None:
    return max((float(record.arrays[name]) for record in _agreeing(file)), default=None)


def _remark(record: Record) -> str:
    """Return what is to be said of an engine and a file, "" if nothing."""
    if "links" not in record.arrays:
        return record.notes["unread"]
    if record.notes["cause"]:
        off = max(float(record.arrays[quantity]) for quantity in QUANTITIES.values())
        return f"{record.solver} is off by {words(off)}: {record.notes['cause']}"
    if record.notes["free mimics"]:
        return f"{record.solver} with mimic joints left free: {record.notes['free mimics']}"
    return ""


def _summary(files: Sequence[Sequence[Record]]) -> Summary:
    records = _all(files)
    agreeing = _agreeing(records)
    if not agreeing:
        return Summary()
    worst = [words(_most(agreeing, quantity)) for quantity in QUANTITIES.values()]
    return Summary(
        f"Over {counted(len(problems(agreeing)), 'file')} positions differ by at most {worst[0]} "
        f"of the extent, rotations by {worst[1]}, Jacobians by {worst[2]}:",
        tuple(_reads(records, engine) for engine in dict.fromkeys(r.solver for r in records)),
    )


def _reads(records: Sequence[Record], engine: str) -> str:
    mine = [record for record in records if record.solver == engine]
    read = [record for record in mine if "links" in record.arrays]
    off = sum(bool(record.notes["cause"]) for record in read)
    otherwise = f", {words(off)} of them otherwise than MuJoCo's documentation says" if off else ""
    return f"{engine}: {words(len(read))} of {counted(len(mine), 'file')} read{otherwise}"


agreement = Layout(
    "On which robots and characters do they agree?",
    "robot_models",
    "Robots and characters from files, beside both engines",
    columns=(
        text("file", lambda file: file[0].title),
        *(
            Column(title, read=partial(_size, name=name), folded=title != "freedoms")
            for title, name in SIZES.items()
        ),
        *(
            Column(title, read=partial(_most, name=name), group="largest difference")
            for title, name in QUANTITIES.items()
        ),
        text("engines", lambda file: listed([r.solver for r in _agreeing(file)]) or "none"),
        text("but", lambda file: "; ".join(filter(None, map(_remark, file)))),
    ),
    subjects=lambda results: by_problem(_of_files(results)).values(),
    shows="The reference reads each file itself. Differences are the largest of all links in "
    "all configurations; positions are measured against the extent of the links, "
    "Jacobians against that and one radian. An engine that is known to place links elsewhere "
    "is left out of the numbers, and the cause is given.",
    measured=lambda files: (
        f"{settings(_all(files), 'configurations') or 'No'} random configurations of each "
        "file, within the limits; links and joints are matched by name."
    ),
    summary=_summary,
)


def _peers_summary(records: Sequence[Record]) -> Summary:
    read = [record for record in records if "positions" in record.arrays]
    if not read:
        return Summary()
    engines = dict.fromkeys(record.solver for record in read)
    return Summary(
        "Where the engines of peers put the effectors of the bench’s own robots, largest "
        "differences from the reference:",
        tuple(_farthest([r for r in read if r.solver == engine]) for engine in engines),
    )


def _farthest(records: Sequence[Record]) -> str:
    position, rotation = (
        words(max(float(record.arrays[name]) for record in records))
        for name in ("positions", "rotations")
    )
    return f"{records[0].solver}: {position} m and {rotation} in a rotation matrix"


def _peer_remark(record: Record) -> str:
    return record.notes["remark"] or registry.SINGLE_PRECISION.get(record.solver, "")


peers_kinematics = Layout(
    "Do the engines of the other solvers read the same robots?",
    "peers_kinematics",
    "The bench’s robots in engines of other solvers",
    columns=(
        titled("robot"),
        text("engine", lambda record: record.solver),
        Column("version", words=True, folded=True, read=lambda r: r.settings["version"]),
        Column("positions", "m", group="largest difference", read=lambda r: _maybe(r, "positions")),
        Column("rotations", group="largest difference", read=lambda r: _maybe(r, "rotations")),
        text("but", _peer_remark),
    ),
    subjects=lambda results: results.all("robot_models", task=PEERS),
    shows="Each engine reads the same text as the reference and puts the effectors where it "
    "says; rotations are compared entry by entry as matrices. Rounding in double precision "
    "leaves 1e-15.",
    measured=lambda records: (
        f"{settings(records, 'configurations') or 'No'} random configurations of each robot, "
        "within the limits."
    ),
    summary=_peers_summary,
)


def _maybe(record: Record, name: str) -> float | None:
    return float(record.arrays[name]) if name in record.arrays else None


LAYOUTS = (agreement, peers_kinematics)
