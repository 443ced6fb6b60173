"""What an MJCF file says once for all of it, and how poses and joints are read by it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ... import rotation
from ...quaternion import (
    IDENTITY,
    add,
    cross,
    dot,
    exponential,
    magnitude,
    multiply,
    normalised,
    rotate,
    scale,
    subtract,
)
from ..robot import ORIGIN, Quaternion, Vector, upright
from ..xml import Element

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
OF_JOINTS = ("type", "pos", "axis", "range", "limited", "ref")
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


class Pose(NamedTuple):
    """A position and a rotation."""

    x: Vector = ORIGIN
    R: Quaternion = IDENTITY

    def of(self, x: Vector) -> Vector:
        """Return where the point x of this frame is."""
        return add(self.x, rotate(self.R, x))

    def then(self, inner: "Pose") -> "Pose":
        """Return the pose of what has the inner pose in this frame."""
        return Pose(self.of(inner.x), multiply(self.R, inner.R))


class Settings(NamedTuple):
    """The compiler's settings and the default classes of a file.

    Attributes:
        angle: the file's unit of angles [rad].
        sequence: the axes of Euler angles; those in capitals are fixed ones.
        autolimits: whether a range makes a limit.
        alignfree: whether free bodies are turned along their inertia.
        classes: what each default class says of joints.
    """

    angle: float
    sequence: str
    autolimits: bool
    alignfree: bool
    classes: dict[str, dict[str, str]]

    def pose(self, element: Element) -> Pose:
        """Return where a body or a frame is in what it stands in.

        Raises:
            ValueError: if a number is wrong, or there are several orientations.
        """
        return Pose(element.numbers("pos", ORIGIN), self._orientation(element))

    def class_of(self, element: Element, attribute: str, inherited: str) -> str:
        """Return the default class that an element names, or the one it inherits.

        Raises:
            ValueError: if there is no such class.
        """
        name = element.word(attribute, inherited)
        if name not in self.classes:
            raise element.error(f"expected a default class, got {name!r:.80}")
        return name

    def with_defaults(self, joint: Element, inherited: str) -> Element:
        """Return a joint with the attributes of its class where it has none.

        Raises:
            ValueError: if there is no such class.
        """
        defaults = self.classes[self.class_of(joint, "class", inherited)]
        return joint._replace(attributes=defaults | joint.attributes)

    def _orientation(self, element: Element) -> Quaternion:
        given = [name for name in ORIENTATIONS if name in element.attributes]
        if len(given) > 1:
            raise element.error(f"expected one orientation, got {' and '.join(given)}")
        if not given:
            return IDENTITY
        if given[0] == "quat":
            return _normalised(element, "quat", element.numbers("quat", IDENTITY))
        if given[0] == "axisangle":
            x, y, z, angle = element.numbers("axisangle", (0.0, 0.0, 0.0, 0.0))
            return exponential(scale(angle * self.angle, direction(element, given[0], (x, y, z))))
        if given[0] == "euler":
            return self._from_euler(element.numbers("euler", ORIGIN))
        if given[0] == "zaxis":
            return upright(direction(element, "zaxis", element.numbers("zaxis", ORIGIN)))
        return _from_axes(element, element.numbers("xyaxes", (*ORIGIN, *ORIGIN)))

    def _from_euler(self, angles: Sequence[float]) -> Quaternion:
        """Return the product of turns about axes that move along, or in capitals stay."""
        R = IDENTITY
        for axis, angle in zip(self.sequence, angles, strict=True):
            turn = exponential(scale(angle * self.angle, AXES[axis.lower()]))
            R = multiply(R, turn) if axis.islower() else multiply(turn, R)
        return R


def settings(root: Element) -> Settings:
    """Return the settings of a file.

    Raises:
        ValueError: if one has no such value, or a default class is wrong.
    """
    given = Element("compiler", {}, [], root.place)
    for compiler in root.named("compiler"):
        given = compiler._replace(attributes=given.attributes | compiler.attributes)
    one_of(given, "coordinate", ("local",), "local")
    sequence = given.word("eulerseq", "xyz")
    if len(sequence) != 3 or not set(sequence.lower()) <= set(AXES):
        raise given.error(f"expected three axes such as xyz for eulerseq, got {sequence!r:.80}")
    unit = one_of(given, "angle", ("degree", "radian"), "degree")
    return Settings(
        math.radians(1.0) if unit == "degree" else 1.0,
        sequence,
        one_of(given, "autolimits", ("true", "false"), "true") == "true",
        one_of(given, "alignfree", ("true", "false"), "false") == "true",
        _classes(root),
    )


def one_of(element: Element, name: str, valid: Sequence[str], default: str) -> str:
    """Return an attribute that is one of several words.

    Raises:
        ValueError: if it is another.
    """
    value = element.word(name, default)
    if value not in valid:
        raise element.error(f"expected one of {', '.join(valid)} for {name}, got {value!r:.80}")
    return value


def direction(element: Element, name: str, vector: Vector) -> Vector:
    """Return the vector scaled to unit length.

    Raises:
        ValueError: if it is zero; it speaks of the attribute named.
    """
    length = math.hypot(*vector)
    if length == 0.0:
        raise element.error(f"expected a direction in {name!r}, got {element.word(name)!r:.80}")
    return vector[0] / length, vector[1] / length, vector[2] / length


def _from_axes(element: Element, axes: Sequence[float]) -> Quaternion:
    """Return the rotation to x and to what of y is perpendicular to it."""
    x = direction(element, "xyaxes", (axes[0], axes[1], axes[2]))
    y = direction(element, "xyaxes", (axes[3], axes[4], axes[5]))
    y = direction(element, "xyaxes", subtract(y, scale(dot(x, y), x)))
    w, i, j, k = rotation.from_matrix(np.column_stack([x, y, cross(x, y)]))
    return float(w), float(i), float(j), float(k)


def _normalised(element: Element, name: str, q: Quaternion) -> Quaternion:
    if not 0.0 < magnitude(q) < math.inf:
        raise element.error(f"expected a quaternion in {name!r}, got {element.word(name)!r:.80}")
    return normalised(q)


def _classes(root: Element) -> dict[str, dict[str, str]]:
    """Return what each default class says of joints, what its outer classes say included."""
    classes: dict[str, dict[str, str]] = {"main": {}}
    waiting = [(element, "") for element in reversed(root.named("default"))]
    while waiting:
        element, outer = waiting.pop()
        name = element.word("class", None if outer else "main")
        if outer:
            if name in classes:
                raise element.error(f"expected a class once, got {name!r:.80} twice")
            classes[name] = classes[outer]
        elif name != "main":
            raise element.error(f"expected the outermost class to be 'main', got {name!r:.80}")
        joint = element.single("joint")
        given = joint.attributes if joint else {}
        classes[name] = classes[name] | {key: given[key] for key in OF_JOINTS if key in given}
        waiting += [(inner, name) for inner in reversed(element.named("default"))]
    return classes
