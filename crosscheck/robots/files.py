"""Files of anyone, found in folders: the reference beside every engine that reads their kind."""

import os
import re
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from reference import Articulation, Skeleton, forward_kinematics, jacobians, rotation
from reference.formats import bvh
from reference.formats.source import LARGEST, read_text

from ..child_process import ChildProcess, LostError
from ..engines import ROBOT_ENGINES
from ..engines.file_kind import BVH, FRAGMENT, MJCF, URDF, file_kind
from ..engines.robot_engine import UnreadableError
from ..tolerances import POSITION
from .comparisons import differences
from .departures import departures
from .models import Model
from .second_bvh import placements
from .sweep import sweep_anew

SECOND_READER = "second reader"
ENGINES = {URDF: tuple(ROBOT_ENGINES), MJCF: tuple(ROBOT_ENGINES), BVH: (SECOND_READER,)}
AGREES, DIFFERS, DEPARTS = "agrees", "differs", "reads otherwise"
UNREAD, REFUSED, NEITHER, LOST = "not read", "not read by us", "read by neither", "lost"
INCLUDE = re.compile(rb"<include\s[^>]*?\bfile\s*=\s*[\"']([^\"'<>]{1,1000})[\"']")


class Reading(NamedTuple):
    """One file, by the reference and by an engine.

    Attributes:
        engine: its name.
        outcome: AGREES or DIFFERS if both read it, DEPARTS if they differ by a known cause; UNREAD
            if only the engine does not read it, REFUSED if only the reference does not, NEITHER;
            LOST if the process crashed or took too long.
        difference: the largest of positions and linear velocities over the room that the links
            take up, and of rotation matrices and angular velocities; None unless both read it.
        why: of the outcome, a sentence; else "".
        notes: what the reference warned of.
    """

    engine: str
    outcome: str
    difference: float | None = None
    why: str = ""
    notes: tuple[str, ...] = ()


class File(NamedTuple):
    """A file that was found, its kind, and the folder that what it includes must be in."""

    path: Path
    kind: str
    root: Path


class Checked(NamedTuple):
    """A file and its readings, none of a fragment."""

    file: File
    readings: tuple[Reading, ...]


class Found(NamedTuple):
    """What folders hold: files to read, and how many files of other kinds that end in .xml."""

    files: tuple[File, ...]
    others: int


def find(paths: Iterable[str | Path]) -> Found:
    """Return the URDF, MJCF and BVH files at some paths and in folders below them, in order.

    Raises:
        ValueError: if there is nothing at a path, or no such file.
    """
    files: dict[Path, File] = {}
    others = 0
    for path in map(Path, paths):
        if not path.exists():
            raise ValueError(f"{path}: there is no such file or folder")
        for name in _below(path):
            kind = _kind(name)
            others += not kind
            if kind:
                files.setdefault(name.resolve(), File(name, kind, _root(path)))
    if not files:
        raise ValueError(
            f"{', '.join(map(str, paths))}: expected URDF, MJCF or BVH files, got none"
        )
    return Found(tuple(files.values()), others)


def check(files: Iterable[File], patience: float = 60.0) -> Iterator[Checked]:
    """Yield what comes of each file; one that crashes an engine or never ends costs only itself.

    Args:
        files: as `find` returns them.
        patience: how long an engine may take over a file [s].
    """
    files = tuple(files)
    included = {path for file in files for path in _includes(file)}
    with ChildProcess(prepare, patience) as child:
        for file in files:
            readings = [_read(child, engine, file) for engine in ENGINES.get(file.kind, ())]
            if file.path.resolve() in included and all(r.outcome == NEITHER for r in readings):
                yield Checked(file._replace(kind=FRAGMENT), ())
            else:
                yield Checked(file, _with_causes(file, readings))


