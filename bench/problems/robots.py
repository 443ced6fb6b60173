"""Robots: arms cut out of the URDFs of example-robot-data, one of our own making, a character.

An arm is the chain of links from a root to an effector. Everything that is not kinematics is
dropped from the file, and so are soft limits, which some readers take for the limits. Continuous
joints are limited to two revolutions in either direction, so that every solver has one number a
joint. All solvers and the evaluation read this same text.
"""

import functools
import importlib.metadata
import math
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray, choice

PACKAGE = "example-robot-data"
_FOLDER = "cmeel.prefix/share/example-robot-data/robots"
TWO_REVOLUTIONS = 4.0 * math.pi
# A limit counts as kept to this [rad]; some peers keep limits in single precision.
LIMIT_TOLERANCE = 1e-6


class AbsentError(Exception):
    """What is needed is not installed; the message says what."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot or character, as text that any reader understands.

    Attributes:
        name: of the robot.
        title: how it is written.
        text: URDF of a chain, or MJCF of a tree.
        root: the link or body that stands still.
        effectors: the links or bodies that are to reach a target.
        joints: the joints that move, in the order of the coordinates.
        lower: least coordinates [rad], (coordinate,); -inf for those of balls.
        upper: the greatest.
        balls: where the quaternions of balls, w first, begin among the coordinates.
        oriented: whether the effectors' rotations are wanted as well as their positions.
    """

    name: str
    title: str
    text: str
    root: str
    effectors: tuple[str, ...]
    joints: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    balls: tuple[int, ...] = ()
    oriented: bool = True

    @property
    def is_chain(self) -> bool:
        """Whether it is a chain of hinges, as URDF says it, with one effector."""
        return not self.balls and len(self.effectors) == 1

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return random coordinates, (count, coordinate): hinges even, balls rotated by about 1."""
        free = np.isfinite(self.lower)
        q = np.zeros((count, len(self.lower)))
        q[:, free] = rng.uniform(self.lower[free], self.upper[free], (count, int(free.sum())))
        for at in self.balls:
            half = 0.3 * rng.standard_normal((count, 3))
            angle = np.linalg.norm(half, axis=-1, keepdims=True)
            q[:, at : at + 1] = np.cos(angle)
            q[:, at + 1 : at + 4] = half * np.sinc(angle / np.pi)
        return q


class Link(NamedTuple):
    """A step along a chain: a fixed transform, then a rotation about an axis; None where fixed."""

    transform: FloatArray
    axis: FloatArray | None


# Title, file, root and effector.
_ARMS = {
    "panda": ("Franka Panda", "panda_description/urdf/panda.urdf", "panda_link0", "panda_link8"),
    "ur5": ("UR5", "ur_description/urdf/ur5_robot.urdf", "base_link", "tool0"),
    "xarm7": ("xArm7", "xarm_description/urdf/xarm7.urdf", "link_base", "link_eef"),
    "pr2": (
        *("PR2, right arm", "pr2_description/urdf/pr2.urdf"),
        *("torso_lift_link", "r_wrist_roll_link"),
    ),
}
# Heights of the joints above each other [m], axes and limits [°] of the KUKA LBR iiwa 14 R820, by
# the maker's data sheet; the flange is 0.126 m above the wrist.
_IIWA = (
    (0.1575, "0 0 1", 170), (0.2025, "0 1 0", 120), (0.2045, "0 0 1", 170), (0.2155, "0 -1 0", 120),
    (0.1845, "0 0 1", 170), (0.2155, "0 1 0", 120), (0.081, "0 0 1", 175), (0.045, None, 0),
)  # fmt: skip
IIWA, CHARACTER = "iiwa14", "character"
# What the tables are about; the iiwa stands beside a published table only.
ROBOTS = (*_ARMS, CHARACTER)
ALL = (*_ARMS, IIWA, CHARACTER)
_TITLES = {name: arm[0] for name, arm in _ARMS.items()}
_TITLES |= {IIWA: "KUKA iiwa14", CHARACTER: "character"}
# Robots of users, by name.
OWN: dict[str, Robot] = {}


def enter(own: Robot) -> None:
    """Let a user's robot be known by its name, in place of one entered before."""
    if OWN.get(own.name) is not own:
        OWN[own.name] = own
        robot.cache_clear()


