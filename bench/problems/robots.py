"""Robots: arms for tuning solvers, arms held out from tuning, and a character (`robots.toml`).

An arm is the chain of links from a root to an effector. Everything that is not kinematics is
dropped from the file, and so are soft limits, which some readers take for the limits. Continuous
joints are limited to two revolutions in either direction, to give every solver a number for each
joint. All solvers and the evaluation read this same text.
"""

import contextlib
import functools
import importlib.metadata
import math
import tempfile
import tomllib
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray, choice
from plumbob.reference.formats import urdf

PACKAGE = "example-robot-data"
_FOLDER = "cmeel.prefix/share/example-robot-data/robots"
TWO_REVOLUTIONS = 4.0 * math.pi
# The tasks of records: targets within a robot's reach, or out of reach.
REACHABLE, UNREACHABLE = "reachable", "unreachable"
# A limit counts as kept to this [rad]; some peers keep limits in single precision.
LIMIT_TOLERANCE = 1e-6


class AbsentError(Exception):
    """A package is not installed; the message names the package."""


class UnableError(ValueError):
    """A solver cannot take a robot by design; the message says why."""


@dataclass(frozen=True, eq=False)
class BenchRobot:
    """A robot or character as the text of a model file, which every peer reads in its own way."""

    name: str  # of the robot
    title: str  # how it is written
    text: str  # URDF of a chain, or MJCF of a tree
    root: str  # the link or body that stands still
    effectors: tuple[str, ...]  # the links or bodies that have targets
    joints: tuple[str, ...]  # the joints that move, in the order of the coordinates
    lower: FloatArray  # the lower limits of the coordinates [rad], (coordinate,); -inf for balls
    upper: FloatArray  # the upper limits
    # where the quaternions of balls, w first, begin among the coordinates
    balls: tuple[int, ...] = ()
    oriented: bool = True  # whether the effectors have target rotations as well as target positions

    @property
    def is_chain(self) -> bool:
        """Whether the robot is a chain of hinges, as in URDF, with a single effector."""
        return not self.balls and len(self.effectors) == 1

    def require_chain(self) -> None:
        """Refuse a robot other than a chain of hinges with a single effector.

        Raises:
            UnableError: if the robot is anything else.
        """
        if not self.is_chain:
            raise UnableError("takes one chain of hinges only")

    def check_order(self, engine: str, names: Sequence[str]) -> None:
        """Check the order of joints in an engine against the robot's.

        Raises:
            ValueError: if the orders differ.
        """
        if tuple(names) != self.joints:
            raise ValueError(f"{engine} orders the joints as {', '.join(names)}")

    @contextlib.contextmanager
    def file(self) -> Iterator[str]:
        """Yield the path of a file with the text, for engines that read files only."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "robot.urdf" if self.is_chain else "robot.xml")
            file.write_text(self.text, encoding="utf-8")
            yield str(file)

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return random coordinates, (count, coordinate): hinges even, balls rotated by about 1."""
        is_hinge = np.isfinite(self.lower)
        lower, upper = self.lower[is_hinge], self.upper[is_hinge]
        q = np.zeros((count, len(self.lower)))
        q[:, is_hinge] = rng.uniform(lower, upper, (count, len(lower)))
        for i in self.balls:
            q[:, i : i + 4] = rotation.exponential(0.6 * rng.standard_normal((count, 3)))
        return q


class Link(NamedTuple):
    """A step along a chain: a fixed transform, then a rotation about an axis; None where fixed."""

    transform: FloatArray
    axis: FloatArray | None


_DATA: dict[str, Any] = tomllib.loads(
    Path(__file__).with_name("robots.toml").read_text(encoding="utf-8")
)
# Arms on which settings of solvers are chosen, and arms held out from tuning.
TUNING, HELD_OUT = tuple(_DATA["tuning"]), tuple(_DATA["held_out"])
CHARACTER = "character"
ROBOTS = (*TUNING, *HELD_OUT, CHARACTER)
_ARMS: dict[str, dict[str, Any]] = {**_DATA["tuning"], **_DATA["held_out"]}
# Robots of users, by name.
OWN: dict[str, BenchRobot] = {}


def enter(own: BenchRobot) -> None:
    """Register a user's robot by its name, in place of an earlier robot."""
    if OWN.get(own.name) is not own:
        OWN[own.name] = own
        robot.cache_clear()


def seed_of(name: str) -> int:
    """Return the seed of a robot's targets."""
    return zlib.crc32(name.encode(errors="replace"))


def group_of(name: str) -> str:
    """Return the group of a robot, which is never averaged with another group."""
    lists = {"tuning": TUNING, "held out": HELD_OUT, CHARACTER: (CHARACTER,)}
    return next((group for group, names in lists.items() if name in names), "yours")


@functools.cache
def robot(name: str) -> BenchRobot:
    """Return a robot by name.

    Raises:
        ValueError: if there is none of this name.
        AbsentError: if its file is not installed.
    """
    if name in OWN:
        return OWN[name]
    choice("robot", name, ROBOTS)
    if name == CHARACTER:
        return _character()
    arm = _ARMS[name]
    if "joints" in arm:
        text = _from_dimensions(arm["joints"])
        return chain_from(name, arm["title"], text, "link_0", f"link_{len(arm['joints'])}")
    text = _folder().joinpath(arm["file"]).read_text(encoding="utf-8")
    return chain_from(name, arm["title"], text, arm["root"], arm["effector"])


def is_installed(name: str) -> bool:
    """Return whether a robot's file is there."""
    try:
        file = _ARMS.get(name, {}).get("file")
        return file is None or _folder().joinpath(file).exists()
    except AbsentError:
        return False


