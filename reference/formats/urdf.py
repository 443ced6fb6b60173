"""The kinematic part of a URDF file.

Every link becomes the joint of the articulation that moves the link, with the link's name. The root
link is fixed to the world; a file with a moving base has a floating joint. Links precede their
descendants, and siblings keep the order of the file. A planar joint becomes two slides, named after
the joint with " x" and " y" added, and a hinge. A revolute or prismatic joint whose limit has
neither `lower` nor `upper` is locked at zero, with a FormatWarning. A mimic joint without these
numbers follows its leader anywhere. Links without an inertial have no mass. The quat_xyzw of an
origin is read in files of version 1.1 or 1.2; in files of version 1.0 it is ignored with a warning,
like in Pinocchio. Shapes, transmissions and safety controllers are ignored.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from .. import arguments
from ..arguments import LARGEST_COORDINATE, distinct_texts
from ..articulation import Articulation, Mimic
from ..model import Robot
from ..quaternion import IDENTITY, exponential, multiply, rotate
from . import xml
from .robot import (
    INFINITY,
    ORIGIN,
    Quaternion,
    RobotLink,
    X,
    Y,
    assemble,
    numbers_or,
    unit_quaternion,
    upright,
)
from .source import warn
from .xml import Element

KINDS = {
    "fixed": "fixed",
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
    "floating": "free",
    "planar": "hinge",
}
# Treatments of limits with lower > upper. MuJoCo drops such limits; Pinocchio keeps both, and no
# coordinate is within them.
CROSSED_LIMITS = ("unlimited", "ordered", "refused")
VERSIONS = ("1.0", "1.1", "1.2")  # of URDF; quaternions are read from the second on
LIMITED_TYPES = "revolute", "prismatic"
SCALAR_TYPES = (*LIMITED_TYPES, "continuous")


class _Joint(NamedTuple):
    name: str
    type: str
    parent: str
    child: str
    element: Element
    frame: Quaternion


def read(path: str | Path, *, mimic: bool = True, crossed_limits: str = "unlimited") -> Robot:
    """Return the robot described by a file, at home where its coordinates are zero.

    Args:
        path: of the file.
        mimic: whether mimic joints follow their leaders or, if False, move independently.
        crossed_limits: treatment of limits with lower > upper: "unlimited" drops the limits, like
            MuJoCo, "ordered" exchanges the two, both with a FormatWarning; "refused" raises.

    Raises:
        ValueError: naming file, line and element, if the file cannot be read or is not a URDF file
            with a single tree of links; naming the argument, if `crossed_limits` is unknown.
    """
    return _robot(xml.read(path), str(path), mimic, crossed_limits)


def parse(text: str, *, mimic: bool = True, crossed_limits: str = "unlimited") -> Robot:
    """Return the robot described by a text; see `read`."""
    return _robot(xml.parse(text, "URDF"), "URDF", mimic, crossed_limits)


def _robot(root: Element, origin: str, mimic: bool, crossed_limits: str) -> Robot:
    arguments.choice("crossed_limits", crossed_limits, CROSSED_LIMITS)
    if root.tag != "robot":
        raise root.error("expected a <robot>")
    for element in root.walk():
        if any(name.startswith("xacro:") for name in (element.tag, *element.attributes)):
            raise element.error("expected a URDF file, got xacro: run xacro first")
    joints: dict[str, _Joint] = {}
    for joint in (_joint(root, element) for element in root.children_named("joint")):
        if joint.name in joints:
            raise joint.element.error("expected a joint's name once, got it twice")
        joints[joint.name] = joint
    below = _joints_below(root, joints)
    base = _base(root, joints, below)
    follows = arguments.boolean("mimic", mimic)
    links, link_index, joint_index = [RobotLink(base, -1)], {base: 0}, {}
    waiting = below[base][::-1]
    while waiting:
        joint = waiting.pop()
        links += _links(joint, link_index[joint.parent], len(links), crossed_limits)
        link_index[joint.child] = joint_index[joint.name] = len(links) - 1
        waiting += below[joint.child][::-1]
    for joint in joints.values():
        if joint.child not in link_index:
            raise joint.element.error(f"expected a path to the root {base!r}, got a ring of links")
    for link in root.children_named("link"):
        j = link_index[link.word("name")]
        links[j] = _with_mass(links[j], link)
    mimics = _mimics(joints, joint_index) if follows else {}
    _complete_limits(joints, links, joint_index, mimics)
    robot = assemble(origin, links, joint_index, mimics)
    _warn_of_locked_leaders(origin, links, robot.articulation)
    return robot


def _complete_limits(
    joints: Mapping[str, _Joint],
    links: list[RobotLink],
    index: Mapping[str, int],
    mimics: Mapping[int | str, Mimic],
) -> None:
    """Leave mimic joints whose limit has no number to their leaders; warn of other such joints."""
    for joint in joints.values():
        limit = joint.element.single("limit") if joint.type in LIMITED_TYPES else None
        if limit is None or {"lower", "upper"} & limit.attributes.keys():
            continue
        j = index[joint.name]
        if j in mimics:
            links[j] = links[j]._replace(lower=-INFINITY, upper=INFINITY)
        else:
            warn(str(joint.element.error("expected lower or upper, got neither; locked at 0")))


def _warn_of_locked_leaders(origin: str, links: list[RobotLink], model: Articulation) -> None:
    """Warn where the limits of followers leave a leader, which has a range, a single value."""
    for leader in {mimic.leader: None for mimic in model.mimics.values()}:
        link, value = links[int(leader)], model.upper[int(leader)]
        if link.lower < link.upper and model.lower[int(leader)] == value:
            problem = "expected limits of followers that leave a range to their leader"
            warn(f"{origin}: {problem}, got {link.name!r} locked at {value:g}")


def _with_mass(link: RobotLink, element: Element) -> RobotLink:
    """Return the link with its mass and its centre; of several elements the first counts."""
    inertials = element.children_named("inertial")
    if not inertials:
        return link
    tags = inertials[0].children_named("mass"), inertials[0].children_named("origin")
    mass, origin = (tag[0] if tag else None for tag in tags)
    (weight,) = numbers_or(mass, "value", (math.nan,))
    return link._replace(mass=weight, centre=numbers_or(origin, "xyz", ORIGIN))


def _joint(root: Element, element: Element) -> _Joint:
    kind = element.choice("type", KINDS)
    parent, child = _link_of(element, "parent"), _link_of(element, "child")
    frame = _orientation(root, element.single("origin"))
    return _Joint(element.word("name"), kind, parent, child, element, frame)


def _orientation(root: Element, origin: Element | None) -> Quaternion:
    """Return the rotation of an <origin>: its rpy or, from version 1.1 on, its quat_xyzw."""
    if origin is None:
        return IDENTITY
    if "quat_xyzw" in origin.attributes:
        if root.choice("version", VERSIONS, "1.0") != VERSIONS[0]:
            if "rpy" in origin.attributes:
                raise origin.error("expected one orientation, got rpy and quat_xyzw")
            x, y, z, w = origin.numbers("quat_xyzw", (0.0, 0.0, 0.0, 0.0))
            return unit_quaternion(origin, "quat_xyzw", (w, x, y, z))
        warn(str(origin.error("expected version 1.1 for quat_xyzw, got 1.0; it is passed over")))
    roll, pitch, yaw = origin.numbers("rpy", ORIGIN)
    pitch_roll = multiply(exponential((0.0, pitch, 0.0)), exponential((roll, 0.0, 0.0)))
    return multiply(exponential((0.0, 0.0, yaw)), pitch_roll)


def _link_of(joint: Element, tag: str) -> str:
    end = joint.single(tag)
    if end is None:
        raise joint.error(f"expected a <{tag}>, got none")
    return end.word("link")


def _joints_below(root: Element, joints: Mapping[str, _Joint]) -> dict[str, list[_Joint]]:
    """Return the child joints of each link, in the order of the file."""
    below: dict[str, list[_Joint]] = {}
    for link in root.children_named("link"):
        if link.word("name") in below:
            raise link.error("expected a link's name once, got it twice")
        below[link.word("name")] = []
    for joint in joints.values():
        for name in (joint.parent, joint.child):
            if name not in below:
                raise joint.element.error(f"expected a <link> of that name, got none: {name!r:.80}")
        below[joint.parent].append(joint)
    return below


def _base(root: Element, joints: Mapping[str, _Joint], links: Mapping[str, list[_Joint]]) -> str:
    """Return the root: the only link that is no joint's child."""
    parent_joints: dict[str, str] = {}
    for joint in joints.values():
        if joint.child in parent_joints:
            raise joint.element.error(
                f"expected one joint to move link {joint.child!r:.80}, "
                f"got {parent_joints[joint.child]!r:.80} as well"
            )
        parent_joints[joint.child] = joint.name
    if not links:
        raise root.error("expected a <link>, got none")
    bases = [link for link in links if link not in parent_joints]
    if len(bases) != 1:
        got = f"{len(bases)}: {', '.join(map(repr, bases[:3])):.80}" if bases else "none"
        raise root.error(f"expected one link that no joint moves, the root, got {got}")
    return bases[0]


