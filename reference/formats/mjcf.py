"""The kinematic part of an MJCF file, MuJoCo's own format.

Joint 0 of the articulation is the world. Bodies follow depth first in the order of the file, and
the coordinates equal MuJoCo's qpos. Every body becomes a joint with its name and pose. A body with
several joints becomes a joint for each, named "body/joint"; the last has the name of the body. If
its anchor is not the body's origin, a fixed joint with the name of the body follows. A body without
a name is called "body#3" by its index, a joint "hinge1" by its type and its index in the body.

`home` is the configuration in the file, with each joint at its `ref`. A free joint moves in the
world's frame. MuJoCo limits the total angle of a ball. Here the same angle limits its tilt and its
twist about z each, which allows all that MuJoCo does, and more. Frames, nested defaults and
includes from one folder are supported. Active equalities `connect`, `weld` and `joint` become tasks
(`Robot.equalities`). Equalities between tendons and flexes are ignored, and so are elements without
effect on forward kinematics, such as keyframes. A body's mass is its `inertial`'s, or else its
geoms', by their mass or density. The mass is NaN if a geom is a mesh or a shell of a density.
Elements that generate bodies (replicate, attach, composite, flexcomp) are refused. A replicate
without bodies is ignored with a warning.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import rotation
from ..arguments import distinct_texts, frozen
from ..backend.compiled import set_backend
from ..inverse_kinematics.tasks import Coupling, FrameTask, IKTask
from ..model import Robot
from ..quaternion import (
    IDENTITY,
    add,
    conjugate,
    cross,
    dot,
    exponential,
    multiply,
    norm,
    normalised,
    rotate,
    scale,
    subtract,
)
from . import xml
from .robot import (
    INFINITY,
    ORIGIN,
    Quaternion,
    RobotLink,
    Vector,
    X,
    Y,
    Z,
    assemble,
    numbers_or,
    unit_quaternion,
    upright,
)
from .source import warn
from .xml import Element

KINDS = ("hinge", "slide", "ball", "free")
GENERATORS = ("replicate", "attach", "composite", "flexcomp")
MOVING = ("body", "joint", "freejoint", *GENERATORS[1:])
AXES = {"x": X, "y": Y, "z": Z}
POLYNOMIAL = (0.0, 1.0, 0.0, 0.0, 0.0)  # of a coupling, where the file gives no coefficients
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
# The attributes read from a default class, by the tag of their elements.
DEFAULTS = {
    "joint": ("type", "pos", "axis", "range", "limited", "ref"),
    "geom": (
        "type", "size", "fromto", "pos", "mass", "density", "mesh", "shellinertia", "group",
    ),
    "site": ("pos", "fromto", *ORIENTATIONS),
}  # fmt: skip
# The volumes of geoms [m³] by the three numbers of their size: a radius and half a length, three
# semi-axes, or half of three edges. A plane has none.
VOLUMES: dict[str, Callable[[float, float, float], float]] = {
    "plane": lambda a, b, c: 0.0,
    "hfield": lambda a, b, c: 0.0,
    "sphere": lambda a, b, c: 4.0 / 3.0 * math.pi * a**3,
    "capsule": lambda a, b, c: math.pi * a * a * (4.0 / 3.0 * a + 2.0 * b),
    "cylinder": lambda a, b, c: 2.0 * math.pi * a * a * b,
    "ellipsoid": lambda a, b, c: 4.0 / 3.0 * math.pi * a * b * c,
    "box": lambda a, b, c: 8.0 * a * b * c,
}
DENSITY = 1000.0  # of a geom that has none [kg/m³]


def read(path: str | Path, *, root: str | Path | None = None) -> Robot:
    """Return the robot or character described by a file.

    Args:
        path: of the file.
        root: the folder for all included files after symbolic links are resolved; by default the
            file's own folder.

    Raises:
        ValueError: naming file, line and element, if the file cannot be read, is not an MJCF file,
            includes a file from outside the root, or has elements that generate bodies.
    """
    element = xml.read(path)
    _include_files(element, Path(path), root)
    return _robot(element, str(path))


def parse(text: str) -> Robot:
    """Return the robot described by a text, which can include no files; see `read`."""
    root = xml.parse(text, "MJCF")
    for element in root.walk():
        if element.tag == "include":
            raise element.error("expected a text without includes; they need a file to be read")
    return _robot(root, "MJCF")


def _include_files(root: Element, path: Path, top: str | Path | None) -> None:
    """Replace all includes by the content of the files, each of which may be included once.

    `top` is the folder for all files; None stands for the folder of the main file at `path`.
    """
    main = path.resolve()
    folder = main.parent
    if top is not None:
        top_folder = _resolved(Path(top)) if isinstance(top, str | Path) else None
        if top_folder is None or not (top_folder.is_dir() and main.is_relative_to(top_folder)):
            expected = f"expected a folder that holds {main.name!r:.80}"
            raise ValueError(f"root: {expected}, got {top!r:.80}")
        folder = top_folder
    files = {main}
    waiting = [(root, main)]
    while waiting:
        element, file = waiting.pop()
        children = [(child, file) for child in reversed(element.children)]
        element.children.clear()
        while children:
            child, file = children.pop()
            if child.tag == "include":
                included = _included(child, file, main.parent, folder)
                if included in files:
                    raise child.error("expected every file to be included once, got it again")
                files.add(included)
                children += [(part, included) for part in reversed(xml.read(included).children)]
            else:
                element.children.append(child)
                waiting.append((child, file))


def _included(include: Element, file: Path, main_folder: Path, top: Path) -> Path:
    """Return the included file, relative to the main file or else to the including file."""
    name = include.word("file")
    paths = [path for base in (main_folder, file.parent) if (path := _resolved(base / name))]
    inside = [path for path in paths if path.is_relative_to(top)]
    for path in inside:
        if path.is_file():
            return path
    is_outside = paths and not inside
    fault = "outside; root= names a wider folder" if is_outside else "not there"
    raise include.error(f"expected a file in {top.name!r:.60}, got {name!r:.80}, which is {fault}")


def _resolved(path: Path) -> Path | None:
    """Return a path with symbolic links resolved; None if the path is not valid."""
    try:
        path.exists()  # raises for names that are too long and for cycles of links
        return path.resolve()
    except (OSError, RuntimeError):
        return None


class _Transform(NamedTuple):
    """A position and a rotation."""

    x: Vector = ORIGIN
    R: Quaternion = IDENTITY

    def apply(self, x: Vector) -> Vector:
        """Return the outer coordinates of a point x of this frame."""
        return add(self.x, rotate(self.R, x))

    def compose(self, inner: "_Transform") -> "_Transform":
        """Return the product of this transform and an inner one."""
        return _Transform(self.apply(inner.x), multiply(self.R, inner.R))


# The attributes of a default class by the tag of their elements.
_Class = dict[str, dict[str, str]]


class _CompilerSettings(NamedTuple):
    """The compiler's settings and the default classes of a file."""

    angle: float  # the file's unit of angles [rad]
    sequence: str  # the axes of Euler angles; capitals denote fixed axes
    autolimits: bool  # whether a range implies a limit
    alignfree: bool  # whether the frames of free bodies are aligned with their inertia
    from_geoms: bool  # whether masses are those of the geoms, whatever a body says
    groups: tuple[float, float]  # the first and the last group of geoms that have a mass
    smallest_mass: float  # of a body [kg]
    total_mass: float  # to which all are scaled [kg]; none if not positive
    classes: dict[str, _Class]  # the default classes by name

    def transform(self, element: Element) -> _Transform:
        """Return the transform of a body or a frame in its parent."""
        return _Transform(element.numbers("pos", ORIGIN), self._orientation(element))

    def class_of(self, element: Element, attribute: str, inherited: str) -> str:
        """Return the default class that an element names or inherits."""
        name = element.word(attribute, inherited)
        if name not in self.classes:
            raise element.error(f"expected a default class, got {name!r:.80}")
        return name

    def with_defaults(self, element: Element, inherited: str) -> Element:
        """Return a joint, a geom or a site with missing attributes taken from its class."""
        defaults = self.classes[self.class_of(element, "class", inherited)][element.tag]
        return element._replace(attributes=_merged(defaults, element.attributes))

    def _orientation(self, element: Element) -> Quaternion:
        present = [name for name in ORIENTATIONS if name in element.attributes]
        if len(present) > 1:
            raise element.error(f"expected one orientation, got {' and '.join(present)}")
        match present:
            case ["quat"]:
                return unit_quaternion(element, "quat", element.numbers("quat", IDENTITY))
            case ["axisangle"]:
                x, y, z, angle = element.numbers("axisangle", (0.0, 0.0, 0.0, 0.0))
                axis = _direction(element, "axisangle", (x, y, z))
                return exponential(scale(angle * self.angle, axis))
            case ["euler"]:
                return self._from_euler(element.numbers("euler", ORIGIN))
            case ["zaxis"]:
                return upright(_direction(element, "zaxis", element.numbers("zaxis", ORIGIN)))
            case ["xyaxes"]:
                return _from_axes(element, element.numbers("xyaxes", (*ORIGIN, *ORIGIN)))
        return IDENTITY

    def _from_euler(self, angles: Sequence[float]) -> Quaternion:
        """Return the product of rotations about moving axes, or about fixed axes for capitals."""
        R = IDENTITY
        for axis, angle in zip(self.sequence, angles, strict=True):
            factor = exponential(scale(angle * self.angle, AXES[axis.lower()]))
            R = multiply(R, factor) if axis.islower() else multiply(factor, R)
        return R


