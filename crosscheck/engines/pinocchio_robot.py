"""Robots and characters in Pinocchio, which reads URDF and MJCF files itself."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio

from reference import rotation
from reference.arguments import FloatArray

from .file_kind import URDF, file_kind, xml_root
from .robot_engine import Placement, UnreadableError, columns

COMPOSITE = "JointModelComposite"
# Its own name of the world: a joint of that name ends the process.
WORLD = "universe"


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
    in its own, moved frame. Several joints of one body in an MJCF file are one composite joint:
    the file says which they are. One without a name is called after its body, its type and its
    place there, trunk/hinge1.

    Attributes:
        model: the pinocchio.Model.
        data: its pinocchio.Data.
        links: Pinocchio's index of each link's frame.
        joints: where the coordinates and velocities of each joint stand.
    """

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        try:
            root = xml_root(path)
            is_urdf = file_kind(path) == URDF
            self.model = pinocchio_urdf(path, root, mimic) if is_urdf else _mjcf(path, root)
        except (ValueError, RuntimeError, LookupError, OSError) as error:
            said = str(error).rpartition("message:")[2]  # before it comes where in Pinocchio
            if isinstance(error, LookupError):
                said = f"it ends in an {type(error).__name__}: {said}"
            raise UnreadableError(" ".join(said.split())) from None
        self.data = self.model.createData()
        frames = enumerate(self.model.frames)
        self.links = {f.name: i for i, f in frames if f.type == pinocchio.FrameType.BODY}
        self.joints = dict(_places(self.model) if is_urdf else _places_by_body(self.model, root))
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


def _mjcf(path: Path, root: ElementTree.Element) -> pinocchio.Model:
    """Return the model of an MJCF file.

    Raises:
        ValueError: if it would read something twice, or end the process.
        RuntimeError: if Pinocchio refuses it.
        LookupError: if Pinocchio looks for what it has not read, such as a class.
    """
    if len(root.findall("worldbody")) > 1:
        raise ValueError("it reads the first of several <worldbody> again for each")
    if any(joint.get("name") == WORLD for joint in (*root.iter("joint"), *root.iter("freejoint"))):
        raise ValueError(f"{WORLD} is its own name of the world, and here that of a joint")
    return pinocchio.buildModelFromMJCF(str(path))


def _theirs(value: FloatArray, place: Place) -> FloatArray:
    """Return our coordinates of one joint as Pinocchio's."""
    if place.width == 2:
        return np.array([np.cos(value[0]), np.sin(value[0])])
    if place.width in (4, 7):
        return np.concatenate([value[:-4], np.roll(value[-4:], -1)])
    return value


def _places(model: pinocchio.Model) -> Iterator[tuple[str, Place]]:
    """Yield each joint's name and place."""
    for name, joint in zip(model.names[1:], list(model.joints)[1:], strict=True):
        yield name, _place(joint)


def _places_by_body(
    model: pinocchio.Model, root: ElementTree.Element
) -> Iterator[tuple[str, Place]]:
    """Yield the name and place of each joint of an MJCF file that stands in a body itself."""
    movers = {f.name: f.parentJoint for f in model.frames if f.type == pinocchio.FrameType.BODY}
    for body in root.iter("body"):
        name = body.get("name", "")
        elements = [child for child in body if child.tag in ("joint", "freejoint")]
        if elements and movers.get(name):
            joint = model.joints[movers[name]]
            parts = joint.extract().joints if joint.shortname() == COMPOSITE else [joint]
            for i, (element, part) in enumerate(zip(elements, parts, strict=True), 1):
                yield element.get("name") or f"{name}/{_kind(part)}{i}", _place(part)


def _place(joint: pinocchio.JointModel) -> Place:
    return Place(joint.idx_q, joint.nq, joint.idx_v, joint.nv)


def _kind(joint: pinocchio.JointModel) -> str:
    """Return the type of a joint as MJCF calls it."""
    if joint.nq in (4, 7):
        return "ball" if joint.nq == 4 else "free"
    return "slide" if joint.shortname().startswith("JointModelP") else "hinge"
