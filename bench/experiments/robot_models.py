"""Robots and characters in the engines of others: how closely they agree with the reference."""

import importlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from plumbob.reference import forward_kinematics, rotation
from plumbob.reference.formats import mjcf, urdf

from ..measure.block import Block, Measured, Scale
from ..measure.isolation import Calculation, worker_process
from ..measure.record import Record
from ..measure.values import Fact, Values
from ..peers import catalogue
from ..peers.catalogue import KINEMATICS
from ..peers.peer import Peer
from ..problems.robots import ROBOTS, is_installed, robot, title

if TYPE_CHECKING:
    from plumbob.crosscheck.robots.models import RobotFile

SUITE = "robot_models"
# The task of records on the bench's own robots in engines of peers.
PEERS = "peers"
ROBOT_CONFIGURATIONS = 100  # random, of a robot


class FileValues(Values, frozen=True, kw_only=True):
    """The size of a file in an engine, and its largest differences from the reference.

    Positions are relative to the extent of the links, rotations are between entries of matrices,
    Jacobians relative to the extent and 1 radian.
    """

    configurations: Fact[int]
    cause: Fact[str] = ""  # why an engine reads the file otherwise
    free_mimics: Fact[str] = ""  # the mimics left free
    unread: Fact[str] = ""  # why an engine does not read the file
    links: int
    joints: int
    freedoms: int
    positions: float
    rotations: float
    jacobians: float


class EffectorDifferences(Values, frozen=True, kw_only=True):
    """The largest differences of effectors: positions [m], and entries of rotation matrices."""

    configurations: Fact[int]
    version: Fact[str]  # of the engine
    positions: float
    rotations: float


KINDS = {"": FileValues, PEERS: EffectorDifferences}


def blocks(scale: Scale) -> Iterator[Block]:
    """Yield every installed file for every engine, and every installed robot for every peer's."""
    from plumbob.crosscheck.engines import ROBOT_ENGINES
    from plumbob.crosscheck.robots.comparisons import CONFIGURATIONS
    from plumbob.crosscheck.robots.models import PACKAGES, models

    configurations = {"configurations": CONFIGURATIONS}
    for family in PACKAGES:
        for model in models(family):
            for engine in ROBOT_ENGINES:
                measure = partial(compare, engine, model)
                facts = {"title": model.name}
                yield Block(
                    SUITE, f"{family}/{model.name}", engine, measure, configurations, facts=facts
                )
    for name in filter(is_installed, ROBOTS):
        for peer in (peer for peer in KINEMATICS if peer.version):
            version = {"configurations": ROBOT_CONFIGURATIONS, "version": peer.version}
            facts = {"task": PEERS, "title": title(name)}
            measure = partial(compare_effectors, peer, name)
            yield Block(SUITE, f"peers/{name}", peer.title, measure, version, facts=facts)


def compare(engine: str, model: "RobotFile") -> Measured:
    """Compare a file in random configurations; keep why the engine refuses the file."""
    from plumbob.crosscheck.engines.robot_engine import UnreadableError
    from plumbob.crosscheck.robots.comparisons import differences, sweep
    from plumbob.crosscheck.robots.models import CAUSES, moving_joints

    try:
        comparison = sweep(engine, model)
    except (UnreadableError, ValueError) as error:
        reason = f"{engine} reads it, the reference does not"
        if isinstance(error, UnreadableError):
            reason = f"{engine} does not read it"
        sentence = f"{reason}: {error}".replace(str(model.path), model.path.name)
        return {"unread": sentence}
    articulation = comparison.robot.articulation
    return {
        "links": len(comparison.links),
        "joints": len(moving_joints(comparison.robot)) + len(articulation.mimics),
        "freedoms": articulation.freedom_count,
        **differences([comparison])._asdict(),
        "cause": CAUSES.get((engine, model.name), ""),
        "free_mimics": comparison.free_mimics,
    }


def compare_effectors(peer: Peer, name: str) -> Measured:
    """Compare a robot in a process of the engine's own; keep why the engine refuses the robot."""
    outcome = worker_process().perform(Calculation(effector_differences, (peer.module, name)))
    return {**(outcome.numbers or {}), "remark": outcome.note}


def effector_differences(module: str, name: str) -> Mapping[str, float]:
    """Return the largest differences of the effectors' positions [m] and rotation matrices."""
    from plumbob.crosscheck import samples

    model = robot(name)
    kinematics = importlib.import_module(module).kinematics(model)
    articulation = (urdf if model.is_chain else mjcf).parse(model.text).articulation
    effectors = [articulation.names.index(effector) for effector in model.effectors]
    q = model.draw(samples.generator(name, 0), ROBOT_CONFIGURATIONS)
    pose = forward_kinematics(articulation, q)
    transforms = np.reshape([*map(kinematics, q)], (len(q), len(effectors), 4, 4))
    matrices = rotation.to_matrix(pose.rotations[:, effectors])
    return {
        "positions": float(np.abs(transforms[..., :3, 3] - pose.positions[:, effectors]).max()),
        "rotations": float(np.abs(transforms[..., :3, :3] - matrices).max()),
    }


