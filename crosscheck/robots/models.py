"""The files: every URDF of example-robot-data, characters in MJCF of gymnasium and dm_control."""

import functools
import importlib.metadata
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.articulation import Articulation
from plumbob.reference.formats import mjcf, urdf
from plumbob.reference.formats.robot import Robot

from ..engines.file_kind import URDF, file_kind
from .deviations import CLASS_ANCHOR, OUTER_ROOT, ROTATED_ROOT

ROBOTS, CHARACTERS = "robots", "characters"
# dm_control needs labmaze, of which there are no wheels from Python 3.13 on.
PACKAGES = {ROBOTS: ("example-robot-data",), CHARACTERS: ("gymnasium", "dm_control")}
EXTRA = "robots"

# Models with several bodies; those that only vary another are left out.
_CHARACTERS = """
    envs/mujoco/assets/ant.xml envs/mujoco/assets/half_cheetah.xml envs/mujoco/assets/hopper.xml
    envs/mujoco/assets/humanoid.xml envs/mujoco/assets/pusher.xml envs/mujoco/assets/reacher.xml
    envs/mujoco/assets/swimmer.xml envs/mujoco/assets/walker2d.xml suite/humanoid.xml
    suite/dog.xml suite/humanoid_CMU.xml suite/quadruped.xml suite/walker.xml suite/cheetah.xml
    suite/hopper.xml suite/fish.xml suite/manipulator.xml suite/stacker.xml
    locomotion/walkers/assets/humanoid_CMU_V2019.xml
    locomotion/walkers/assets/humanoid_CMU_V2020.xml locomotion/walkers/assets/rodent.xml
    locomotion/walkers/assets/dog_v2/dog.xml locomotion/walkers/assets/fruitfly_v2/fruitfly.xml
    locomotion/walkers/assets/jumping_ball/jumping_ball_with_head.xml
    locomotion/soccer/assets/boxhead/boxhead.xml third_party/ant/ant.xml
    third_party/kinova/jaco_arm.xml mujoco/testing/assets/model_with_ball_joints.xml
"""
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
    """A file with a robot or a character."""

    name: str  # its path below the folder of its package
    path: Path
    root: Path | None = None  # the folder that must contain all included files; None: the file's

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
    """Return all models of a family, those of packages that are not installed left out."""
    roots = [root for package in PACKAGES[family] if (root := folder(package))]
    return tuple(Model(name, root / name) for root in roots for name in _names(family, root))


def _names(family: str, root: Path) -> list[str]:
    if family == CHARACTERS:
        return [name for name in _CHARACTERS.split() if (root / name).exists()]
    return sorted(path.relative_to(root).as_posix() for path in root.rglob("*.urdf"))


def comparable(family: str, engine: str, *, moving: bool = False) -> list[Model]:
    """Return the models that an engine reads without known deviations and that have freedoms.

    With `moving`, leave out models whose links only rotate in place.
    """
    known = {name for by, name in (*CAUSES, *UNREAD) if by == engine}
    left_out = {*IMMOBILE, *known, *(ROTATING_IN_PLACE if moving else ())}
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
