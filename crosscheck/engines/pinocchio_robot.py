"""Robots and characters in Pinocchio, read from URDF and MJCF files by its own readers."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

from .file_kind import URDF, file_kind, xml_root
from .robot_engine import LinkPoses, RobotEngine

COMPOSITE = "JointModelComposite"
# Its data hold eight tensors of n³ numbers for n freedoms: 4 GB for so many.
MAXIMUM_FREEDOMS = 400
FREEDOMS = {"fixed": 0, "ball": 3, "planar": 3, "free": 6, "freejoint": 6, "floating": 6}
# Pinocchio's name of the world; a joint of that name crashes the process.
WORLD = "universe"


class JointIndices(NamedTuple):
    """The first index and number of a joint's coordinates in q and of its velocities in v."""

    q: int
    nq: int
    v: int
    nv: int


class PinocchioRobot(RobotEngine):
    """The kinematics of a file as Pinocchio reads it, with a root fixed to the world.

    Its links are Pinocchio's body frames. The coordinates of a hinge without limits in a URDF are
    cosine and sine; quaternions are (x, y, z, w). The linear velocity of a free or planar joint is
    in its own, moving frame. Several joints of a body in an MJCF file form a composite joint, whose
    parts are found from the file.
    """

    def _read(self, path: Path, mimic: bool) -> None:
        root = xml_root(path)
        _check_freedoms(root)
        is_urdf = file_kind(path) == URDF
        if is_urdf:
            if root.find("link") is None:  # about which Pinocchio would print a message
                raise ValueError("there is no link in it")
            self.model = pinocchio.buildModelFromUrdf(str(path), mimic=mimic)
        else:
            _check_mjcf(root)
            self.model = pinocchio.buildModelFromMJCF(str(path))
        self.data = self.model.createData()
        frames = enumerate(self.model.frames)
        self.links = {f.name: i for i, f in frames if f.type == pinocchio.FrameType.BODY}
        by_name = zip(self.model.names[1:], list(self.model.joints)[1:], strict=True)
        self.joints = {
            name: JointIndices(joint.idx_q, joint.nq, joint.idx_v, joint.nv)
            for name, joint in (by_name if is_urdf else _joints_by_body(self.model, root))
        }
        self.columns = {name: indices.v for name, indices in self.joints.items()}
        self._free_rotations: dict[str, FloatArray] = {}

    def update_kinematics(self, values: Mapping[str, FloatArray]) -> None:
        """Set the coordinates of joints, others being as in the file; compute poses, Jacobians.

        `getFrameJacobian` requires a call of `computeJointJacobians`, in the plural.
        """
        q = pinocchio.neutral(self.model)
        for name in values.keys() & self.joints.keys():
            indices = self.joints[name]
            q[indices.q : indices.q + indices.nq] = _pinocchio_coordinates(values[name], indices.nq)
        self._free_rotations = {
            name: rotation.to_matrix(value[3:] if len(value) == 7 else _about_z(value[2]))
            for name, value in values.items()
            if len(value) in (3, 7) and name in self.joints
        }
        self._q = q
        pinocchio.computeJointJacobians(self.model, self.data, q)
        pinocchio.updateFramePlacements(self.model, self.data)

    def link_poses(self, links: list[str]) -> LinkPoses:
        """Return the current poses of some links."""
        frames = [self.data.oMf[self.links[link]] for link in links]
        return LinkPoses(
            np.array([M.translation for M in frames]), np.array([M.rotation for M in frames])
        )

    def centre_of_mass(self) -> FloatArray:
        """Return the current centre of mass of all moving links [m], (3,)."""
        return np.array(pinocchio.centerOfMass(self.model, self.data, self._q))

    def _centre_of_mass_jacobian(self) -> FloatArray:
        return np.array(pinocchio.jacobianCenterOfMass(self.model, self.data, self._q))

    def _displacement(self, start: Mapping[str, FloatArray]) -> FloatArray:
        end = self._q
        self.update_kinematics(start)
        return np.array(pinocchio.difference(self.model, self._q, end))

    def _jacobians(self, links: list[str]) -> FloatArray:
        """Return the Jacobians of links with respect to all joints, (link, 6, column).

        The velocity of a free joint is v = R^T p' in its moving frame and p' in the fixed frame.
        `getFrameJacobian` crashes for a model without freedoms and returns a single column as a
        vector.
        """
        J = np.empty((len(links), 6, self.model.nv))
        frame = pinocchio.LOCAL_WORLD_ALIGNED
        for part, link in zip(J if self.model.nv else (), links, strict=False):
            columns = pinocchio.getFrameJacobian(self.model, self.data, self.links[link], frame)
            part[:] = columns.reshape(6, -1)
        for name, R in self._free_rotations.items():
            first = self.joints[name].v
            J[..., first : first + 3] = J[..., first : first + 3] @ R.T
        return J


def _check_freedoms(root: ElementTree.Element) -> None:
    body = root.find("worldbody/body")  # it reads no second one
    elements = root if body is None else body.iter()
    joints = [element for element in elements if element.tag in ("joint", "freejoint")]
    count = sum(FREEDOMS.get(joint.get("type", joint.tag), 1) for joint in joints)
    if count > MAXIMUM_FREEDOMS:
        limit = f"expected at most {MAXIMUM_FREEDOMS}, got {count:,}"
        raise ValueError(f"it takes 64 n³ bytes for n freedoms: {limit}")


def _check_mjcf(root: ElementTree.Element) -> None:
    """Raise a ValueError if Pinocchio would read a part twice or crash."""
    if len(root.findall("worldbody")) > 1:
        raise ValueError("it reads the first of several <worldbody> again for each")
    if any(joint.get("name") == WORLD for joint in (*root.iter("joint"), *root.iter("freejoint"))):
        raise ValueError(f"{WORLD} is its own name of the world, and here that of a joint")


def _pinocchio_coordinates(q: FloatArray, nq: int) -> FloatArray:
    """Return our coordinates of a joint as Pinocchio's, (nq,)."""
    if nq == 2 or len(q) == 3:
        return np.array([*q[:-1], np.cos(q[-1]), np.sin(q[-1])])
    if nq in (4, 7):
        return np.concatenate([q[:-4], np.roll(q[-4:], -1)])
    return q


def _joints_by_body(
    model: pinocchio.Model, root: ElementTree.Element
) -> Iterator[tuple[str, pinocchio.JointModel]]:
    """Yield each joint below a body of an MJCF file, with its name."""
    joints = {f.name: f.parentJoint for f in model.frames if f.type == pinocchio.FrameType.BODY}
    for body in root.iter("body"):
        name = body.get("name", "")
        elements = [child for child in body if child.tag in ("joint", "freejoint")]
        if elements and joints.get(name):
            joint = model.joints[joints[name]]
            parts = joint.extract().joints if joint.shortname() == COMPOSITE else [joint]
            for i, (element, part) in enumerate(zip(elements, parts, strict=True), 1):
                yield element.get("name") or f"{name}/{_kind(part)}{i}", part


def _about_z(angle: float) -> FloatArray:
    return np.array([np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)])


def _kind(joint: pinocchio.JointModel) -> str:
    """Return the type of a joint in MJCF's words."""
    if joint.nq in (4, 7):
        return "ball" if joint.nq == 4 else "free"
    return "slide" if joint.shortname().startswith("JointModelP") else "hinge"
