"""The models: all URDFs of example-robot-data, and characters of dm_control in MJCF."""

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
from .deviations import CLASS_ANCHOR, OUTER_ROOT, ROTATED_ROOT

ROBOTS, CHARACTERS = "robots", "characters"
PACKAGES = {ROBOTS: "example-robot-data", CHARACTERS: "dm_control"}
EXTRA = "robots"

# Models of dm_control with several bodies, without variants of other models.
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
# Models that an engine is known to read differently, and why; a test reproduces each cause.
CAUSES = {
    ("Pinocchio", "suite/dog.xml"): CLASS_ANCHOR,
    ("Pinocchio", "suite/humanoid_CMU.xml"): ROTATED_ROOT,
    ("Pinocchio", "locomotion/walkers/assets/rodent.xml"): f"{OUTER_ROOT}; {CLASS_ANCHOR}",
    ("Pinocchio", "locomotion/walkers/assets/dog_v2/dog.xml"): CLASS_ANCHOR,
    ("Pinocchio", "third_party/ant/ant.xml"): OUTER_ROOT,
}
# Models that an engine is known not to read, and why.
UNREAD = {
    ("Pinocchio", "suite/quadruped.xml"): "height fields are refused",
    ("Pinocchio", "mujoco/testing/assets/model_with_ball_joints.xml"): "its bodies have no names",
}
# Models whose links rotate but do not change position: rotors on a rigid frame.
ROTATING_IN_PLACE = ("iris_description/robots/iris.urdf",)
# Models without movable joints.
IMMOBILE = (
    "hector_description/robots/quadrotor_base.urdf",
    "iris_description/robots/iris_simple.urdf",
    "ur_description/urdf/ur3.urdf",
)


@dataclass(frozen=True)
class Model:
    """A file with a robot or a character.

    Attributes:
        name: its path relative to the folder of its family.
        path: of the file.
        root: the folder that must contain all included files; that of the file if None.
    """

    name: str
    path: Path
    root: Path | None = None

    def read(self, *, mimic: bool = True) -> Robot:
        """Read the file with the reference.

        Raises:
            ValueError: if the file is invalid.
        """
        if file_kind(self.path) == URDF:
            return urdf.read(self.path, mimic=mimic)
        return mjcf.read(self.path, root=self.root)


@functools.cache
def models(family: str) -> tuple[Model, ...]:
    """Return all models of a family, none if its package is not installed."""
    root = folder(family)
    if root is None:
        return ()
    if family == CHARACTERS:
        names = [name for name in _CHARACTERS if (root / name).exists()]
    else:
        names = sorted(path.relative_to(root).as_posix() for path in root.rglob("*.urdf"))
    return tuple(Model(name, root / name) for name in names)


def comparable(family: str, engine: str, *, moving: bool = False) -> list[Model]:
    """Return the models that an engine reads without known deviations and that have freedoms.

    With `moving`, leave out models whose links only rotate in place.
    """
    known = {name for by, name in (*CAUSES, *UNREAD) if by == engine}
    left_out = {*IMMOBILE, *known, *(ROTATING_IN_PLACE if moving else ())}
    return [model for model in models(family) if model.name not in left_out]


@functools.cache
def folder(family: str) -> Path | None:
    """Return the folder of a family's files, None if its package is not installed."""
    if family == CHARACTERS:
        found = importlib.util.find_spec(PACKAGES[family])
        return Path(found.origin).parent if found and found.origin else None
    try:
        package = importlib.metadata.distribution(PACKAGES[family])
    except importlib.metadata.PackageNotFoundError:
        return None
    return Path(str(package.locate_file("cmeel.prefix/share/example-robot-data/robots")))


def left_out() -> str:
    """Return a sentence about families whose files are not installed, "" if there are none."""
    missing = {family: package for family, package in PACKAGES.items() if not models(family)}
    if not missing:
        return ""
    return (
        f"Left out: the claims about {' and '.join(missing)}, whose files are not installed "
        f"({', '.join(missing.values())}; pip install -e '.[{EXTRA}]' brings them)"
    )


@dataclass(frozen=True)
class Slot:
    """A joint of the file with its own coordinates: the slices of these and of its freedoms."""

    name: str
    coordinates: slice
    freedoms: slice


def slots(robot: Robot) -> list[Slot]:
    """Return the joints with their own coordinates, in the order of their freedoms."""
    model = robot.articulation
    found = [
        Slot(name, model.coordinates_of(j), model.freedoms_of(j))
        for name, j in robot.joints.items()
        if model.kinds[j] != "fixed" and j not in model.mimics
    ]
    return sorted(found, key=lambda slot: slot.freedoms.start)


def random_coordinates(model: Articulation, rng: np.random.Generator, count: int) -> FloatArray:
    """Return random coordinates within the limits, (count, coordinate).

    The coordinate of a joint whose limits are equal is up to 1 rad or m: some files state the
    limits 0 and 0 for joints without limits.
    """
    q = model.random(rng, count)
    equal_limits = [
        model.coordinates_of(int(j)).start
        for j in np.flatnonzero(model.lower == model.upper)
        if model.kinds[j] in ("hinge", "slide") and j not in model.mimics
    ]
    q[:, equal_limits] = rng.uniform(-1.0, 1.0, (count, len(equal_limits)))
    return q
