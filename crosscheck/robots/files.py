"""Compare the reference with other readers on all files in folders."""

import contextlib
import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import ElementTree

import numpy as np

from plumbob.process.child import CallProcess, LostError
from plumbob.reference import Articulation, Skeleton, forward_kinematics, jacobians, rotation
from plumbob.reference.formats import bvh
from plumbob.reference.formats.source import read_text

from ..engines import ROBOT_ENGINES
from ..engines.file_kind import BVH, FRAGMENT, MJCF, URDF, file_kind, xml_root
from ..engines.robot_engine import UnreadableError
from ..tolerances import POSITION
from .comparisons import differences, sweep_in_parts
from .deviations import known_deviations
from .independent_bvh import global_poses
from .models import RobotFile

SECOND_READER = "second reader"
# Elements of an MJCF file with obsolete attributes, for which MuJoCo refuses files.
SETTINGS = ("option", "size", "visual", "statistic")
SUFFIXES = (".urdf", ".bvh", ".xml", ".mjcf")
ENGINES = {URDF: tuple(ROBOT_ENGINES), MJCF: tuple(ROBOT_ENGINES), BVH: (SECOND_READER,)}
AGREES, DIFFERS, DEVIATES = "agrees", "differs", "reads otherwise"
UNREAD, REFUSED, NEITHER, CRASHED = "not read", "not read by us", "read by neither", "lost"


class FileReading(NamedTuple):
    """The comparison of the reference and an engine on a file.

    The outcome is AGREES or DIFFERS if both read the file, DEVIATES if both differ and another
    engine agrees. UNREAD: only the reference reads the file; REFUSED: only the engine; NEITHER:
    neither reads the file. CRASHED: the process crashed or took too long. The difference is the
    largest of positions and linear velocities, relative to the extent of the links, and of rotation
    matrices and angular velocities. Without two readings the difference is None.
    """

    engine: str
    outcome: str
    difference: float | None = None
    why: str = ""  # the reason for the outcome
    notes: tuple[str, ...] = ()  # the warnings of the reference


class ModelFile(NamedTuple):
    """A file, its kind, and the folder that must contain all included files."""

    path: Path
    kind: str
    root: Path


class CheckedFile(NamedTuple):
    """A file and its readings; a fragment has none."""

    file: ModelFile
    readings: tuple[FileReading, ...]


class FileSelection(NamedTuple):
    """The files to read in some folders, and the number of XML files of other kinds."""

    files: tuple[ModelFile, ...]
    ignored: int


def find(paths: Iterable[str | Path]) -> FileSelection:
    """Return the URDF, MJCF and BVH files at some paths and in folders below them, in order.

    Raise a ValueError if a path does not exist, or there are no such files.
    """
    files: dict[Path, ModelFile] = {}
    ignored, roots = 0, list(map(Path, paths))
    for path in roots:
        if not path.exists():
            raise ValueError(f"{path}: there is no such file or folder")
        root = path if path.is_dir() else path.parent
        for candidate in _files_below(path):
            kind = ""
            with contextlib.suppress(ValueError):
                kind = file_kind(candidate)
            ignored += not kind
            if kind:
                files.setdefault(candidate.resolve(), ModelFile(candidate, kind, root))
    if not files:
        names = ", ".join(map(str, roots))
        raise ValueError(f"{names}: expected URDF, MJCF or BVH files, got none")
    return FileSelection(tuple(files.values()), ignored)


def check(files: Iterable[ModelFile], patience: float = 60.0) -> Iterator[CheckedFile]:
    """Yield the readings of each file, in a child process that survives crashes and time-outs.

    An engine may take so much processor time for a file [s].
    """
    files = tuple(files)
    included = {path for file in files for path in _includes(file)}
    with contextlib.closing(CallProcess(prepare, patience)) as child:
        for file in files:
            readings = [_read(child, engine, file) for engine in ENGINES.get(file.kind, ())]
            if file.path.resolve() in included and all(r.outcome == NEITHER for r in readings):
                yield CheckedFile(file._replace(kind=FRAGMENT), ())
            else:
                yield CheckedFile(file, _with_causes(child, file, readings))


def compare(engine: str, file: ModelFile) -> FileReading:
    """Read a file by the reference and an engine and compare them; exceptions become outcomes."""
    difference, why = None, ""
    with warnings.catch_warnings(record=True) as messages:
        warnings.simplefilter("always")
        try:
            difference = _largest_difference(engine, file)
            outcome = AGREES if difference <= POSITION.value else DIFFERS
        except UnreadableError as error:
            refusal = _refusal(file)
            outcome = NEITHER if refusal else UNREAD
            why = "; ".join(filter(None, [_one_line(error, file), refusal]))
        except ValueError as error:
            outcome, why = REFUSED, _one_line(error, file)
        except Exception as error:
            outcome = CRASHED
            why = f"it ends in {type(error).__name__}: {_one_line(error, file)}"
    notes = dict.fromkeys(_one_line(message.message, file) for message in messages)
    return FileReading(engine, outcome, difference, why, tuple(notes))


