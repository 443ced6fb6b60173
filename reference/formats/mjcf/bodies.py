"""The tree of bodies of an MJCF file, read into an articulation."""

from typing import NamedTuple

import numpy as np

from ...arguments import distinct_texts, frozen
from ...quaternion import exponential, rotate, scale, subtract
from ..robot import INFINITY, ORIGIN, Robot, RobotLink, Vector, assemble
from ..source import warn
from ..xml import Element
from .settings import CompilerSettings, Transform, direction, one_of, settings

KINDS = ("hinge", "slide", "ball", "free")
GENERATORS = ("replicate", "attach", "composite", "flexcomp")
MOVING = ("body", "joint", "freejoint", *GENERATORS[1:])
Z = (0.0, 0.0, 1.0)


class _Part(NamedTuple):
    """An element of a body, its frame in the body, and its default class."""

    element: Element
    frame: Transform
    inherited: str


class _Joint(NamedTuple):
    label: str
    kind: str
    anchor: Vector = ORIGIN
    axis: Vector = Z
    lower: float = -INFINITY
    upper: float = INFINITY
    cone: float = INFINITY
    ref: float = 0.0


def robot(root: Element, origin: str) -> Robot:
    """Return the robot or character that a <mujoco> element describes."""
    if root.tag != "mujoco":
        raise root.error("expected a <mujoco>")
    tree = _Tree(settings(root))
    for world in root.children_named("worldbody"):
        tree.add_world(world)
    robot = assemble(origin, tree.links, tree.joints)
    home = np.array(robot.home)
    for joint, coordinates in tree.homes.items():
        home[robot.articulation.coordinates_of(joint)] = coordinates
    return robot._replace(home=frozen(home))


