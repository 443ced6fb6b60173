"""The interface of a robot in an engine that reads files itself; links and joints have names."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from plumbob.reference.arguments import FloatArray


class UnreadableError(Exception):
    """The engine does not read the file; the message says why."""


class LinkPoses(NamedTuple):
    """Positions and rotations of links.

    Attributes:
        positions: of the links' origins [m], shape (link, 3).
        matrices: their rotations, shape (link, 3, 3).
    """

    positions: FloatArray
    matrices: FloatArray


class RobotEngine(Protocol):
    """A robot or character as an engine reads it from its file.

    A joint without a name is called "arm/hinge1" by its body, its type and its index in the body.

    Coordinates, by the name of the file's joint, follow our conventions: a number for a hinge [rad]
    or slide [m], (w, x, y, z) for a ball, and for a free joint a position [m] and (w, x, y, z),
    both in the frame of its zero configuration. Velocities are the angular velocity of a ball in
    its own frame and, of a free joint, the rate of its position followed by its angular velocity.
    """

    @property
    def links(self) -> Mapping[str, int]:
        """The index of each link or body that the engine knows, by name."""

    @property
    def joints(self) -> Mapping[str, object]:
        """The movable joints, by name."""

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        """Read a URDF or MJCF file.

        Args:
            path: of the file.
            mimic: whether a URDF's mimic joints follow their leaders.

        Raises:
            UnreadableError: if the engine refuses.
        """

    def update_kinematics(self, values: Mapping[str, FloatArray]) -> None:
        """Set the coordinates of joints, others being as in the file, and compute the poses."""

    def link_poses(self, links: list[str]) -> LinkPoses:
        """Return the current poses of some links."""

    def jacobians(self, links: list[str], freedoms: Mapping[str, int]) -> FloatArray:
        """Return the Jacobians of links with respect to the named joints.

        Args:
            links: their names.
            freedoms: number of freedoms of each joint; columns of unknown joints are zero.

        Returns:
            (link, 6, freedom): linear [m], then angular velocity, of the links' origins, in the
            frame of the world.
        """


def select_columns(J: FloatArray, at: Mapping[str, int], freedoms: Mapping[str, int]) -> FloatArray:
    """Return the columns of named joints in their order, zero for joints that `at` lacks."""
    result = np.zeros((*J.shape[:-1], sum(freedoms.values())))
    first = 0
    for name, width in freedoms.items():
        if name in at:
            result[..., first : first + width] = J[..., at[name] : at[name] + width]
        first += width
    return result