# What is shown.

from ..tables.captions import Captions
from ..tables.columns import folded, text
from ..tables.results import Results, by_problem, counted, grouped, listed, settings
from ..tables.table import Column, Summary, words

QUANTITIES = ("positions", "rotations", "jacobians")
# The records of a file in both engines, or of a robot of the bench in the engine of a peer.
Row = Sequence[Record]


def _rows(results: Results) -> list[Row]:
    """Return files in both engines, then robots of the bench in the peers' engines."""
    files, robots = _parted(results.all(SUITE))
    return [*by_problem(files).values(), *([record] for record in robots)]


def _parted(records: Iterable[Record]) -> tuple[list[Record], list[Record]]:
    """Return the records of others' files, and of the bench's own robots."""
    parts = grouped(records, lambda record: record.task == PEERS)
    return parts.get(False, []), parts.get(True, [])


def _files(records: Iterable[Record]) -> list[Record]:
    """Return the records of files with numbers, of engines without a known difference."""
    files, _ = _parted(records)
    return [record for record in files if record.has_numbers and not record.values.cause]


def _robots(records: Iterable[Record]) -> list[Record]:
    """Return the records of the bench's robots with numbers."""
    return [record for record in _parted(records)[1] if record.has_numbers]


def _engines(row: Row) -> str:
    robots = [f"{record.solver} {record.values.version}" for record in _parted(row)[1]]
    return listed(robots or [record.solver for record in _files(row)]) or "none"


def _remark(record: Record) -> str:
    if record.task == PEERS:
        return record.values.remark or catalogue.SINGLE_PRECISION.get(record.solver, "")
    if not record.has_numbers:
        return record.values.unread
    file: FileValues = record.values
    if file.cause:
        difference = max(file.positions, file.rotations, file.jacobians)
        return f"{record.solver} differs by {words(difference)}: {file.cause}"
    mimics = f"{record.solver} with mimic joints left free: {file.free_mimics}"
    return mimics if file.free_mimics else ""


def _size(name: str, row: Row) -> int | None:
    """Return a size of a file; an engine with free mimics has too many freedoms."""
    files = sorted(_files(row), key=lambda record: (record.values.freedoms, record.solver))
    return getattr(files[0].values, name) if files else None


def _largest(quantity: str, records: Sequence[Record]) -> float | None:
    """Return the largest difference in records, None without any."""
    return max((getattr(record.values, quantity) for record in records), default=None)


_difference = partial(Column, group="largest difference")
COLUMNS = (
    text("robot", lambda row: row[0].title),
    text("engines", _engines),
    Column("freedoms", read=partial(_size, "freedoms")),
    _difference("positions, of the extent", read=lambda row: _largest("positions", _files(row))),
    _difference("positions", "m", read=lambda row: _largest("positions", _robots(row))),
    _difference("rotations", read=lambda row: _largest("rotations", [*_files(row), *_robots(row)])),
    _difference("Jacobians", read=lambda row: _largest("jacobians", _files(row))),
    text("remark", lambda row: "; ".join(filter(None, map(_remark, row)))),
    *folded(
        Column("links", read=partial(_size, "links")),
        Column("moving joints", read=partial(_size, "joints")),
    ),
)


def _measured(rows: Sequence[Row]) -> dict[str, str]:
    parts = _parted(record for row in rows for record in row)
    files, robots = (settings(records, "configurations") for records in parts)
    return {"files": files or "No", "robots": robots or "none"}


def _summary(rows: Sequence[Row]) -> Summary:
    files = [_files(row) for row in rows if _files(row)]
    valid = [record for records in files for record in records]
    positions, rotations, jacobians = (words(_largest(q, valid)) for q in QUANTITIES)
    sentence = (
        f"Over {counted(len(files), 'file')} positions differ by at most "
        f"{positions} of the extent, rotations by {rotations}, Jacobians by {jacobians}."
    )
    points = _points([record for row in rows for record in row])
    return Summary(sentence * bool(valid), tuple(points))


def _points(records: Sequence[Record]) -> Iterator[str]:
    """Yield how many files each engine reads, and how closely engines of peers place robots."""
    for engine, files in grouped(_parted(records)[0], lambda record: record.solver).items():
        read = [record for record in files if record.has_numbers]
        different = sum(bool(record.values.cause) for record in read)
        deviation = f", {words(different)} of them differently from MuJoCo's documentation"
        count = f"{words(len(read))} of {counted(len(files), 'file')} read"
        yield f"{engine}: {count}{deviation * bool(different)}"
    for engine, robots in grouped(_robots(records), lambda record: record.solver).items():
        positions, rotations = (words(_largest(quantity, robots)) for quantity in QUANTITIES[:2])
        yield (
            f"{engine} on the bench’s robots: effectors within {positions} m and {rotations} in a "
            "rotation matrix"
        )


readers = Captions(__file__).layout("readers", _rows, _summary, _measured, columns=COLUMNS)

LAYOUTS = (readers,)