def _links(joint: _Joint, parent: int, number: int, crossed_limits: str) -> list[RobotLink]:
    """Return the links of a joint, numbered from `number` on."""
    origin = joint.element.single("origin")
    offset = origin.numbers("xyz", ORIGIN) if origin else ORIGIN
    if joint.type in ("fixed", "floating"):
        return [RobotLink(joint.child, parent, offset, joint.frame, KINDS[joint.type])]
    tag = joint.element.single("axis")
    axis = tag.numbers("xyz", X) if tag else X
    if axis == ORIGIN:
        raise joint.element.error("expected an <axis> that is not zero, got xyz='0 0 0'")
    if joint.type == "planar":
        plane = upright(axis)
        return [
            RobotLink(f"{joint.name} x", parent, offset, joint.frame, "slide", rotate(plane, X)),
            RobotLink(f"{joint.name} y", number, kind="slide", axis=rotate(plane, Y)),
            RobotLink(joint.child, number + 1, kind="hinge", axis=axis),
        ]
    limits = _limits(joint, crossed_limits)
    return [RobotLink(joint.child, parent, offset, joint.frame, KINDS[joint.type], axis, *limits)]


def _limits(joint: _Joint, crossed: str) -> tuple[float, float]:
    """Return the least and the greatest coordinate."""
    if joint.type == "continuous":
        return -INFINITY, INFINITY
    limit = joint.element.single("limit")
    if limit is None:
        raise joint.element.error(f"expected a <limit> of a {joint.type} joint, got none")
    (lower,), (upper,) = limit.limits("lower", (0.0,)), limit.limits("upper", (0.0,))
    if lower <= upper:
        return lower, upper
    bounds = distinct_texts(lower, upper)
    problem = "expected lower <= upper, got lower {}, upper {}".format(*bounds)
    if crossed == "refused" or max(abs(lower), abs(upper)) > LARGEST_COORDINATE:
        raise joint.element.error(problem)
    warn(str(joint.element.error(f"{problem}; read as {crossed}")))
    return (upper, lower) if crossed == "ordered" else (-INFINITY, INFINITY)


def _mimics(joints: Mapping[str, _Joint], index: Mapping[str, int]) -> dict[int | str, Mimic]:
    mimics: dict[int | str, Mimic] = {}
    for joint in joints.values():
        tag = joint.element.single("mimic")
        if tag is None or joint.type == "fixed":
            continue
        leader = joints.get(tag.word("joint"))
        for role, name in ((joint, joint.name), (leader, tag.word("joint"))):
            if role is None or role.type not in SCALAR_TYPES:
                got = role.type if role else "none of that name"
                raise joint.element.error(
                    f"expected a mimic and its leader to be one of "
                    f"{', '.join(SCALAR_TYPES)}, got {got} for {name!r:.80}"
                )
        (multiplier,), (shift,) = tag.numbers("multiplier", (1.0,)), tag.numbers("offset", (0.0,))
        mimics[index[joint.name]] = Mimic(index[tag.word("joint")], multiplier, shift)
    return mimics