def seed_of(name: str) -> int:
    """Return a number of a robot by which its targets are drawn."""
    return ALL.index(name) if name in ALL else zlib.crc32(name.encode(errors="replace"))


@functools.cache
def robot(name: str) -> Robot:
    """Return a robot by name.

    Raises:
        ValueError: if there is none of this name.
        AbsentError: if its file is not installed.
    """
    if name in OWN:
        return OWN[name]
    choice("robot", name, ALL)
    if name == CHARACTER:
        return _character()
    if name == IIWA:
        return chain_from(name, title(name), _iiwa(), "link_0", "link_8")
    _, file, root, effector = _ARMS[name]
    text = _folder().joinpath(file).read_text(encoding="utf-8")
    return chain_from(name, title(name), text, root, effector)


def is_installed(name: str) -> bool:
    """Return whether a robot's file is there."""
    try:
        return name not in _ARMS or _folder().joinpath(_ARMS[name][1]).exists()
    except AbsentError:
        return False


def title(name: str) -> str:
    """Return how a robot is written."""
    return OWN[name].title if name in OWN else _TITLES[name]


def links(chain: Robot) -> list[Link]:
    """Return the steps of an arm from its root to its effector."""
    steps = []
    for joint in ElementTree.fromstring(chain.text).findall("joint"):
        origin = joint.find("origin")
        transform = np.eye(4)
        if origin is not None:
            transform[:3, 3] = _numbers(origin.get("xyz", "0 0 0"))
            transform[:3, :3] = _from_roll_pitch_yaw(*_numbers(origin.get("rpy", "0 0 0")))
        axis = joint.find("axis")
        fixed = joint.get("type") == "fixed"
        along = _numbers("1 0 0" if axis is None else axis.get("xyz", "1 0 0"))
        steps.append(Link(transform, None if fixed else along / np.linalg.norm(along)))
    return steps


def _folder() -> Path:
    try:
        return Path(str(importlib.metadata.distribution(PACKAGE).locate_file(_FOLDER)))
    except importlib.metadata.PackageNotFoundError:
        raise AbsentError(f"{PACKAGE} is not installed") from None


def chain_from(name: str, title: str, text: str, root: str, effector: str) -> Robot:
    """Return the chain of hinges of a URDF from a root to an effector."""
    above = {
        _link(joint, "child"): joint for joint in ElementTree.fromstring(text).findall("joint")
    }
    joints: list[ElementTree.Element] = []
    link = effector
    while link != root:
        joints.insert(0, above[link])
        link = _link(above[link], "parent")
    moving = [joint for joint in joints if joint.get("type") != "fixed"]
    limits = np.array([_limits(joint) for joint in moving])
    names = tuple(joint.get("name", "") for joint in moving)
    text = _urdf(name, root, joints)
    return Robot(name, title, text, root, (effector,), names, *limits.T)


