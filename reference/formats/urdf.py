"""The kinematic part of a URDF file.

Every link is a joint of the articulation, of the link's name: the one that moves it. The root is
fixed to the world; where a base moves, the file says so with a floating joint. Links come before
what hangs on them, and siblings in the order of the file. A planar joint becomes two slides and a
hinge, the slides named after the joint, with " x" and " y" added. Nothing else of a file is read:
no masses, shapes, transmissions or safety controllers.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from .. import arguments
from ..arguments import LARGEST_COORDINATE
from ..articulation import Mimic
from ..quaternion import exponential, multiply, rotate
from . import xml
from .robot import INFINITY, ORIGIN, Link, Robot, Vector, assemble, upright
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
# What becomes of limits whose lower one is above the upper one. MuJoCo reads none; Pinocchio keeps
# both as they are, so that no coordinate is within them.
CROSSED_LIMITS = ("unlimited", "ordered", "refused")
MOVED_BY_ONE_NUMBER = ("revolute", "continuous", "prismatic")
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


class _Joint(NamedTuple):
    name: str
    type: str
    parent: str
    child: str
    element: Element


def read(path: str | Path, *, mimic: bool = True, crossed_limits: str = "unlimited") -> Robot:
    """Return the robot that a file describes, at home where its coordinates are zero.

    Args:
        path: of the file.
        mimic: whether mimic joints move with their leaders; if False, by themselves.
        crossed_limits: what becomes of limits whose lower one is above the upper one:
            "unlimited" reads none, as MuJoCo does, "ordered" exchanges them, both with a
            FormatWarning; "refused" raises. (Pinocchio keeps them: nothing is within them then.)

    Raises:
        ValueError: naming file, line and element, if it cannot be read or is not a URDF file of one
            tree of links; naming the argument, if `crossed_limits` is none of these.
    """
    arguments.choice("crossed_limits", crossed_limits, CROSSED_LIMITS)
    return _robot(xml.read(path), str(path), mimic, crossed_limits)


def parse(text: str, *, mimic: bool = True, crossed_limits: str = "unlimited") -> Robot:
    """Return the robot that a text describes; see `read`.

    Raises:
        ValueError: as for `read`.
    """
    arguments.choice("crossed_limits", crossed_limits, CROSSED_LIMITS)
    return _robot(xml.parse(text, "URDF"), "URDF", mimic, crossed_limits)


def _robot(root: Element, origin: str, mimic: bool, crossed_limits: str) -> Robot:
    if root.tag != "robot":
        raise root.error("expected a <robot>")
    _check_expanded(root)
    joints = _distinct([_joint(element) for element in root.named("joint")])
    below = _joints_below(root, joints)
    base = _base(root, joints, below)
    follows = arguments.boolean("mimic", mimic)
    links, at, carriers = [Link(base, -1)], {base: 0}, {}
    waiting = below[base][::-1]
    while waiting:
        joint = waiting.pop()
        links += _links(joint, at[joint.parent], len(links), crossed_limits)
        at[joint.child] = carriers[joint.name] = len(links) - 1
        waiting += below[joint.child][::-1]
    for joint in joints.values():
        if joint.child not in at:
            raise joint.element.error(f"expected a way to the root {base!r}, got a ring of links")
    return assemble(origin, links, carriers, _mimics(joints, carriers) if follows else {})


def _check_expanded(root: Element) -> None:
    """Refuse what is left of xacro's macros, wherever it stands."""
    waiting = [root]
    while waiting:
        element = waiting.pop()
        if any(name.startswith("xacro:") for name in (element.tag, *element.attributes)):
            raise element.error("expected a URDF file, got xacro: run xacro first")
        waiting += reversed(element.children)


def _joint(element: Element) -> _Joint:
    kind = element.word("type")
    if kind not in KINDS:
        raise element.error(f"expected one of {', '.join(KINDS)} for a type, got {kind!r:.80}")
    parent, child = _link_of(element, "parent"), _link_of(element, "child")
    return _Joint(element.word("name"), kind, parent, child, element)


def _link_of(joint: Element, tag: str) -> str:
    end = joint.single(tag)
    if end is None:
        raise joint.error(f"expected a <{tag}>, got none")
    return end.word("link")


def _distinct(joints: list[_Joint]) -> dict[str, _Joint]:
    named: dict[str, _Joint] = {}
    for joint in joints:
        if joint.name in named:
            raise joint.element.error("expected a joint's name once, got it twice")
        named[joint.name] = joint
    return named


