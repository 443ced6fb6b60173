"""The tree of bodies of an MJCF file."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arguments import frozen
from ...quaternion import exponential, rotate, scale, subtract
from ..robot import INFINITY, ORIGIN, Link, Robot, Vector, assemble
from ..source import warn
from ..xml import Element
from .settings import Pose, Settings, direction, one_of, settings

KINDS = ("hinge", "slide", "ball", "free")
BODIES_BY_RULE = ("replicate", "attach", "composite", "flexcomp")
MOVING = ("body", "joint", "freejoint", *BODIES_BY_RULE[1:])
Z = (0.0, 0.0, 1.0)


class _Part(NamedTuple):
    """An element of a body, the frame it stands in there, and its default class."""

    element: Element
    frame: Pose
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
    """Return the robot or character that a <mujoco> element describes.

    Raises:
        ValueError: naming place and element, if anything in it is wrong.
    """
    if root.tag != "mujoco":
        raise root.error("expected a <mujoco>")
    tree = _Tree(settings(root))
    for world in root.named("worldbody"):
        tree.add_world(world)
    found = assemble(origin, tree.links, tree.joints)
    home = np.array(found.home)
    for joint, coordinates in tree.homes.items():
        home[found.articulation.coordinates_of(joint)] = coordinates
    return found._replace(home=frozen(home))


class _Tree:
    """The links of the bodies so far, the file's joints by name, and where each is at home."""

    def __init__(self, given: Settings) -> None:
        self.settings = given
        self.links = [Link("world", -1)]
        self.bodies = {"world"}
        self.joints: dict[str, int] = {}
        self.homes: dict[int, tuple[float, ...]] = {}

    def add_world(self, world: Element) -> None:
        """Add what hangs on a <worldbody>."""
        joints, bodies = self.parts(_Part(world, Pose(), "main"))
        if joints:
            raise joints[0].element.error("expected no joint in the world, which cannot move")
        waiting = [(body, 0) for body in reversed(bodies)]
        while waiting:
            body, parent = waiting.pop()
            inner = self.add_body(body, parent)
            waiting += [(below, len(self.links) - 1) for below in reversed(inner)]

    def add_body(self, part: _Part, parent: int) -> list[_Part]:
        """Add a body's links; return the bodies in it."""
        body = part.element
        name = body.word("name", f"body#{len(self.bodies)}")
        if name in self.bodies:
            raise body.error(f"expected a body's name once, got {name!r:.80} twice")
        self.bodies.add(name)
        pose = part.frame.then(self.settings.pose(body))
        inherited = self.settings.class_of(body, "childclass", part.inherited)
        found, bodies = self.parts(_Part(body, Pose(), inherited))
        joints = [self.joint(given, place) for place, given in enumerate(found)]
        _check_free(body, joints, parent)
        for place, (joint, given) in enumerate(zip(joints, found, strict=True)):
            self.enter(given.element, joint, f"{name}/{joint.label}", len(self.links) + place, pose)
        self.links += _chain(name, parent, len(self.links), pose, joints)
        return bodies

    def parts(self, body: _Part) -> tuple[list[_Part], list[_Part]]:
        """Return the joints and the bodies in a body, those in frames included."""
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
                frame = frame.then(self.settings.pose(element))
                inherited = self.settings.class_of(element, "childclass", inherited)
                inner = reversed(element.children)
                waiting += [_Part(child, frame, inherited) for child in inner]
            elif element.tag == "replicate" and not _holds(element, MOVING):
                warn(str(element.error("expected bodies or joints, got none: passed over")))
            elif element.tag in BODIES_BY_RULE:
                raise element.error("expected every body to be written out, got a rule for some")
        return joints, bodies

    def joint(self, part: _Part, place: int) -> _Joint:
        """Return what the file says of a joint."""
        element, frame, inherited = part
        kind = "free"
        if element.tag == "joint":
            element = self.settings.with_defaults(element, inherited)
            kind = one_of(element, "type", KINDS, "hinge")
        label = part.element.word("name", f"{kind}{place + 1}")
        if kind == "free":
            self.check_aligned(element)
            return _Joint(label, kind)
        anchor = frame.of(element.numbers("pos", ORIGIN))
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
            least = "0" if kind == "ball" else "the least"
            raise joint.error(f"expected a range from {least} up, got {lower:g} to {upper:g}")
        return lower, upper

    def check_aligned(self, joint: Element) -> None:
        """Refuse a free body that would be turned along its inertia, which is not read."""
        align = one_of(joint, "align", ("true", "false", "auto"), "auto")
        if align == "true" or (align == "auto" and self.settings.alignfree):
            raise joint.error("expected a free joint that is not aligned with the body's inertia")

    def enter(self, element: Element, joint: _Joint, path: str, number: int, pose: Pose) -> None:
        """Note the joint's number and home; one without a name goes by its path."""
        name = joint.label if "name" in element.attributes else path
        if name in self.joints:
            raise element.error(f"expected a joint's name once, got {name!r:.80} twice")
        self.joints[name] = number
        if joint.kind == "free":
            self.homes[number] = (*pose.x, *pose.R)
        elif joint.kind != "ball":
            self.homes[number] = (joint.ref,)


def _holds(element: Element, tags: Sequence[str]) -> bool:
    """Return whether an element of one of these names is anywhere in another."""
    waiting = [element]
    while waiting:
        inner = waiting.pop().children
        if any(child.tag in tags for child in inner):
            return True
        waiting += inner
    return False


def _check_free(body: Element, joints: list[_Joint], parent: int) -> None:
    if any(joint.kind == "free" for joint in joints) and (len(joints) > 1 or parent != 0):
        raise body.error("expected a free joint alone, in a body that hangs on the world")


def _chain(name: str, parent: int, number: int, pose: Pose, joints: list[_Joint]) -> list[Link]:
    """Return a body's links; the last one, of the body's name, is where the body is.

    In a body the joints turn one after another, each about its anchor, which is given where the
    body is before any has moved: the frames of the chain sit at the anchors.
    """
    if joints and joints[0].kind == "free":
        return [Link(name, 0, kind="free")]
    links: list[Link] = []
    anchor = ORIGIN
    for label, kind, next_anchor, axis, *limits, ref in joints:
        if kind != "slide":
            pose = Pose(pose.of(subtract(next_anchor, anchor)), pose.R)
            anchor = next_anchor
        x, R = pose.then(_moved(kind, axis, -ref))
        links.append(Link(f"{name}/{label}", parent, x, R, kind, axis, *limits))
        parent, pose = number + len(links) - 1, Pose()
    if links and anchor == ORIGIN:
        return [*links[:-1], links[-1]._replace(name=name)]
    return [*links, Link(name, parent, pose.of(scale(-1.0, anchor)), pose.R)]


def _moved(kind: str, axis: Vector, q: float) -> Pose:
    """Return the pose of a hinge or a slide at q; of a ball the identity."""
    if kind == "hinge":
        return Pose(ORIGIN, exponential(scale(q, axis)))
    return Pose(scale(q, axis)) if kind == "slide" else Pose()