def _link(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    limit = joint.find("limit")
    if joint.get("type") == "continuous" or limit is None:
        return -TWO_REVOLUTIONS / 2, TWO_REVOLUTIONS / 2
    return float(limit.get("lower", "0")), float(limit.get("upper", "0"))


def _urdf(name: str, root: str, joints: Sequence[ElementTree.Element]) -> str:
    """Return a URDF of only these joints; every link has the mass that some readers insist on."""
    tree = ElementTree.Element("robot", name=name)
    for name in (root, *(_link(joint, "child") for joint in joints)):
        link = ElementTree.SubElement(tree, "link", name=name)
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


def _iiwa() -> str:
    parts = []
    for i, (height, axis, most) in enumerate(_IIWA):
        bounds = f'<limit lower="{-math.radians(most)!r}" upper="{math.radians(most)!r}"/>'
        parts.append(
            f'<joint name="joint_{i + 1}" type="{"revolute" if axis else "fixed"}">'
            f'<origin xyz="0 0 {height}"/><parent link="link_{i}"/><child link="link_{i + 1}"/>'
            + (f'<axis xyz="{axis}"/>{bounds}' if axis else "")
            + "</joint>"
        )
    return f"<robot>{''.join(parts)}</robot>"


# Name, parent, offset in the parent [m], and either the axis and limits [rad] of a hinge or nothing
# for a ball: a person of about 1.7 m, z up, facing x, from the pelvis, which stands still.
_BONES: tuple[tuple[str, str, str, tuple[str, float, float] | None], ...] = (
    ("lumbar", "", "0 0 0.1", None),
    ("thorax", "lumbar", "0 0 0.12", None),
    ("chest", "thorax", "0 0 0.13", None),
    ("neck", "chest", "0 0 0.18", None),
    ("head", "neck", "0 0 0.1", ("0 1 0", -0.6, 0.6)),
    ("left_clavicle", "chest", "0 0.03 0.15", ("1 0 0", -0.2, 0.6)),
    ("left_shoulder", "left_clavicle", "0 0.16 0", None),
    ("left_elbow", "left_shoulder", "0 0.28 0", ("0 0 1", 0.0, 2.5)),
    ("left_wrist", "left_elbow", "0 0.25 0", None),
    ("right_clavicle", "chest", "0 -0.03 0.15", ("1 0 0", -0.6, 0.2)),
    ("right_shoulder", "right_clavicle", "0 -0.16 0", None),
    ("right_elbow", "right_shoulder", "0 -0.28 0", ("0 0 1", -2.5, 0.0)),
    ("right_wrist", "right_elbow", "0 -0.25 0", None),
    ("left_hip", "", "0 0.09 0", None),
    ("left_knee", "left_hip", "0 0 -0.43", ("0 1 0", 0.0, 2.6)),
    ("left_ankle", "left_knee", "0 0 -0.42", None),
    ("left_toes", "left_ankle", "0.15 0 -0.05", ("0 1 0", -0.8, 0.3)),
    ("right_hip", "", "0 -0.09 0", None),
    ("right_knee", "right_hip", "0 0 -0.43", ("0 1 0", 0.0, 2.6)),
    ("right_ankle", "right_knee", "0 0 -0.42", None),
)
_PELVIS = "pelvis"
_HANDS = {"left_wrist": ("left_hand", "0 0.09 0"), "right_wrist": ("right_hand", "0 -0.09 0")}


def _character() -> Robot:
    lower: list[float] = []
    upper: list[float] = []
    balls = []
    for _, _, _, hinge in _BONES:
        if hinge is None:
            balls.append(len(lower))
        lower += [-math.inf] * 4 if hinge is None else [hinge[1]]
        upper += [math.inf] * 4 if hinge is None else [hinge[2]]
    hands, joints = (tuple(name for name, *_ in of) for of in (_HANDS.values(), _BONES))
    known = (CHARACTER, title(CHARACTER), _mjcf(), _PELVIS, hands, joints)
    return Robot(*known, np.array(lower), np.array(upper), tuple(balls), oriented=False)


def _mjcf() -> str:
    """Return the character as MJCF, angles in radians."""
    tree = ElementTree.Element("mujoco", model=CHARACTER)
    ElementTree.SubElement(tree, "compiler", angle="radian")
    # One body carries all others, though it stands still: some readers take one tree only.
    bodies = {"": _body(ElementTree.SubElement(tree, "worldbody"), _PELVIS, "0 0 0")}
    for name, parent, offset, hinge in _BONES:
        bodies[name] = _body(bodies[parent], name, offset)
        kind = {"type": "ball"} if hinge is None else {"type": "hinge", "axis": hinge[0]}
        if hinge is not None:
            kind |= {"range": f"{hinge[1]} {hinge[2]}", "limited": "true"}
        ElementTree.SubElement(bodies[name], "joint", {"name": name, **kind})
    for wrist, (hand, offset) in _HANDS.items():
        _body(bodies[wrist], hand, offset)
    return ElementTree.tostring(tree, encoding="unicode")


def _body(parent: ElementTree.Element, name: str, offset: str) -> ElementTree.Element:
    body = ElementTree.SubElement(parent, "body", name=name, pos=offset)
    # Some readers insist on a mass.
    ElementTree.SubElement(body, "inertial", mass="1", pos="0 0 0", diaginertia="0.01 0.01 0.01")
    return body


def _numbers(text: str) -> FloatArray:
    return np.array([float(word) for word in text.split()])


def _from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the rotation by roll about x, then pitch about y, then yaw about z, all fixed axes."""
    (cx, cy, cz), (sx, sy, sz) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx],
        ]
    )
