"""The files: every URDF of example-robot-data, characters in MJCF of gymnasium and dm_control."""

import functools
import importlib.metadata
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reference.arguments import FloatArray
from reference.articulation import Articulation
from reference.formats import mjcf, urdf
from reference.formats.robot import Robot

from ..engines.file_kind import URDF, file_kind
from .departures import CLASS_ANCHOR, OUTER_ROOT, TURNED_ROOT

ROBOTS, CHARACTERS = "robots", "characters"
# dm_control needs labmaze, of which there are no wheels from Python 3.13 on.
PACKAGES = {ROBOTS: ("example-robot-data",), CHARACTERS: ("gymnasium", "dm_control")}
EXTRA = "robots"

# Models with several bodies; those that only vary another are left out.
_CHARACTERS = (
    "envs/mujoco/assets/ant.xml",
    "envs/mujoco/assets/half_cheetah.xml",
    "envs/mujoco/assets/hopper.xml",
    "envs/mujoco/assets/humanoid.xml",
    "envs/mujoco/assets/pusher.xml",
    "envs/mujoco/assets/reacher.xml",
    "envs/mujoco/assets/swimmer.xml",
    "envs/mujoco/assets/walker2d.xml",
    "suite/humanoid.xml",
    "suite/dog.xml",
    "suite/humanoid_CMU.xml",
    "suite/quadruped.xml",
    "suite/walker.xml",
    "suite/cheetah.xml",
    "suite/hopper.xml",
    "suite/fish.xml",
    "suite/manipulator.xml",
    "suite/stacker.xml",
    "locomotion/walkers/assets/humanoid_CMU_V2019.xml",
    "locomotion/walkers/assets/humanoid_CMU_V2020.xml",
    "locomotion/walkers/assets/rodent.xml",
    "locomotion/walkers/assets/dog_v2/dog.xml",
    "locomotion/walkers/assets/fruitfly_v2/fruitfly.xml",
    "locomotion/walkers/assets/jumping_ball/jumping_ball_with_head.xml",
    "locomotion/soccer/assets/boxhead/boxhead.xml",
    "third_party/ant/ant.xml",
    "third_party/kinova/jaco_arm.xml",
    "mujoco/testing/assets/model_with_ball_joints.xml",
)
# What an engine is known to place elsewhere, and why; each cause is a test of its own.
CAUSES = {
    ("Pinocchio", "suite/dog.xml"): CLASS_ANCHOR,
    ("Pinocchio", "suite/humanoid_CMU.xml"): TURNED_ROOT,
    ("Pinocchio", "locomotion/walkers/assets/rodent.xml"): f"{OUTER_ROOT}; {CLASS_ANCHOR}",
    ("Pinocchio", "locomotion/walkers/assets/dog_v2/dog.xml"): CLASS_ANCHOR,
    ("Pinocchio", "third_party/ant/ant.xml"): OUTER_ROOT,
}
# What an engine is known not to read, and why.
UNREAD = {
    ("Pinocchio", "suite/quadruped.xml"): "height fields are refused",
    ("Pinocchio", "mujoco/testing/assets/model_with_ball_joints.xml"): "its bodies have no names",
}
# Files whose links turn and stay where they are: rotors on a rigid frame.
TURNING = ("iris_description/robots/iris.urdf",)
# Files that describe nothing that could move: a link alone, links fixed to each other, or none.
STILL = (
    "hector_description/robots/quadrotor_base.urdf",
    "iris_description/robots/iris_simple.urdf",
    "ur_description/urdf/ur3.urdf",
)


@dataclass(frozen=True)
class Model:
    """A file.

    Attributes:
        name: its path below the folder of its package.
        path: of the file.
        root: the folder that files which it includes must be in; its own if None.
    """

    name: str
    path: Path
    root: Path | None = None

    def read(self, *, mimic: bool = True) -> Robot:
        """Return what the reference makes of it.

        Raises:
            ValueError: if the file is wrong.
        """
        if file_kind(self.path) == URDF:
            return urdf.read(self.path, mimic=mimic)
        return mjcf.read(self.path, root=self.root)


@functools.cache
def models(family: str) -> tuple[Model, ...]:
    """Return all models of a family, those of packages that are not installed left out."""
    roots = [root for package in PACKAGES[family] if (root := folder(package))]
    return tuple(Model(name, root / name) for root in roots for name in _names(family, root))


def _names(family: str, root: Path) -> list[str]:
    if family == CHARACTERS:
        return [name for name in _CHARACTERS if (root / name).exists()]
    return sorted(path.relative_to(root).as_posix() for path in root.rglob("*.urdf"))


def comparable(family: str, engine: str, *, moving: bool = False) -> list[Model]:
    """Return the models that an engine reads, as far as we know, and reads right.

    Something turns in all of them; with `moving`, some link also moves from its place.
    """
    known = {name for by, name in (*CAUSES, *UNREAD) if by == engine}
    left_out = {*STILL, *known, *(TURNING if moving else ())}
    return [model for model in models(family) if model.name not in left_out]


def folder(package: str) -> Path | None:
    """Return where a package has its files, None if it is not installed."""
    try:
        found = importlib.metadata.distribution(package)
    except importlib.metadata.PackageNotFoundError:
        return None
    inside = {"example-robot-data": "cmeel.prefix/share/example-robot-data/robots"}
    return Path(str(found.locate_file(inside.get(package, package))))


def left_out() -> str:
    """Return a sentence on the packages with files that are not installed, "" if all are."""
    packages = [package for family in PACKAGES.values() for package in family]
    missing = [package for package in packages if folder(package) is None]
    if not missing:
        return ""
    return (
        f"Left out: the claims about the files of {' and '.join(missing)}, not installed here "
        f"(pip install -e '.[{EXTRA}]' brings what there are wheels of for this Python)"
    )


@dataclass(frozen=True)
class Slot:
    """A joint of the file with coordinates of its own: where they are, and its freedoms."""

    name: str
    coordinates: slice
    freedoms: slice


def slots(robot: Robot) -> list[Slot]:
    """Return the joints that have coordinates of their own, in the order of their freedoms."""
    model = robot.articulation
    found = [
        Slot(name, model.coordinates_of(j), model.freedoms_of(j))
        for name, j in robot.joints.items()
        if model.kinds[j] != "fixed" and j not in model.mimics
    ]
    return sorted(found, key=lambda slot: slot.freedoms.start)


def draw(model: Articulation, rng: np.random.Generator, count: int) -> FloatArray:
    """Return random coordinates, (count, coordinate), within the limits.

    Where these are equal a joint is moved by up to 1 rad or m all the same: some files say 0 to 0
    where there is no limit.
    """
    q = model.random(rng, count)
    held = [
        model.coordinates_of(int(j)).start
        for j in np.flatnonzero(model.lower == model.upper)
        if model.kinds[j] in ("hinge", "slide") and j not in model.mimics
    ]
    q[:, held] = rng.uniform(-1.0, 1.0, (count, len(held)))
    return q