def _settings(root: Element) -> _CompilerSettings:
    """Return the settings of a file."""
    merged = Element("compiler", {}, [], root.location)
    for compiler in root.children_named("compiler"):
        merged = compiler._replace(attributes=merged.attributes | compiler.attributes)
    merged.choice("coordinate", ("local",), "local")
    sequence = merged.word("eulerseq", "xyz")
    if len(sequence) != 3 or not set(sequence.lower()) <= set(AXES):
        raise merged.error(f"expected three axes such as xyz for eulerseq, got {sequence!r:.80}")
    unit = merged.choice("angle", ("degree", "radian"), "degree")
    return _CompilerSettings(
        math.radians(1.0) if unit == "degree" else 1.0,
        sequence,
        merged.choice("autolimits", ("true", "false"), "true") == "true",
        merged.choice("alignfree", ("true", "false"), "false") == "true",
        merged.attributes.get("inertiafromgeom") == "true",
        merged.numbers("inertiagrouprange", (0.0, 5.0)),
        *merged.numbers("boundmass", (0.0,)),
        *merged.numbers("settotalmass", (-1.0,)),
        _classes(root),
    )


def _direction(element: Element, name: str, vector: Vector) -> Vector:
    """Return the vector scaled to unit length."""
    length = math.hypot(*vector)
    if length == 0.0:
        raise element.error(f"expected a direction in {name!r}, got {element.word(name)!r:.80}")
    return vector[0] / length, vector[1] / length, vector[2] / length


