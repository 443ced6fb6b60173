"""Robots and characters in Pinocchio, which reads URDF and MJCF files itself."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio

from reference import rotation
from reference.arguments import FloatArray

from .robot_engine import Placement, UnreadableError, columns

COMPOSITE = "Composite_"


class Place(NamedTuple):
    """Where a joint's coordinates begin in q and how many there are, and so its velocities."""

    at: int
    width: int
    freedom: int
    freedoms: int


class PinocchioRobot:
    """A file as Pinocchio reads it, standing still on the world.

    Its links are Pinocchio's body frames. Of the coordinates, a hinge without limits in a URDF
    takes cosine and sine, quaternions are (x, y, z, w), and the linear velocity of a free joint is
    in its own, moved frame. Several joints of one body in an MJCF file are one composite joint,
    named after the first: the file says which follow it.

    Attributes:
        model: the pinocchio.Model.
        data: its pinocchio.Data.
        links: Pinocchio's index of each link's frame.
        joints: where the coordinates and velocities of each joint stand.
    """

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        try:
            root = ElementTree.parse(path).getroot()
            self.model = (
                pinocchio_urdf(path, root, mimic) if path.suffix == ".urdf" else _mjcf(path)
            )
        except (ValueError, RuntimeError, ElementTree.ParseError) as error:
            said = str(error).rpartition("message:")[2]  # before it comes where in Pinocchio
            raise UnreadableError(" ".join(said.split())) from None
        self.data = self.model.createData()
        frames = enumerate(self.model.frames)
        self.links = {f.name: i for i, f in frames if f.type == pinocchio.FrameType.BODY}
        self.joints = dict(_places(self.model, _siblings(root)))
        self._at = {name: place.freedom for name, place in self.joints.items()}
        self._turns: dict[str, FloatArray] = {}

    def place(self, values: Mapping[str, FloatArray]) -> None:
        """Put the joints where the coordinates say, in Pinocchio's conventions.

        Frames are placed by `updateFramePlacements`, and it is `computeJointJacobians`, in the
        plural, that fills what `getFrameJacobian` reads.
        """
        q = pinocchio.neutral(self.model)
        for name, value in values.items():
            if name in self.joints:
                place = self.joints[name]
                q[place.at : place.at + place.width] = _theirs(value, place)
        self._turns = {
            name: rotation.to_matrix(value[3:])
            for name, value in values.items()
            if len(value) == 7 and name in self.joints
        }
        pinocchio.computeJointJacobians(self.model, self.data, q)
        pinocchio.updateFramePlacements(self.model, self.data)

    def placement(self, links: list[str]) -> Placement:
        """Read where `place` has put some links."""
        placed = [self.data.oMf[self.links[link]] for link in links]
        return Placement(
            np.array([M.translation for M in placed]), np.array([M.rotation for M in placed])
        )

    def jacobians(self, links: list[str], freedoms: Mapping[str, int]) -> FloatArray:
        """Return the links' velocities by those of the joints named, (link, 6, freedom).

        With v in the moved frame and p' in the unmoved one, v = R^T p'. Where nothing can move
        `getFrameJacobian` would end the process, and a single column it returns as a vector.
        """
        J = np.empty((len(links), 6, self.model.nv))
        frame = pinocchio.LOCAL_WORLD_ALIGNED
        for part, link in zip(J if self.model.nv else (), links, strict=False):
            one = pinocchio.getFrameJacobian(self.model, self.data, self.links[link], frame)
            part[:] = one.reshape(6, -1)
        for name, R in self._turns.items():
            first = self.joints[name].freedom
            J[..., first : first + 3] = J[..., first : first + 3] @ R.T
        return columns(J, self._at, freedoms)


def pinocchio_urdf(path: Path, root: ElementTree.Element, mimic: bool) -> pinocchio.Model:
    """Return the model of a URDF file.

    Raises:
        ValueError: if there is no link in it, which Pinocchio would also print.
        RuntimeError: if Pinocchio refuses it.
    """
    if root.find("link") is None:
        raise ValueError("there is no link in it")
    return pinocchio.buildModelFromUrdf(str(path), mimic=mimic)


def _mjcf(path: Path) -> pinocchio.Model:
    return pinocchio.buildModelFromMJCF(str(path))


def _theirs(value: FloatArray, place: Place) -> FloatArray:
    """Return our coordinates of one joint as Pinocchio's."""
    if place.width == 2:
        return np.array([np.cos(value[0]), np.sin(value[0])])
    if place.width in (4, 7):
        return np.concatenate([value[:-4], np.roll(value[-4:], -1)])
    return value


def _places(model: pinocchio.Model, siblings: Mapping[str, list[str]]):
    """Yield each joint's name and place, those inside composite joints too."""
    for name, joint in zip(model.names[1:], list(model.joints)[1:], strict=True):
        if not name.startswith(COMPOSITE):
            yield name, Place(joint.idx_q, joint.nq, joint.idx_v, joint.nv)
            continue
        parts = joint.extract().joints
        for part, named in zip(parts, siblings[name.removeprefix(COMPOSITE)], strict=True):
            yield named, Place(part.idx_q, part.nq, part.idx_v, part.nv)


def _siblings(root: ElementTree.Element) -> dict[str, list[str]]:
    """Return the names of all joints of each MJCF body, by that of the first."""
    joints = [
        [child.get("name", "") for child in body if child.tag in ("joint", "freejoint")]
        for body in root.iter("body")
    ]
    return {names[0]: names for names in joints if names}
