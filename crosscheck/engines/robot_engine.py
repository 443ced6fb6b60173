"""What every engine's robot can do: the engine reads the file itself and is spoken to by names."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from reference.arguments import FloatArray


class UnreadableError(Exception):
    """The engine does not read the file; the message says why."""


class Placement(NamedTuple):
    """Where links are.

    Attributes:
        positions: of the links' origins [m], shape (link, 3).
        matrices: their rotations, shape (link, 3, 3).
    """

    positions: FloatArray
    matrices: FloatArray


class RobotEngine(Protocol):
    """A robot or character as an engine reads it from its file.

    Joints without a name go by that of their body, their type and their place there, arm/hinge1.

    Coordinates go in, by the name of the file's joint, as our conventions have them: a number for
    a hinge [rad] or slide [m], (w, x, y, z) for a ball, a position [m] and (w, x, y, z) for a free
    joint, both in the frame where it is unmoved. Velocities come out likewise: of a ball the
    angular one in its own frame, of a free joint the rate of its position, then the angular one.
    """

    @property
    def links(self) -> Mapping[str, int]:
        """The links or bodies of the file that the engine can place, by name."""

    @property
    def joints(self) -> Mapping[str, object]:
        """The joints it can move, by name."""

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        """Read a URDF or MJCF file.

        Args:
            path: of the file.
            mimic: whether a URDF's mimic joints follow their leaders.

        Raises:
            UnreadableError: if the engine refuses.
        """

    def place(self, values: Mapping[str, FloatArray]) -> None:
        """Put the joints where the coordinates say; joints not named stay where the file shows."""

    def placement(self, links: list[str]) -> Placement:
        """Read where `place` has put some links."""

    def jacobians(self, links: list[str], freedoms: Mapping[str, int]) -> FloatArray:
        """Return the velocities of links by the velocities of the joints named, in their order.

        Args:
            links: their names.
            freedoms: how many each joint has; columns of joints that there are none of are zero.

        Returns:
            (link, 6, freedom): linear [m], then angular, of the links' origins, along the axes of
            the world.
        """


def columns(J: FloatArray, at: Mapping[str, int], freedoms: Mapping[str, int]) -> FloatArray:
    """Return the columns of named joints in their order, zero where a joint begins nowhere."""
    result = np.zeros((*J.shape[:-1], sum(freedoms.values())))
    first = 0
    for name, width in freedoms.items():
        if name in at:
            result[..., first : first + width] = J[..., at[name] : at[name] + width]
        first += width
    return result