def _from_axes(element: Element, axes: Sequence[float]) -> Quaternion:
    """Return the rotation to the frame of x and the component of y perpendicular to x."""
    x = _direction(element, "xyaxes", (axes[0], axes[1], axes[2]))
    y = _direction(element, "xyaxes", (axes[3], axes[4], axes[5]))
    y = _direction(element, "xyaxes", subtract(y, scale(dot(x, y), x)))
    w, i, j, k = rotation.from_matrix(np.transpose([x, y, cross(x, y)]))
    return float(w), float(i), float(j), float(k)


def _classes(root: Element) -> dict[str, _Class]:
    """Return each default class by name, with the attributes of outer classes."""
    classes: dict[str, _Class] = {"main": {tag: {} for tag in DEFAULTS}}
    waiting = [(element, "") for element in reversed(root.children_named("default"))]
    while waiting:
        element, outer = waiting.pop()
        name = element.word("class", None if outer else "main")
        if outer:
            if name in classes:
                raise element.error(f"expected a class once, got {name!r:.80} twice")
            classes[name] = classes[outer]
        elif name != "main":
            raise element.error(f"expected the outermost class to be 'main', got {name!r:.80}")
        classes[name] = {
            tag: _merged(classes[name][tag], _own_defaults(element, tag)) for tag in DEFAULTS
        }
        waiting += [(inner, name) for inner in reversed(element.children_named("default"))]
    return classes


def _own_defaults(element: Element, tag: str) -> dict[str, str]:
    """Return the attributes of a <default> itself for elements of a tag."""
    child = element.single(tag)
    own = child.attributes if child else {}
    return {key: own[key] for key in DEFAULTS[tag] if key in own}


def _merged(defaults: dict[str, str], own: dict[str, str]) -> dict[str, str]:
    """Return attributes, where missing the defaults; of a size, each missing number alone."""
    merged = defaults | own
    if "size" in own and "size" in defaults:
        size = own["size"].split()
        merged["size"] = " ".join([*size, *defaults["size"].split()[len(size) :]])
    return merged


class _Part(NamedTuple):
    """An element of a body, its frame in the body, and its default class."""

    element: Element
    frame: _Transform
    inherited: str


