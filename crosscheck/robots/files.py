"""Compare the reference with other readers on all files in folders."""

import contextlib
import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ElementTree

import numpy as np

from plumbob.reference import Articulation, Skeleton, forward_kinematics, jacobians, rotation
from plumbob.reference.formats import bvh
from plumbob.reference.formats.source import read_text

from ..child_process import CallProcess, LostError
from ..engines import ROBOT_ENGINES
from ..engines.file_kind import BVH, FRAGMENT, MJCF, URDF, file_kind, xml_root
from ..engines.robot_engine import UnreadableError
from ..tolerances import POSITION
from .comparisons import differences, sweep_in_parts
from .deviations import known_deviations
from .independent_bvh import global_poses
from .models import Model

SECOND_READER = "second reader"
# Elements of an MJCF file whose attributes are some obsolete: MuJoCo refuses files for them.
SETTINGS = ("option", "size", "visual", "statistic")
ENGINES = {URDF: tuple(ROBOT_ENGINES), MJCF: tuple(ROBOT_ENGINES), BVH: (SECOND_READER,)}
AGREES, DIFFERS, DEVIATES = "agrees", "differs", "reads otherwise"
UNREAD, REFUSED, NEITHER, LOST = "not read", "not read by us", "read by neither", "lost"


class Reading(NamedTuple):
    """The comparison of the reference and an engine on one file.

    The outcome is AGREES or DIFFERS if both read it, DEVIATES if they differ for a known reason;
    UNREAD if only the engine does not read it, REFUSED if only the reference does not, NEITHER if
    both do not; LOST if the process crashed or took too long. The difference is the largest one of
    positions and linear velocities, relative to the extent of the links, and of rotation matrices
    and angular velocities; None unless both read it.
    """

    engine: str
    outcome: str
    difference: float | None = None
    why: str = ""  # the reason for the outcome
    notes: tuple[str, ...] = ()  # the warnings of the reference


class File(NamedTuple):
    """A file, its kind, and the folder that must contain the files it includes."""

    path: Path
    kind: str
    root: Path


class Checked(NamedTuple):
    """A file and its readings; a fragment has none."""

    file: File
    readings: tuple[Reading, ...]


class Found(NamedTuple):
    """The files to read in some folders, and the number of XML files of other kinds."""

    files: tuple[File, ...]
    others: int


def find(paths: Iterable[str | Path]) -> Found:
    """Return the URDF, MJCF and BVH files at some paths and in folders below them, in order.

    Raises:
        ValueError: if a path does not exist, or there are no such files.
    """
    files: dict[Path, File] = {}
    others = 0
    for path in map(Path, paths):
        if not path.exists():
            raise ValueError(f"{path}: there is no such file or folder")
        root = path if path.is_dir() else path.parent
        for name in _below(path):
            kind = ""
            with contextlib.suppress(ValueError):
                kind = file_kind(name)
            others += not kind
            if kind:
                files.setdefault(name.resolve(), File(name, kind, root))
    if not files:
        raise ValueError(
            f"{', '.join(map(str, paths))}: expected URDF, MJCF or BVH files, got none"
        )
    return Found(tuple(files.values()), others)


def check(files: Iterable[File], patience: float = 60.0) -> Iterator[Checked]:
    """Yield the readings of each file, in a child process that survives crashes and time-outs.

    Args:
        files: as `find` returns them.
        patience: limit of processor time for an engine and a file [s].
    """
    files = tuple(files)
    included = {path for file in files for path in _includes(file)}
    with contextlib.closing(CallProcess(prepare, patience)) as child:
        for file in files:
            readings = [_read(child, engine, file) for engine in ENGINES.get(file.kind, ())]
            if file.path.resolve() in included and all(r.outcome == NEITHER for r in readings):
                yield Checked(file._replace(kind=FRAGMENT), ())
            else:
                yield Checked(file, _with_causes(child, file, readings))