def _joints_below(root: Element, joints: Mapping[str, _Joint]) -> dict[str, list[_Joint]]:
    """Return the joints that hang on each link, in the order of the file."""
    below: dict[str, list[_Joint]] = {}
    for link in root.named("link"):
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
    """Return the one link that no joint moves."""
    movers: dict[str, str] = {}
    for joint in joints.values():
        if joint.child in movers:
            raise joint.element.error(
                f"expected one joint to move link {joint.child!r:.80}, "
                f"got {movers[joint.child]!r:.80} as well"
            )
        movers[joint.child] = joint.name
    if not links:
        raise root.error("expected a <link>, got none")
    bases = [link for link in links if link not in movers]
    if len(bases) != 1:
        came = f"{len(bases)}: {', '.join(map(repr, bases[:3])):.80}" if bases else "none"
        raise root.error(f"expected one link that no joint moves, the root, got {came}")
    return bases[0]


def _links(joint: _Joint, parent: int, number: int, crossed_limits: str) -> list[Link]:
    """Return what a joint becomes, in a list that begins with that number."""
    origin = joint.element.single("origin")
    offset = origin.numbers("xyz", ORIGIN) if origin else ORIGIN
    roll, pitch, yaw = origin.numbers("rpy", ORIGIN) if origin else ORIGIN
    turned = multiply(exponential((0.0, pitch, 0.0)), exponential((roll, 0.0, 0.0)))
    frame = multiply(exponential((0.0, 0.0, yaw)), turned)
    if joint.type in ("fixed", "floating"):
        return [Link(joint.child, parent, offset, frame, KINDS[joint.type])]
    axis = _axis(joint.element)
    if joint.type == "planar":
        plane = upright(axis)
        return [
            Link(f"{joint.name} x", parent, offset, frame, "slide", rotate(plane, X)),
            Link(f"{joint.name} y", number, kind="slide", axis=rotate(plane, Y)),
            Link(joint.child, number + 1, kind="hinge", axis=axis),
        ]
    limits = _limits(joint, crossed_limits)
    return [Link(joint.child, parent, offset, frame, KINDS[joint.type], axis, *limits)]


def _axis(element: Element) -> Vector:
    given = element.single("axis")
    axis = given.numbers("xyz", X) if given else X
    if axis == ORIGIN:
        raise element.error("expected an <axis> that is not zero, got xyz='0 0 0'")
    return axis


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
    problem = f"expected lower <= upper, got lower {lower:g}, upper {upper:g}"
    if crossed == "refused" or max(abs(lower), abs(upper)) > LARGEST_COORDINATE:
        raise joint.element.error(problem)
    warn(str(joint.element.error(f"{problem}; read as {crossed}")))
    return (upper, lower) if crossed == "ordered" else (-INFINITY, INFINITY)


def _mimics(joints: Mapping[str, _Joint], carriers: Mapping[str, int]) -> dict[int | str, Mimic]:
    mimics: dict[int | str, Mimic] = {}
    for joint in joints.values():
        tag = joint.element.single("mimic")
        if tag is None or joint.type == "fixed":
            continue
        leader = joints.get(tag.word("joint"))
        for one, name in ((joint, joint.name), (leader, tag.word("joint"))):
            if one is None or one.type not in MOVED_BY_ONE_NUMBER:
                came = one.type if one else "none of that name"
                raise joint.element.error(
                    f"expected a mimic and its leader to be one of "
                    f"{', '.join(MOVED_BY_ONE_NUMBER)}, got {came} for {name!r:.80}"
                )
        (multiplier,), (shift,) = tag.numbers("multiplier", (1.0,)), tag.numbers("offset", (0.0,))
        mimics[carriers[joint.name]] = Mimic(carriers[tag.word("joint")], multiplier, shift)
    return _through_chains(mimics)


def _through_chains(mimics: dict[int | str, Mimic]) -> dict[int | str, Mimic]:
    """Return mimics of leaders that follow none themselves, each chain walked once."""
    through: dict[int | str, Mimic] = {}
    for joint in mimics:
        chain = []
        while joint in mimics and joint not in through:
            chain.append(joint)
            through[joint] = mimics[joint]
            joint = mimics[joint].leader
        for follower in reversed(chain):
            leader, multiplier, shift = mimics[follower]
            first, factor, further = through.get(leader, Mimic(leader))
            through[follower] = Mimic(first, multiplier * factor, multiplier * further + shift)
    return through