def compare(engine: str, file: File) -> Reading:
    """Read a file by the reference and an engine, and compare; whatever it raises is its answer."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            apart = _motions(file) if engine == SECOND_READER else _robots(engine, file)
            outcome, why = (AGREES if apart <= POSITION.value else DIFFERS), ""
        except UnreadableError as error:
            ours = _refusal(file)
            apart, outcome = None, NEITHER if ours else UNREAD
            why = "; ".join(filter(None, [_sentence(error, file), ours]))
        except ValueError as error:
            apart, outcome, why = None, REFUSED, _sentence(error, file)
        except Exception as error:
            apart, outcome = None, LOST
            why = f"it ends in {type(error).__name__}: {_sentence(error, file)}"
    notes = dict.fromkeys(_sentence(warning.message, file) for warning in caught)
    return Reading(engine, outcome, apart, why, tuple(notes))


def prepare() -> None:
    """Compile what every comparison runs."""
    arm = Articulation(Skeleton([-1, 0], np.eye(2, 3)), ["free", "hinge"])
    forward_kinematics(arm, arm.neutral()[None])
    jacobians.jacobians(arm, arm.neutral()[None])


def _robots(engine: str, file: File) -> float:
    """Return the largest difference in random configurations, NaN if one is no number."""
    swept = sweep_anew(engine, Model(file.path.name, file.path, file.root))
    return float(np.max(differences(swept)))


def _motions(file: File) -> float:
    """Return the largest difference over all frames of a motion, NaN if one is no number."""
    motion = bvh.read(file.path)
    pose = motion.pose()
    room = float(np.ptp(pose.positions.reshape(-1, 3), axis=0).max(initial=0.0)) or 1.0
    worst, seen = 0.0, 0
    try:
        for name, x, R in placements(read_text(file.path)):
            if name in motion.skeleton.names:
                j = motion.skeleton.index(name)
                seen += 1
                apart = [np.abs(x - pose.positions[:, j]) / room]
                apart += [np.abs(R - rotation.to_matrix(pose.rotations[:, j]))]
                worst = np.max([worst, *(part.max(initial=0.0) for part in apart)])
    except Exception as error:
        raise UnreadableError(f"it ends in {type(error).__name__}: {error}") from None
    return float(worst) if seen == motion.skeleton.joint_count else np.nan


def _refusal(file: File) -> str:
    """Return why the reference does not read a file, "" if it does."""
    try:
        if file.kind == BVH:
            bvh.read(file.path)
        else:
            Model(file.path.name, file.path, file.root).read(mimic=False)
    except ValueError as error:
        return f"the reference: {_sentence(error, file)}"
    return ""


def _read(child: ChildProcess, engine: str, file: File) -> Reading:
    try:
        return child.call(compare, engine, file)
    except LostError as error:
        return Reading(engine, LOST, why=str(error))


def _with_causes(file: File, readings: list[Reading]) -> tuple[Reading, ...]:
    """Name why Pinocchio differs, where MuJoCo agrees with us and a cause is known."""
    causes = "; ".join(departures(file.path)) if file.kind == MJCF else ""
    excused = causes and any(r.engine == "MuJoCo" and r.outcome == AGREES for r in readings)
    return tuple(
        r._replace(outcome=DEPARTS, why=causes)
        if excused and r.engine == "Pinocchio" and r.outcome == DIFFERS
        else r
        for r in readings
    )


def _kind(path: Path) -> str:
    try:
        return file_kind(path)
    except OSError:
        return ""


def _below(path: Path) -> list[Path]:
    """Return the regular files at a path or below it that may be of a kind we know, in order."""
    if not path.is_dir():
        return [path] if path.is_file() else []
    found = [Path(folder) / name for folder, _, names in os.walk(path) for name in names]
    suffixes = (".urdf", ".bvh", ".xml", ".mjcf")
    return sorted(name for name in found if name.suffix.lower() in suffixes and name.is_file())


def _root(path: Path) -> Path:
    return path if path.is_dir() else path.parent


def _includes(file: File) -> list[Path]:
    """Return the files that an MJCF file names as included, beside it."""
    if file.kind != MJCF:
        return []
    with file.path.open("rb") as opened:
        names = INCLUDE.findall(opened.read(LARGEST))
    return [(file.path.parent / os.fsdecode(name)).resolve() for name in names]


def _sentence(error: object, file: File) -> str:
    """Return what is said in one line, without the folder of the file."""
    said = str(error).replace(f"{file.path}", file.path.name)
    return " ".join(said.split())[:300]