def prepare() -> None:
    """Compile the kernels of all comparisons."""
    arm = Articulation(Skeleton([-1, 0], np.eye(2, 3)), ["free", "hinge"])
    forward_kinematics(arm, arm.neutral()[None])
    jacobians.jacobians(arm, arm.neutral()[None])


def _largest_difference(engine: str, file: ModelFile) -> float:
    """Return the largest difference in random configurations or frames, or NaN."""
    if engine == SECOND_READER:
        return _compare_motions(file)
    parts = sweep_in_parts(engine, RobotFile(file.path.name, file.path, file.root))
    return float(np.max(differences(parts)))


def _compare_motions(file: ModelFile) -> float:
    """Return the largest difference over all frames of a motion, or NaN."""
    motion = bvh.read(file.path)
    pose = motion.pose()
    extent = float(np.ptp(pose.positions.reshape(-1, 3), axis=0).max(initial=0.0)) or 1.0
    largest, joints = 0.0, 0
    try:
        poses = zip(motion.skeleton.names, global_poses(read_text(file.path)), strict=False)
        for j, (joint, (name, x, R)) in enumerate(poses):
            joints += joint.startswith(name)  # of end sites one reader numbers names
            errors = [np.abs(x - pose.positions[:, j]) / extent]
            errors += [np.abs(R - rotation.to_matrix(pose.rotations[:, j]))]
            largest = np.max([largest, *(part.max(initial=0.0) for part in errors)])
    except Exception as error:
        raise UnreadableError(f"it ends in {type(error).__name__}: {error}") from None
    return float(largest) if joints == motion.skeleton.joint_count else np.nan


def _refusal(file: ModelFile) -> str:
    """Return the reason why the reference does not read a file, or ""."""
    try:
        if file.kind == BVH:
            bvh.read(file.path)
        else:
            RobotFile(file.path.name, file.path, file.root).read(mimic=False)
    except ValueError as error:
        return f"the reference: {_one_line(error, file)}"
    return ""


def _read(child: CallProcess, engine: str, file: ModelFile) -> FileReading:
    try:
        return child.call(compare, engine, file)
    except LostError as error:
        return FileReading(engine, CRASHED, why=str(error))


def _with_causes(
    child: CallProcess, file: ModelFile, readings: list[FileReading]
) -> tuple[FileReading, ...]:
    """Explain a difference of an engine if the other engine agrees with the reference.

    If MuJoCo refuses the file, a copy without settings is read: kinematics needs no settings.
    """
    outcomes = {reading.engine: reading.outcome for reading in readings}
    if file.kind == MJCF and (outcomes.get("Pinocchio"), outcomes["MuJoCo"]) == (DIFFERS, UNREAD):
        with tempfile.TemporaryDirectory() as folder:
            copy = _without_settings(file, Path(folder))
            outcomes["MuJoCo"] = _read(child, "MuJoCo", copy).outcome
    agreeing = [f"{e} agrees with the reference" for e, o in outcomes.items() if o == AGREES]

    def explained(reading: FileReading) -> FileReading:
        if reading.outcome != DIFFERS or not agreeing:
            return reading
        causes = known_deviations(file.path, reading.engine) or ["the file shows no known cause"]
        return reading._replace(outcome=DEVIATES, why="; ".join([*causes, *agreeing]))

    return tuple(map(explained, readings))


def _without_settings(file: ModelFile, folder: Path) -> ModelFile:
    """Return a copy, in a folder, of an MJCF file and its includes without `SETTINGS`."""
    top, main = file.root.resolve(), file.path.parent.resolve() / file.path.name
    for path in (main, *_includes(file)):
        root = xml_root(path)
        for element in [child for child in root if child.tag in SETTINGS]:
            root.remove(element)
        copy = folder / path.relative_to(top)
        copy.parent.mkdir(parents=True, exist_ok=True)
        ElementTree(root).write(copy)
    return ModelFile(folder / main.relative_to(top), MJCF, folder)


def _files_below(path: Path) -> list[Path]:
    """Return the regular files with known suffixes at or below a path, in order."""
    if not path.is_dir():
        return [path] if path.is_file() else []
    files = (Path(folder) / name for folder, _, names in os.walk(path) for name in names)
    return sorted(file for file in files if file.suffix.lower() in SUFFIXES and file.is_file())


def _includes(file: ModelFile) -> list[Path]:
    """Return the files included in an MJCF file, relative to its folder."""
    if file.kind != MJCF:
        return []
    with contextlib.suppress(ValueError):
        includes = xml_root(file.path).iter("include")
        return [(file.path.parent / tag.get("file", "")).resolve() for tag in includes]
    return []


def _one_line(error: object, file: ModelFile) -> str:
    """Return a message as a single line, without the folder of the file."""
    message = str(error).replace(f"{file.path}", file.path.name)
    return " ".join(message.split())[:300]
