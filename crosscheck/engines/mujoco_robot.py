"""Robots and characters in MuJoCo, which reads URDF and MJCF files itself."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np

from reference.arguments import FloatArray

from .robot_engine import Placement, UnreadableError, columns

# What MuJoCo would refuse or lose in a URDF, and kinematics does not read.
LEFT_OUT = ("visual", "collision", "inertial")


class Follower(NamedTuple):
    """A joint held to another: qpos - qpos0 = shift + multiplier (leader's qpos - qpos0)."""

    joint: int
    leader: int
    shift: float
    multiplier: float


class MujocoRobot:
    """A file as MuJoCo reads it, without anything but kinematics.

    Its links are MuJoCo's bodies; one without a name is called after its number, body#3. MuJoCo
    orders bodies and joints depth-first: all are found by name. A URDF's mimic joints become
    equality constraints, which kinematics does not enforce: the followers are placed, and their
    columns added to their leaders', as the constraints say.

    Attributes:
        model: the mujoco.MjModel.
        data: its mujoco.MjData.
        links: MuJoCo's index of each body.
        joints: MuJoCo's index of each joint that has a name.
        followers: the joints that are held to others.
    """

    def __init__(self, path: Path, *, mimic: bool = True) -> None:
        is_urdf = path.suffix == ".urdf"
        try:
            with silent():
                self.model = (mujoco_urdf if is_urdf else mujoco_mjcf)(path)
        except ValueError as error:
            raise UnreadableError(" ".join(str(error).split())) from None
        self.data = mujoco.MjData(self.model)
        bodies = [self.model.body(i).name or f"body#{i}" for i in range(self.model.nbody)]
        self.links = {name: i for i, name in enumerate(bodies)}
        joints = [self.model.joint(i).name for i in range(self.model.njnt)]
        self.joints = {name: i for i, name in enumerate(joints) if name}
        self.followers = _followers(self.model) if is_urdf and mimic else []
        at = self.model.jnt_dofadr
        self._at = {name: int(at[joint]) for name, joint in self.joints.items()}

    def place(self, values: Mapping[str, FloatArray]) -> None:
        """Put the joints where the coordinates say; our conventions are MuJoCo's."""
        q, q0, at = self.data.qpos, self.model.qpos0, self.model.jnt_qposadr
        q[:] = q0
        for name, value in values.items():
            if name in self.joints:
                first = at[self.joints[name]]
                q[first : first + len(value)] = value
        for joint, leader, shift, multiplier in self.followers:
            moved = q[at[leader]] - q0[at[leader]]
            q[at[joint]] = q0[at[joint]] + shift + multiplier * moved
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def placement(self, links: list[str]) -> Placement:
        """Read where `place` has put some links."""
        bodies = [self.links[link] for link in links]
        return Placement(self.data.xpos[bodies], self.data.xmat[bodies].reshape(-1, 3, 3))

    def jacobians(self, links: list[str], freedoms: Mapping[str, int]) -> FloatArray:
        """Return the links' velocities by those of the joints named, (link, 6, freedom)."""
        J = np.empty((len(links), 6, self.model.nv))
        for part, link in zip(J, links, strict=True):
            mujoco.mj_jacBody(self.model, self.data, part[:3], part[3:], self.links[link])
        at = self.model.jnt_dofadr
        for joint, leader, _, multiplier in self.followers:
            J[..., at[leader]] += multiplier * J[..., at[joint]]
        return columns(J, self._at, freedoms)


def mujoco_urdf(path: Path) -> mujoco.MjModel:
    """Return the model of a URDF file of which only links and joints are left.

    The shapes need files that may not be there, many links have an inertia that MuJoCo refuses,
    and by itself it joins links that a fixed joint holds together. Kinematics reads neither
    shapes nor masses: every link is given the same one.

    Raises:
        ValueError: if MuJoCo does not read it.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(str(error)) from None
    for link in root.findall("link"):
        for child in [child for child in link if child.tag in LEFT_OUT]:
            link.remove(child)
        link.append(_unit_inertia())
    for settings in root.findall("mujoco"):
        root.remove(settings)
    ElementTree.SubElement(
        ElementTree.SubElement(root, "mujoco"),
        "compiler",
        fusestatic="false",
        balanceinertia="true",
    )
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))


def mujoco_mjcf(path: Path) -> mujoco.MjModel:
    """Return the model of an MJCF file, read as it is.

    Raises:
        ValueError: if MuJoCo does not read it.
    """
    return mujoco.MjModel.from_xml_path(str(path))


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Keep MuJoCo's warnings about a file out of the terminal and out of its log file."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _unit_inertia() -> ElementTree.Element:
    inertial = ElementTree.Element("inertial")
    ElementTree.SubElement(inertial, "mass", value="1")
    moments = {"ixx": "1", "iyy": "1", "izz": "1", "ixy": "0", "ixz": "0", "iyz": "0"}
    ElementTree.SubElement(inertial, "inertia", moments)
    return inertial


def _followers(model: mujoco.MjModel) -> list[Follower]:
    held = np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT)
    return [
        Follower(
            int(model.eq_obj1id[i]), int(model.eq_obj2id[i]), *map(float, model.eq_data[i, :2])
        )
        for i in held
    ]
