"""The compiler settings and default classes of an MJCF file, applied to poses and joints.

Errors are a ValueError that names the location, the element and the problem.
"""

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


class Transform(NamedTuple):
    """A position and a rotation."""

    x: Vector = ORIGIN
    R: Quaternion = IDENTITY

    def apply(self, x: Vector) -> Vector:
        """Return the outer coordinates of a point x of this frame."""
        return add(self.x, rotate(self.R, x))

    def compose(self, inner: "Transform") -> "Transform":
        """Return the product of this transform and an inner one."""
        return Transform(self.apply(inner.x), multiply(self.R, inner.R))


class CompilerSettings(NamedTuple):
    """The compiler's settings and the default classes of a file."""

    angle: float  # the file's unit of angles [rad]
    sequence: str  # the axes of Euler angles; capitals denote fixed axes
    autolimits: bool  # whether a range implies a limit
    alignfree: bool  # whether the frames of free bodies are aligned with their inertia
    classes: dict[str, dict[str, str]]  # the joint attributes of each default class

    def transform(self, element: Element) -> Transform:
        """Return the transform of a body or a frame in its parent."""
        return Transform(element.numbers("pos", ORIGIN), self._orientation(element))

    def class_of(self, element: Element, attribute: str, inherited: str) -> str:
        """Return the default class that an element names or inherits."""
        name = element.word(attribute, inherited)
        if name not in self.classes:
            raise element.error(f"expected a default class, got {name!r:.80}")
        return name

    def with_defaults(self, joint: Element, inherited: str) -> Element:
        """Return a joint with missing attributes taken from its class."""
        defaults = self.classes[self.class_of(joint, "class", inherited)]
        return joint._replace(attributes=defaults | joint.attributes)

    def _orientation(self, element: Element) -> Quaternion:
        present = [name for name in ORIENTATIONS if name in element.attributes]
        if len(present) > 1:
            raise element.error(f"expected one orientation, got {' and '.join(present)}")
        match present:
            case ["quat"]:
                q = element.numbers("quat", IDENTITY)
                if not 0.0 < magnitude(q) < math.inf:
                    got = repr(element.word("quat"))
                    raise element.error(f"expected a quaternion in 'quat', got {got:.80}")
                return normalised(q)
            case ["axisangle"]:
                x, y, z, angle = element.numbers("axisangle", (0.0, 0.0, 0.0, 0.0))
                axis = direction(element, "axisangle", (x, y, z))
                return exponential(scale(angle * self.angle, axis))
            case ["euler"]:
                return self._from_euler(element.numbers("euler", ORIGIN))
            case ["zaxis"]:
                return upright(direction(element, "zaxis", element.numbers("zaxis", ORIGIN)))
            case ["xyaxes"]:
                return _from_axes(element, element.numbers("xyaxes", (*ORIGIN, *ORIGIN)))
        return IDENTITY

    def _from_euler(self, angles: Sequence[float]) -> Quaternion:
        """Return the product of rotations about moving axes, or about fixed ones for capitals."""
        R = IDENTITY
        for axis, angle in zip(self.sequence, angles, strict=True):
            factor = exponential(scale(angle * self.angle, AXES[axis.lower()]))
            R = multiply(R, factor) if axis.islower() else multiply(factor, R)
        return R


def settings(root: Element) -> CompilerSettings:
    """Return the settings of a file."""
    merged = Element("compiler", {}, [], root.location)
    for compiler in root.children_named("compiler"):
        merged = compiler._replace(attributes=merged.attributes | compiler.attributes)
    one_of(merged, "coordinate", ("local",), "local")
    sequence = merged.word("eulerseq", "xyz")
    if len(sequence) != 3 or not set(sequence.lower()) <= set(AXES):
        raise merged.error(f"expected three axes such as xyz for eulerseq, got {sequence!r:.80}")
    unit = one_of(merged, "angle", ("degree", "radian"), "degree")
    return CompilerSettings(
        math.radians(1.0) if unit == "degree" else 1.0,
        sequence,
        one_of(merged, "autolimits", ("true", "false"), "true") == "true",
        one_of(merged, "alignfree", ("true", "false"), "false") == "true",
        _classes(root),
    )


def one_of(element: Element, name: str, valid: Sequence[str], default: str) -> str:
    """Return an attribute that is one of several words."""
    value = element.word(name, default)
    if value not in valid:
        raise element.error(f"expected one of {', '.join(valid)} for {name}, got {value!r:.80}")
    return value


def direction(element: Element, name: str, vector: Vector) -> Vector:
    """Return the vector scaled to unit length."""
    length = math.hypot(*vector)
    if length == 0.0:
        raise element.error(f"expected a direction in {name!r}, got {element.word(name)!r:.80}")
    return vector[0] / length, vector[1] / length, vector[2] / length


def _from_axes(element: Element, axes: Sequence[float]) -> Quaternion:
    """Return the rotation to the frame of x and the component of y perpendicular to x."""
    x = direction(element, "xyaxes", (axes[0], axes[1], axes[2]))
    y = direction(element, "xyaxes", (axes[3], axes[4], axes[5]))
    y = direction(element, "xyaxes", subtract(y, scale(dot(x, y), x)))
    w, i, j, k = rotation.from_matrix(np.transpose([x, y, cross(x, y)]))
    return float(w), float(i), float(j), float(k)


def _classes(root: Element) -> dict[str, dict[str, str]]:
    """Return the joint attributes of each default class, with those of outer classes."""
    classes: dict[str, dict[str, str]] = {"main": {}}
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
        joint = element.single("joint")
        own = joint.attributes if joint else {}
        classes[name] = classes[name] | {key: own[key] for key in OF_JOINTS if key in own}
        waiting += [(inner, name) for inner in reversed(element.children_named("default"))]
    return classes
