"""The files: every URDF of example-robot-data, and dm_control's characters in MJCF."""

import functools
import importlib.metadata
import importlib.util
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
PACKAGES = {ROBOTS: "example-robot-data", CHARACTERS: "dm_control"}
EXTRA = "robots"

# Models of dm_control with several bodies; those that only vary another are left out.
_CHARACTERS = (
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
        name: its path below the folder of its family.
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
    """Return all models of a family, none where its package is not installed."""
    root = folder(family)
    if root is None:
        return ()
    if family == CHARACTERS:
        names = [name for name in _CHARACTERS if (root / name).exists()]
    else:
        names = sorted(path.relative_to(root).as_posix() for path in root.rglob("*.urdf"))
    return tuple(Model(name, root / name) for name in names)


def comparable(family: str, engine: str, *, moving: bool = False) -> list[Model]:
    """Return the models that an engine reads, as far as we know, and reads right.

    Something turns in all of them; with `moving`, some link also moves from its place.
    """
    known = {name for by, name in (*CAUSES, *UNREAD) if by == engine}
    left_out = {*STILL, *known, *(TURNING if moving else ())}
    return [model for model in models(family) if model.name not in left_out]


@functools.cache
def folder(family: str) -> Path | None:
    """Return where a family's files are, None if its package is not installed."""
    if family == CHARACTERS:
        found = importlib.util.find_spec(PACKAGES[family])
        return Path(found.origin).parent if found and found.origin else None
    try:
        package = importlib.metadata.distribution(PACKAGES[family])
    except importlib.metadata.PackageNotFoundError:
        return None
    return Path(str(package.locate_file("cmeel.prefix/share/example-robot-data/robots")))


def left_out() -> str:
    """Return a sentence on the families whose files are not installed, "" if all are."""
    missing = {family: package for family, package in PACKAGES.items() if not models(family)}
    if not missing:
        return ""
    return (
        f"Left out: the claims about {' and '.join(missing)}, whose files are not installed "
        f"({', '.join(missing.values())}; pip install -e '.[{EXTRA}]' brings them)"
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