def _robot(root: Element, origin: str) -> Robot:
    """Return the robot or character described by a <mujoco> element."""
    if root.tag != "mujoco":
        raise root.error("expected a <mujoco>")
    tree = _Tree(_settings(root))
    for world in root.children_named("worldbody"):
        tree.add_world(world)
    built = assemble(origin, tree.links, tree.joints)
    home = np.array(built.home)
    for joint, coordinates in tree.homes.items():
        home[built.articulation.coordinates_of(joint)] = coordinates
    masses, total = built.masses, tree.settings.total_mass
    if total > 0.0 and masses.any():
        masses = frozen(masses * (total / masses.sum()))
    built = built._replace(home=frozen(home), masses=masses)
    return built._replace(equalities=tuple(_equalities(root, tree, built)))


def _equalities(root: Element, tree: "_Tree", robot: Robot) -> Iterator[IKTask]:
    """Yield the active equalities between bodies, between sites, and between joints."""
    elements = [e for part in root.children_named("equality") for e in part.children]
    elements = [e for e in elements if e.attributes.get("active") != "false"]
    if not elements:
        return
    with set_backend("python"):  # a single pose is not worth a compilation
        positions, rotations = robot.articulation.forward(robot.home)
    poses = [_Transform(tuple(x), tuple(R)) for x, R in zip(positions, rotations, strict=True)]
    for element in elements:
        if element.tag == "joint":
            yield _coupling(element, robot)
        elif element.tag in ("connect", "weld") and "body1" in element.attributes:
            first, second = (
                _index(element, name, {n: i for i, n in enumerate(robot.articulation.names)})
                for name in ("body1", "body2")
            )
            yield _closure(element, first, second, poses)
        elif element.tag in ("connect", "weld"):
            (first, outer), (second, inner) = (tree.site(element, f"site{i}") for i in (1, 2))
            turn = multiply(outer.R, conjugate(inner.R)) if element.tag == "weld" else None
            yield FrameTask(second, outer.x, turn, relative_to=first, point=inner.x)


def _index(element: Element, attribute: str, indices: Mapping[str, int]) -> int:
    """Return the index of the name in an attribute; without the attribute 0, the world."""
    name = element.word(attribute, "world")
    if name not in indices:
        raise element.error(f"expected a name in the file for {attribute}, got {name!r:.80}")
    return indices[name]


def _closure(element: Element, first: int, second: int, poses: list[_Transform]) -> FrameTask:
    """Return a connection of two points, or of two frames.

    The anchor of a connection is in the first body, the anchor of a weld in the second. The other
    point and the relative rotation are as at home, or as in the relpose of a weld.
    """
    anchor = element.numbers("anchor", ORIGIN)
    inverse = _Transform(R=conjugate(poses[first].R))
    relative = inverse.compose(poses[second]._replace(x=subtract(poses[second].x, poses[first].x)))
    if element.tag == "connect":
        back = _Transform(R=conjugate(relative.R))
        point = back.apply(subtract(anchor, relative.x))
        return FrameTask(second, anchor, relative_to=first, point=point)
    x, y, z, *quaternion = element.numbers("relpose", (*ORIGIN, 0.0, 0.0, 0.0, 0.0))
    if any(quaternion):
        return FrameTask(
            second, (x, y, z), normalised(tuple(quaternion)), relative_to=first, point=anchor
        )
    return FrameTask(second, relative.apply(anchor), relative.R, relative_to=first, point=anchor)


def _coupling(element: Element, robot: Robot) -> Coupling:
    """Return a joint that follows a polynomial of another joint, or stays."""
    count = len(element.attributes.get("polycoef", "").split())
    coefficients = (*element.numbers("polycoef", POLYNOMIAL[:count]), *POLYNOMIAL[count:])
    joint, leader = _index(element, "joint1", robot.joints), None
    zero, leader_zero = float(robot.home[robot.articulation.coordinates_of(joint)][0]), 0.0
    if "joint2" in element.attributes:
        leader = _index(element, "joint2", robot.joints)
        leader_zero = float(robot.home[robot.articulation.coordinates_of(leader)][0])
    return Coupling(joint, leader, coefficients, zero, leader_zero)