def title(name: str) -> str:
    """Return how a robot is written."""
    return OWN[name].title if name in OWN else str({**_DATA, **_ARMS}[name]["title"])


def _folder() -> Path:
    try:
        return Path(str(importlib.metadata.distribution(PACKAGE).locate_file(_FOLDER)))
    except importlib.metadata.PackageNotFoundError:
        raise AbsentError(f"{PACKAGE} is not installed") from None


def links(chain: BenchRobot) -> list[Link]:
    """Return the steps of an arm from its root to its effector, the root's own first."""
    model = urdf.parse(chain.text).articulation
    transforms = np.tile(np.eye(4), (model.joint_count, 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = (
        rotation.to_matrix(model.frames),
        model.skeleton.offsets,
    )
    axes = (None if kind == "fixed" else a for kind, a in zip(model.kinds, model.axes, strict=True))
    return list(map(Link, transforms, axes))


def chain_from(name: str, title: str, text: str, root: str, effector: str) -> BenchRobot:
    """Return the chain of hinges of a URDF from a root to an effector."""
    above = {
        _link(joint, "child"): joint for joint in ElementTree.fromstring(text).findall("joint")
    }
    joints: list[ElementTree.Element] = []
    link = effector
    while link != root:
        joints.insert(0, above[link])
        link = _link(above[link], "parent")
    return chain_of(name, title, root, joints)


def chain_of(name: str, title: str, root: str, joints: Sequence[ElementTree.Element]) -> BenchRobot:
    """Return the chain of these joints of a URDF, in order from a root to the effector."""
    moving = [joint for joint in joints if joint.get("type") != "fixed"]
    lower, upper = np.array([_limits(joint) for joint in moving]).T
    names = tuple(joint.get("name", "") for joint in moving)
    effectors = (_link(joints[-1], "child"),)
    return BenchRobot(name, title, _urdf(name, root, joints), root, effectors, names, lower, upper)


def _link(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return -TWO_REVOLUTIONS / 2, TWO_REVOLUTIONS / 2
    return float(limit.get("lower", "0")), float(limit.get("upper", "0"))


def _urdf(name: str, root: str, joints: Sequence[ElementTree.Element]) -> str:
    """Return a URDF of only these joints; every link has a mass, as some readers require."""
    tree = ElementTree.Element("robot", name=name)
    for link_name in (root, *(_link(joint, "child") for joint in joints)):
        link = ElementTree.SubElement(tree, "link", name=link_name)
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "mass", value="1")
        moments = {f"i{a}{b}": str(int(a == b)) for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")}
        ElementTree.SubElement(inertial, "inertia", moments)
    for joint in joints:
        kind = "fixed" if joint.get("type") == "fixed" else "revolute"
        part = ElementTree.SubElement(tree, "joint", name=joint.get("name", ""), type=kind)
        for tag in ("origin", "parent", "child", "axis"):
            part.extend(joint.findall(tag))
        if kind != "fixed":
            lower, upper = _limits(joint)
            bounds = {"lower": repr(lower), "upper": repr(upper), "effort": "100", "velocity": "10"}
            ElementTree.SubElement(part, "limit", bounds)
    return ElementTree.tostring(tree, encoding="unicode")


def _from_dimensions(joints: list[list[Any]]) -> str:
    """Return the URDF of joints of `robots.toml`."""
    parts = []
    for i, (offset, *hinge) in enumerate(joints):
        limits = ""
        if hinge:
            axis, lower, upper = hinge[0], *map(math.radians, hinge[1:])
            limits = f'<axis xyz="{axis}"/><limit lower="{lower!r}" upper="{upper!r}"/>'
        parts.append(
            f'<joint name="joint_{i + 1}" type="{"revolute" if hinge else "fixed"}">'
            f'<origin xyz="{offset}"/><parent link="link_{i}"/><child link="link_{i + 1}"/>'
            f"{limits}</joint>"
        )
    return f"<robot>{''.join(parts)}</robot>"


def _character() -> BenchRobot:
    """Return the character as MJCF, angles in radians."""
    tree = ElementTree.Element("mujoco", model=CHARACTER)
    ElementTree.SubElement(tree, "compiler", angle="radian")
    # A fixed body carries all others: some readers take a single tree only.
    bodies = {"": _body(ElementTree.SubElement(tree, "worldbody"), "pelvis", "0 0 0")}
    limits: list[tuple[float, ...]] = []
    balls, bones, hands = [], _DATA[CHARACTER]["bones"], _DATA[CHARACTER]["hands"]
    for name, parent, offset, *hinge in bones:
        bodies[name] = _body(bodies[parent], name, offset)
        joint = {"name": name, "type": "hinge" if hinge else "ball"}
        if hinge:
            axis, *limit = hinge
            joint |= {"axis": axis, "range": "{} {}".format(*limit), "limited": "true"}
            limits.append(tuple(limit))
        else:
            balls.append(len(limits))
            limits += [(-math.inf, math.inf)] * 4
        ElementTree.SubElement(bodies[name], "joint", joint)
    for hand, wrist, offset in hands:
        _body(bodies[wrist], hand, offset)
    effectors, joints = tuple(hand for hand, *_ in hands), tuple(name for name, *_ in bones)
    text = ElementTree.tostring(tree, encoding="unicode")
    names = (CHARACTER, title(CHARACTER), text, "pelvis", effectors, joints)
    lower, upper = np.array(limits).T
    return BenchRobot(*names, lower, upper, tuple(balls), oriented=False)


def _body(parent: ElementTree.Element, name: str, offset: str) -> ElementTree.Element:
    body = ElementTree.SubElement(parent, "body", name=name, pos=offset)
    # Some readers require a mass.
    ElementTree.SubElement(body, "inertial", mass="1", pos="0 0 0", diaginertia="0.01 0.01 0.01")
    return body