def compare(engine: str, file: File) -> Reading:
    """Read a file by the reference and an engine and compare them; exceptions become outcomes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            difference = _largest_difference(engine, file)
            outcome, why = (AGREES if difference <= POSITION.value else DIFFERS), ""
        except UnreadableError as error:
            ours = _refusal(file)
            difference, outcome = None, NEITHER if ours else UNREAD
            why = "; ".join(filter(None, [_sentence(error, file), ours]))
        except ValueError as error:
            difference, outcome, why = None, REFUSED, _sentence(error, file)
        except Exception as error:
            difference, outcome = None, LOST
            why = f"it ends in {type(error).__name__}: {_sentence(error, file)}"
    notes = dict.fromkeys(_sentence(warning.message, file) for warning in caught)
    return Reading(engine, outcome, difference, why, tuple(notes))


def prepare() -> None:
    """Compile the kernels that all comparisons call."""
    arm = Articulation(Skeleton([-1, 0], np.eye(2, 3)), ["free", "hinge"])
    forward_kinematics(arm, arm.neutral()[None])
    jacobians.jacobians(arm, arm.neutral()[None])


def _largest_difference(engine: str, file: File) -> float:
    """Return the largest difference in random configurations or frames, or NaN."""
    if engine == SECOND_READER:
        return _compare_motions(file)
    parts = sweep_in_parts(engine, Model(file.path.name, file.path, file.root))
    return float(np.max(differences(parts)))


def _compare_motions(file: File) -> float:
    """Return the largest difference over all frames of a motion, or NaN."""
    motion = bvh.read(file.path)
    pose = motion.pose()
    extent = float(np.ptp(pose.positions.reshape(-1, 3), axis=0).max(initial=0.0)) or 1.0
    largest, found = 0.0, 0
    try:
        for name, x, R in global_poses(read_text(file.path)):
            if name in motion.skeleton.names:
                j = motion.skeleton.index(name)
                found += 1
                errors = [np.abs(x - pose.positions[:, j]) / extent]
                errors += [np.abs(R - rotation.to_matrix(pose.rotations[:, j]))]
                largest = np.max([largest, *(part.max(initial=0.0) for part in errors)])
    except Exception as error:
        raise UnreadableError(f"it ends in {type(error).__name__}: {error}") from None
    return float(largest) if found == motion.skeleton.joint_count else np.nan


def _refusal(file: File) -> str:
    """Return the reason why the reference does not read a file, or ""."""
    try:
        if file.kind == BVH:
            bvh.read(file.path)
        else:
            Model(file.path.name, file.path, file.root).read(mimic=False)
    except ValueError as error:
        return f"the reference: {_sentence(error, file)}"
    return ""


def _read(child: CallProcess, engine: str, file: File) -> Reading:
    try:
        return child.call(compare, engine, file)
    except LostError as error:
        return Reading(engine, LOST, why=str(error))


def _with_causes(child: CallProcess, file: File, readings: list[Reading]) -> tuple[Reading, ...]:
    """Explain a difference of Pinocchio by known causes if MuJoCo agrees with the reference.

    Where MuJoCo refuses the file, it reads a copy without settings, which kinematics does not need.
    """
    outcomes = {reading.engine: reading.outcome for reading in readings}
    causes = "; ".join(known_deviations(file.path))
    if not causes or outcomes["Pinocchio"] != DIFFERS:
        return tuple(readings)
    if outcomes["MuJoCo"] == UNREAD:
        with tempfile.TemporaryDirectory() as folder:
            copy = _without_settings(file, Path(folder))
            outcomes["MuJoCo"] = _read(child, "MuJoCo", copy).outcome
    excused = outcomes["MuJoCo"] == AGREES
    return tuple(
        r._replace(outcome=DEVIATES, why=causes) if excused and r.outcome == DIFFERS else r
        for r in readings
    )


def _without_settings(file: File, folder: Path) -> File:
    """Return a copy, in a folder, of an MJCF file and those that it includes without `SETTINGS`."""
    top, main = file.root.resolve(), file.path.parent.resolve() / file.path.name
    for path in (main, *_includes(file)):
        root = xml_root(path)
        for element in [child for child in root if child.tag in SETTINGS]:
            root.remove(element)
        copy = folder / path.relative_to(top)
        copy.parent.mkdir(parents=True, exist_ok=True)
        ElementTree(root).write(copy)
    return File(folder / main.relative_to(top), MJCF, folder)


def _below(path: Path) -> list[Path]:
    """Return the regular files with known suffixes at a path or below it, in order."""
    if not path.is_dir():
        return [path] if path.is_file() else []
    found = [Path(folder) / name for folder, _, names in os.walk(path) for name in names]
    suffixes = (".urdf", ".bvh", ".xml", ".mjcf")
    return sorted(name for name in found if name.suffix.lower() in suffixes and name.is_file())


def _includes(file: File) -> list[Path]:
    """Return the files that an MJCF file includes, relative to its folder."""
    try:
        root = xml_root(file.path) if file.kind == MJCF else Element("")
    except ValueError:
        return []
    names = [include.get("file", "") for include in root.iter("include")]
    return [(file.path.parent / name).resolve() for name in names]


def _sentence(error: object, file: File) -> str:
    """Return a message as one line, without the folder of the file."""
    message = str(error).replace(f"{file.path}", file.path.name)
    return " ".join(message.split())[:300]