class _Tree:
    """The links read so far, the file's joints by name, and the home coordinates of each."""

    def __init__(self, settings: CompilerSettings) -> None:
        self.settings = settings
        self.links = [RobotLink("world", -1)]
        self.bodies = {"world"}
        self.joints: dict[str, int] = {}
        self.homes: dict[int, tuple[float, ...]] = {}

    def add_world(self, world: Element) -> None:
        """Add all bodies of a <worldbody>."""
        joints, bodies = self.parts(_Part(world, Transform(), "main"))
        if joints:
            raise joints[0].element.error("expected no joint in the world, which cannot move")
        waiting = [(body, 0) for body in reversed(bodies)]
        while waiting:
            body, parent = waiting.pop()
            inner = self.add_body(body, parent)
            waiting += [(below, len(self.links) - 1) for below in reversed(inner)]

    def add_body(self, part: _Part, parent: int) -> list[_Part]:
        """Add the links of a body; return its child bodies."""
        body = part.element
        name = body.word("name", f"body#{len(self.bodies)}")
        if name in self.bodies:
            raise body.error(f"expected a body's name once, got {name!r:.80} twice")
        self.bodies.add(name)
        pose = part.frame.compose(self.settings.transform(body))
        inherited = self.settings.class_of(body, "childclass", part.inherited)
        tags, bodies = self.parts(_Part(body, Transform(), inherited))
        joints = [self.joint(tag, index) for index, tag in enumerate(tags)]
        is_free = any(joint.kind == "free" for joint in joints)
        if is_free and (len(joints) > 1 or parent != 0):
            raise body.error("expected a single free joint, in a body of the world")
        for number, (joint, tag) in enumerate(zip(joints, tags, strict=True), len(self.links)):
            self.record(tag.element, joint, f"{name}/{joint.label}", number, pose)
        self.links += _chain(name, parent, len(self.links), pose, joints)
        return bodies

    def parts(self, body: _Part) -> tuple[list[_Part], list[_Part]]:
        """Return the joints and the child bodies of a body, also inside frames."""
        joints, bodies = [], []
        waiting = [body._replace(element=child) for child in reversed(body.element.children)]
        while waiting:
            part = waiting.pop()
            element, frame, inherited = part
            if element.tag in ("joint", "freejoint"):
                joints.append(part)
            elif element.tag == "body":
                bodies.append(part)
            elif element.tag == "frame":
                frame = frame.compose(self.settings.transform(element))
                inherited = self.settings.class_of(element, "childclass", inherited)
                inner = reversed(element.children)
                waiting += [_Part(child, frame, inherited) for child in inner]
            elif element.tag == "replicate" and all(e.tag not in MOVING for e in element.walk()):
                warn(str(element.error("expected bodies or joints, got none: passed over")))
            elif element.tag in GENERATORS:
                raise element.error("expected every body to be written out, got a rule for some")
        return joints, bodies

    def joint(self, part: _Part, index: int) -> _Joint:
        """Return a joint, the default attributes of its class included."""
        element, frame, inherited = part
        kind = "free"
        if element.tag == "joint":
            element = self.settings.with_defaults(element, inherited)
            kind = one_of(element, "type", KINDS, "hinge")
        label = part.element.word("name", f"{kind}{index + 1}")
        if kind == "free":
            align = one_of(element, "align", ("true", "false", "auto"), "auto")
            if align == "true" or (align == "auto" and self.settings.alignfree):
                raise element.error(
                    "expected a free joint that is not aligned with the body's inertia"
                )
            return _Joint(label, kind)
        anchor = frame.apply(element.numbers("pos", ORIGIN))
        angle = 1.0 if kind == "slide" else self.settings.angle
        lower, upper = (angle * limit for limit in self.limits(element, kind))
        if kind == "ball":
            return _Joint(label, kind, anchor, Z, -upper, upper, upper)
        axis = rotate(frame.R, direction(element, "axis", element.numbers("axis", Z)))
        (ref,) = element.numbers("ref", (0.0,))
        return _Joint(label, kind, anchor, axis, lower, upper, ref=angle * ref)

    def limits(self, joint: Element, kind: str) -> tuple[float, float]:
        """Return a joint's range, in the unit of the file."""
        limited = one_of(joint, "limited", ("true", "false", "auto"), "auto")
        lower, upper = joint.numbers("range", (0.0, 0.0))
        if limited == "auto" and (lower or upper) and not self.settings.autolimits:
            raise joint.error("expected limited='true' or 'false' where autolimits is 'false'")
        if limited == "false" or (limited == "auto" and lower >= upper):
            return -INFINITY, INFINITY
        if lower >= upper or (kind == "ball" and lower != 0.0):
            lowest = "0" if kind == "ball" else "the least"
            bounds = " to ".join(distinct_texts(lower, upper))
            raise joint.error(f"expected a range from {lowest} up, got {bounds}")
        return lower, upper

    def record(
        self, element: Element, joint: _Joint, path: str, number: int, pose: Transform
    ) -> None:
        """Store the index and home of a joint by its name, or by its path if it has none."""
        name = joint.label if "name" in element.attributes else path
        if name in self.joints:
            raise element.error(f"expected a joint's name once, got {name!r:.80} twice")
        self.joints[name] = number
        if joint.kind == "free":
            self.homes[number] = (*pose.x, *pose.R)
        elif joint.kind != "ball":
            self.homes[number] = (joint.ref,)


def _chain(
    name: str, parent: int, number: int, pose: Transform, joints: list[_Joint]
) -> list[RobotLink]:
    """Return the links of a body; the last has the name and the pose of the body.

    The frames of the links are at the anchors of the joints. The file states the anchors in the
    body's frame for zero coordinates, and the joints act in the order of the file.
    """
    if joints and joints[0].kind == "free":
        return [RobotLink(name, 0, kind="free")]
    links: list[RobotLink] = []
    anchor = ORIGIN
    for label, kind, next_anchor, axis, *limits, ref in joints:
        if kind != "slide":
            pose = Transform(pose.apply(subtract(next_anchor, anchor)), pose.R)
            anchor = next_anchor
        shift = scale(-ref, axis)
        x, R = pose.compose(
            Transform(R=exponential(shift)) if kind == "hinge" else Transform(shift)
        )
        links.append(RobotLink(f"{name}/{label}", parent, x, R, kind, axis, *limits))
        parent, pose = number + len(links) - 1, Transform()
    if links and anchor == ORIGIN:
        return [*links[:-1], links[-1]._replace(name=name)]
    return [*links, RobotLink(name, parent, pose.apply(scale(-1.0, anchor)), pose.R)]