class _Tree:
    """The links read so far, the file's joints by name, and the home coordinates of each."""

    def __init__(self, settings: _CompilerSettings) -> None:
        self.settings = settings
        self.links = [RobotLink("world", -1)]
        self.bodies = {"world"}
        self.joints: dict[str, int] = {}
        self.homes: dict[int, tuple[float, ...]] = {}
        self.sites: dict[str, tuple[int, _Part]] = {}  # with the index of the body's link

    def add_world(self, world: Element) -> None:
        """Add all bodies of a <worldbody>."""
        joints, bodies, _, sites = self.parts(_Part(world, _Transform(), "main"))
        self.add_sites(sites, 0)
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
        tags, bodies, geoms, sites = self.parts(_Part(body, _Transform(), inherited))
        joints = [self.joint(tag, index) for index, tag in enumerate(tags)]
        is_free = any(joint.kind == "free" for joint, _ in joints)
        if is_free and (len(joints) > 1 or parent != 0):
            raise body.error("expected a single free joint, in a body of the world")
        for number, (joint, tag) in enumerate(zip(joints, tags, strict=True), len(self.links)):
            self.record(tag.element, *joint, f"{name}/{joint[0].name}", number, pose)
        self.links += _chain(name, parent, len(self.links), pose, joints)
        self.add_sites(sites, len(self.links) - 1)
        inertial = body.single("inertial")
        leaves_mass = inertial is None or self.settings.from_geoms
        mass, centre = self.mass_of_geoms(geoms if leaves_mass else [])
        if inertial and mass == 0.0:
            (mass,) = numbers_or(inertial, "mass", (math.nan,))
            centre = numbers_or(inertial, "pos", ORIGIN)
        mass = max(mass, self.settings.smallest_mass)
        self.links[-1] = self.links[-1]._replace(mass=mass, centre=centre)
        return bodies

    def add_sites(self, sites: list[_Part], link: int) -> None:
        """Add the named sites of a body."""
        self.sites |= {site.element.attributes.get("name", ""): (link, site) for site in sites}

    def site(self, equality: Element, attribute: str) -> tuple[int, _Transform]:
        """Return the link of a site named by an equality, and the site's frame in the link."""
        name = equality.word(attribute)
        if name not in self.sites:
            raise equality.error(f"expected a site in the file for {attribute}, got {name!r:.80}")
        link, (element, frame, inherited) = self.sites[name]
        site = self.settings.with_defaults(element, inherited)
        if "fromto" in site.attributes:
            raise element.error("expected pos of a site that an equality names, got fromto")
        return link, frame.compose(self.settings.transform(site))

    def mass_of_geoms(self, geoms: list[_Part]) -> tuple[float, Vector]:
        """Return the mass of geoms [kg], NaN if one is not known, and its centre [m]."""
        total, moment = 0.0, ORIGIN
        first, last = self.settings.groups
        for element, frame, inherited in geoms:
            try:
                geom = self.settings.with_defaults(element, inherited)
                (group,) = geom.numbers("group", (0.0,))
                mass, centre = _mass_of_geom(geom)
            except ValueError:
                return math.nan, ORIGIN
            if first <= group <= last:
                total, moment = total + mass, add(moment, scale(mass, frame.apply(centre)))
        return total, scale(1.0 / total, moment) if total > 0.0 else ORIGIN

    def parts(self, body: _Part) -> tuple[list[_Part], list[_Part], list[_Part], list[_Part]]:
        """Return the joints, child bodies, geoms and sites of a body, also inside frames."""
        parts: dict[str, list[_Part]] = {tag: [] for tag in ("joint", "body", "geom", "site")}
        parts["freejoint"] = parts["joint"]
        waiting = [body._replace(element=child) for child in reversed(body.element.children)]
        while waiting:
            part = waiting.pop()
            element, frame, inherited = part
            if element.tag in parts:
                parts[element.tag].append(part)
            elif element.tag == "frame":
                frame = frame.compose(self.settings.transform(element))
                inherited = self.settings.class_of(element, "childclass", inherited)
                inner = reversed(element.children)
                waiting += [_Part(child, frame, inherited) for child in inner]
            elif element.tag == "replicate" and all(e.tag not in MOVING for e in element.walk()):
                warn(str(element.error("expected bodies or joints, got none: passed over")))
            elif element.tag in GENERATORS:
                raise element.error("expected every body to be written out, got a rule for some")
        return parts["joint"], parts["body"], parts["geom"], parts["site"]

    def joint(self, part: _Part, index: int) -> tuple[RobotLink, float]:
        """Return a joint, with its label and its anchor in the body, and its `ref`."""
        element, frame, inherited = part
        kind = "free"
        if element.tag == "joint":
            element = self.settings.with_defaults(element, inherited)
            kind = element.choice("type", KINDS, "hinge")
        label = part.element.word("name", f"{kind}{index + 1}")
        if kind == "free":
            align = element.choice("align", ("true", "false", "auto"), "auto")
            if align == "true" or (align == "auto" and self.settings.alignfree):
                raise element.error(
                    "expected a free joint that is not aligned with the body's inertia"
                )
            return RobotLink(label, 0, kind=kind), 0.0
        anchor = frame.apply(element.numbers("pos", ORIGIN))
        angle = 1.0 if kind == "slide" else self.settings.angle
        lower, upper = (angle * limit for limit in self.limits(element, kind))
        if kind == "ball":
            return RobotLink(label, 0, anchor, IDENTITY, kind, Z, -upper, upper, upper), 0.0
        axis = rotate(frame.R, _direction(element, "axis", element.numbers("axis", Z)))
        (ref,) = element.numbers("ref", (0.0,))
        return RobotLink(label, 0, anchor, IDENTITY, kind, axis, lower, upper), angle * ref

    def limits(self, joint: Element, kind: str) -> tuple[float, float]:
        """Return a joint's range, in the unit of the file."""
        limited = joint.choice("limited", ("true", "false", "auto"), "auto")
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
        self, element: Element, joint: RobotLink, ref: float, path: str, number: int,
        pose: _Transform,
    ) -> None:  # fmt: skip
        """Store the index and home of a joint by its name, or without a name by its path."""
        name = joint.name if "name" in element.attributes else path
        if name in self.joints:
            raise element.error(f"expected a joint's name once, got {name!r:.80} twice")
        self.joints[name] = number
        if joint.kind == "free":
            self.homes[number] = (*pose.x, *pose.R)
        elif joint.kind != "ball":
            self.homes[number] = (ref,)


