"""The links from a reader, and the robot that they make."""

import contextlib
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..arguments import frozen
from ..articulation import Articulation, Mimic
from ..model import Robot
from ..quaternion import IDENTITY, between, magnitude, normalised
from ..skeleton import Skeleton
from .xml import Element, Numbers

# A round number far above every known robot: a hostile file ends here.
MAX_JOINTS = 10_000

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
ORIGIN = (0.0, 0.0, 0.0)
INFINITY = float("inf")
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class RobotLink(NamedTuple):
    """A joint of an articulation, as read from a file; see `Articulation` for the fields.

    Its offset [m] and frame are in the frame of its parent, an index of a link, -1 of the root.
    """

    name: str
    parent: int
    offset: Vector = ORIGIN
    frame: Quaternion = IDENTITY
    kind: str = "fixed"
    axis: Vector = Z
    lower: float = -INFINITY
    upper: float = INFINITY
    cone: float = INFINITY
    mass: float = 0.0
    centre: Vector = ORIGIN


def unit_quaternion(element: Element, name: str, q: Quaternion) -> Quaternion:
    """Return the quaternion of an attribute, scaled to unit length."""
    if not 0.0 < magnitude(q) < INFINITY:
        got = repr(element.attributes[name])
        raise element.error(f"expected a quaternion in {name!r}, got {got:.80}")
    return normalised(q)


def upright(axis: Vector) -> Quaternion:
    """Return the shortest rotation of z onto an axis; onto -z, by pi about x, like MuJoCo."""
    x, y, z = axis
    if z < 0.0 and max(abs(x), abs(y)) < 1e-10 * -z:
        return 0.0, 1.0, 0.0, 0.0
    return between(Z, axis)


def assemble(
    origin: str,
    links: list[RobotLink],
    joints: dict[str, int],
    mimics: Mapping[int | str, Mimic] | None = None,
) -> Robot:
    """Return the robot of these links, with zero coordinates as its home.

    Too many or invalid links are a ValueError that names the origin.
    """
    if len(links) > MAX_JOINTS:
        raise ValueError(f"{origin}: expected at most {MAX_JOINTS:,} joints, got {len(links):,}")
    columns = zip(*links, strict=True)
    names, parents, offsets, frames, kinds, axes, lower, upper, cones, masses, centres = columns
    try:
        articulation = Articulation(
            Skeleton(parents, offsets, names), kinds, axes, frames=frames, lower=lower,
            upper=upper, cones=cones, mimics=mimics,
        )  # fmt: skip
    except ValueError as error:
        raise ValueError(f"{origin}: {error}") from None
    home, weights = frozen(articulation.zero()), frozen(np.array(masses))
    return Robot(articulation, joints, home, weights, frozen(np.array(centres)))


def numbers_or(element: Element | None, name: str, default: Numbers) -> Numbers:
    """Return the numbers in an attribute, the default if missing or invalid."""
    if element is not None:
        with contextlib.suppress(ValueError):
            return element.numbers(name, default)
    return default
