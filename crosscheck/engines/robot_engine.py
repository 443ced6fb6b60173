"""A robot in an engine with its own reader of files; links and joints have names."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from plumbob.reference.arguments import FloatArray


class UnreadableError(Exception):
    """The engine does not read the file; the message says why."""


class LinkPoses(NamedTuple):
    """Positions of links' origins [m], (link, 3), and their rotations, (link, 3, 3)."""

    positions: FloatArray
    matrices: FloatArray


class RobotEngine(ABC):
    """A robot or character as read by an engine from its file.

    A joint without a name is called "arm/hinge1" by its body, its type and its index in the body.

    Coordinates, by the name of the file's joint, follow our conventions. A hinge has an angle
    [rad], a slide a length [m], a ball (w, x, y, z). A free joint has a position [m] and (w, x, y,
    z) in the frame of its zero configuration. A ball's velocity is angular, in its own frame; a
    free joint's is the rate of its position, then the angular velocity.
    """

    links: Mapping[str, int]  # the engine's index of each link or body, by name
    columns: Mapping[str, int]  # the first column of the Jacobian of each movable joint, by name

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        """Read a URDF or MJCF file, or raise an UnreadableError if the engine refuses it.

        `mimic` says whether a URDF's mimic joints follow their leaders.
        """
        try:
            self._read(path, mimic)
        except (ValueError, RuntimeError, LookupError, OSError) as error:
            why = str(error).rpartition("message:")[2]  # before it comes where in Pinocchio
            if isinstance(error, LookupError):
                why = f"it ends in an {type(error).__name__}: {why}"
            raise UnreadableError(" ".join(why.split())) from None

    @abstractmethod
    def _read(self, path: Path, mimic: bool) -> None:
        """Read a file into the model, the links and the columns."""

    @abstractmethod
    def update_kinematics(self, values: Mapping[str, FloatArray]) -> None:
        """Set the coordinates of joints, others being as in the file; compute poses, Jacobians."""

    @abstractmethod
    def link_poses(self, links: list[str]) -> LinkPoses:
        """Return the current poses of some links."""

    @abstractmethod
    def centre_of_mass(self) -> FloatArray:
        """Return the current centre of mass [m], (3,)."""

    @abstractmethod
    def _jacobians(self, links: list[str]) -> FloatArray:
        """Return the Jacobians of links with respect to all joints, (link, 6, column)."""

    @abstractmethod
    def _centre_of_mass_jacobian(self) -> FloatArray:
        """Return the Jacobian of the centre of mass, (3, column)."""

    @abstractmethod
    def _displacement(self, start: Mapping[str, FloatArray]) -> FloatArray:
        """Set coordinates; return the velocity back to the previous coordinates, (column,)."""

    def jacobians(self, links: list[str], freedoms: Mapping[str, int]) -> FloatArray:
        """Return the Jacobians of links with respect to joints, given with their freedoms.

        Rows are the linear [m], then the angular velocity of the links' origins in the frame of the
        world, (link, 6, freedom). Columns of unknown joints are zero.
        """
        return self._matched(self._jacobians(links), freedoms)

    def centre_of_mass_jacobian(self, freedoms: Mapping[str, int]) -> FloatArray:
        """Return the Jacobian of the centre of mass with respect to joints, (3, freedom)."""
        return self._matched(self._centre_of_mass_jacobian(), freedoms)

    def displacement(
        self, start: Mapping[str, FloatArray], freedoms: Mapping[str, int]
    ) -> FloatArray:
        """Set coordinates; return joint velocities back to the previous coordinates, (freedom,)."""
        return self._matched(self._displacement(start), freedoms)

    def _matched(self, values: FloatArray, freedoms: Mapping[str, int]) -> FloatArray:
        """Return the columns of joints, given with their freedoms; zero of unknown joints."""
        matched, first = np.zeros((*values.shape[:-1], sum(freedoms.values()))), 0
        for name, width in freedoms.items():
            if name in self.columns:
                start = self.columns[name]
                matched[..., first : first + width] = values[..., start : start + width]
            first += width
        return matched