def _mass_of_geom(geom: Element) -> tuple[float, Vector]:
    """Return the mass of a geom [kg], NaN of a mesh, and its centre in the body or frame [m]."""
    kind = "mesh" if "mesh" in geom.attributes else geom.word("type", "sphere")
    count = len(geom.attributes.get("size", "").split())
    a, b, c = (*geom.numbers("size", (0.0,) * count), 0.0, 0.0, 0.0)[:3]
    centre = geom.numbers("pos", ORIGIN)
    if "fromto" in geom.attributes:
        ends = geom.numbers("fromto", (*ORIGIN, *ORIGIN))
        start, end = ends[:3], ends[3:]
        centre, half = scale(0.5, add(start, end)), 0.5 * norm(subtract(end, start))
        b, c = (half, c) if kind in ("capsule", "cylinder") else (a, half)
    is_given = "mass" in geom.attributes
    (amount,) = geom.numbers("mass", (0.0,)) if is_given else geom.numbers("density", (DENSITY,))
    if amount == 0.0:
        return 0.0, centre
    is_shell = geom.attributes.get("shellinertia") == "true"
    if kind not in VOLUMES or (is_shell and not is_given):
        return math.nan, centre
    return amount if is_given else amount * VOLUMES[kind](a, b, c), centre


def _chain(
    name: str, parent: int, number: int, pose: _Transform, joints: list[tuple[RobotLink, float]]
) -> list[RobotLink]:
    """Return the links of a body; the last has the name and the pose of the body.

    The frames of the links are at the anchors of the joints. The file states the anchors in the
    body's frame for zero coordinates, and the joints act in the order of the file.
    """
    if joints and joints[0][0].kind == "free":
        return [RobotLink(name, 0, kind="free")]
    links: list[RobotLink] = []
    anchor = ORIGIN
    for joint, ref in joints:
        if joint.kind != "slide":
            pose = _Transform(pose.apply(subtract(joint.offset, anchor)), pose.R)
            anchor = joint.offset
        shift = scale(-ref, joint.axis)
        x, R = pose.compose(
            _Transform(R=exponential(shift)) if joint.kind == "hinge" else _Transform(shift)
        )
        path = f"{name}/{joint.name}"
        links.append(joint._replace(name=path, parent=parent, offset=x, frame=R))
        parent, pose = number + len(links) - 1, _Transform()
    if links and anchor == ORIGIN:
        return [*links[:-1], links[-1]._replace(name=name)]
    return [*links, RobotLink(name, parent, pose.apply(scale(-1.0, anchor)), pose.R)]
