"""The files: every URDF of example-robot-data, characters in MJCF of gymnasium and dm_control."""

import functools
import importlib.metadata
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.articulation import Articulation
from plumbob.reference.formats import mjcf, urdf
from plumbob.reference.model import Robot

from ..engines.file_kind import URDF, file_kind
from . import deviations

ROBOTS, CHARACTERS = "robots", "characters"
# dm_control needs labmaze, of which there are no wheels from Python 3.13 on.
PACKAGES = {ROBOTS: ("example-robot-data",), CHARACTERS: ("gymnasium", "dm_control")}
FOLDERS = {"example-robot-data": "cmeel.prefix/share/example-robot-data/robots"}
EXTRA = "robots"

_CATALOGUE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def _by_engine(table: str) -> Iterator[tuple[tuple[str, str], Any]]:
    for engine, entries in _CATALOGUE[table].items():
        for name, entry in entries.items():
            yield (engine, name), entry


# Reasons by the engine and the name of the model.
CAUSES = {
    key: "; ".join(getattr(deviations, cause) for cause in causes)
    for key, causes in _by_engine("deviating")
}
UNREAD: dict[tuple[str, str], str] = dict(_by_engine("unread"))
IMMOBILE: list[str] = _CATALOGUE["immobile"]


class RobotFile(NamedTuple):
    """A file with a robot or a character."""

    name: str  # its path below the folder of its package
    path: Path
    root: Path | None = None  # the folder that must contain all included files; None: the file's

    def read(self, *, mimic: bool = True) -> Robot:
        """Read the file with the reference; raise a ValueError if the file is invalid."""
        if file_kind(self.path) == URDF:
            return urdf.read(self.path, mimic=mimic)
        return mjcf.read(self.path, root=self.root)


@functools.cache
def models(family: str) -> tuple[RobotFile, ...]:
    """Return all models of a family in the installed packages."""
    roots = [root for package in PACKAGES[family] if (root := folder(package))]
    return tuple(RobotFile(name, root / name) for root in roots for name in _names(family, root))


def _names(family: str, root: Path) -> list[str]:
    if family == CHARACTERS:
        return [name for name in _CATALOGUE["characters"] if (root / name).exists()]
    return sorted(path.relative_to(root).as_posix() for path in root.rglob("*.urdf"))


def comparable(family: str, engine: str, *, moving: bool = False) -> list[RobotFile]:
    """Return the models with freedoms that an engine reads without known deviations.

    With `moving`, leave out models whose links only rotate in place.
    """
    excluded = {*IMMOBILE, *(name for by, name in (*CAUSES, *UNREAD) if by == engine)}
    if moving:
        excluded.update(_CATALOGUE["rotating_in_place"])
    return [model for model in models(family) if model.name not in excluded]


def folder(package: str) -> Path | None:
    """Return the folder of a package's files, None if not installed."""
    try:
        distribution = importlib.metadata.distribution(package)
    except importlib.metadata.PackageNotFoundError:
        return None
    return Path(str(distribution.locate_file(FOLDERS.get(package, package))))


def left_out() -> str:
    """Return a sentence on missing packages with files, "" if all are installed."""
    packages = [package for family in PACKAGES.values() for package in family]
    missing = [package for package in packages if folder(package) is None]
    if not missing:
        return ""
    return (
        f"Left out: the claims about the files of {' and '.join(missing)}, not installed here "
        f"(pip install -e '.[{EXTRA}]' brings what there are wheels of for this Python)"
    )


class JointSlices(NamedTuple):
    """A joint of the file with the slices of its coordinates and of its freedoms.

    A planar joint of a URDF has three of each: two slides and an angle.
    """

    name: str
    coordinates: slice
    freedoms: slice


def moving_joints(robot: Robot) -> list[JointSlices]:
    """Return the joints with coordinates of their own, in the order of their freedoms."""
    model = robot.articulation
    joints = []
    for name, index in robot.joints.items():
        if model.kinds[index] != "fixed" and index not in model.mimics:
            is_planar = model.names[index - 2 : index] == (f"{name} x", f"{name} y")
            q, v = model.coordinates_of(index), model.freedoms_of(index)
            q, v = (slice(part.start - 2 * is_planar, part.stop) for part in (q, v))
            joints.append(JointSlices(name, q, v))
    return sorted(joints, key=lambda joint: joint.freedoms.start)


def random_coordinates(model: Articulation, rng: np.random.Generator, count: int) -> FloatArray:
    """Return random coordinates within the limits, (count, coordinate).

    The coordinate of a joint whose limits are equal is up to 1 rad or m: some files state the
    limits 0 and 0 for joints without limits.
    """
    q = model.random(rng, count)
    equal_limits = [
        model.coordinates_of(int(joint)).start
        for joint in np.flatnonzero(model.lower == model.upper)
        if model.kinds[joint] in ("hinge", "slide") and joint not in model.mimics
    ]
    q[:, equal_limits] = rng.uniform(-1.0, 1.0, (count, len(equal_limits)))
    return q
