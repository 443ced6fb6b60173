"""Robots and characters in MuJoCo, read from URDF and MJCF files by its own reader."""

import contextlib
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import mujoco
import numpy as np

from plumbob.reference.arguments import FloatArray

from .file_kind import URDF, file_kind, xml_root
from .robot_engine import LinkPoses, RobotEngine

# Elements of a URDF without effect on kinematics, which MuJoCo may refuse.
LEFT_OUT = ("visual", "collision", "inertial")
UNIT_INERTIA = """<inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
PLANAR = "joint[@type='planar']"
SETTINGS = '<mujoco><compiler fusestatic="false" balanceinertia="true"/></mujoco>'
# Elements to remove from an MJCF file refused by MuJoCo, elements with references first.
SHAPES = (
    "keys", "sensors", "actuators", "tendons", "equalities", "pairs", "excludes", "skins",
    "flexes", "sites", "geoms", "meshes", "hfields", "materials", "textures",
)  # fmt: skip
KINDS = ("free", "ball", "slide", "hinge")  # in the order of mujoco.mjtJoint


class Follower(NamedTuple):
    """A joint coupled to another: qpos - qpos0 = shift + multiplier (leader's qpos - qpos0)."""

    joint: int
    leader: int
    shift: float
    multiplier: float


class MujocoRobot(RobotEngine):
    """The kinematics of a file as MuJoCo reads it.

    Its links are MuJoCo's bodies. A body without a name is called "body#3" by its index, a nameless
    joint "body#3/hinge1". MuJoCo orders bodies and joints depth first: all are found by name. A
    URDF's mimic joints become equality constraints, which kinematics does not enforce. This class
    sets the coordinates of followers, each after its leader, and adds followers' columns of the
    Jacobian to their leaders' columns.
    """

    def _read(self, path: Path, mimic: bool) -> None:
        is_urdf = file_kind(path) == URDF
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda message: None)  # on the terminal and in its log file
        try:
            self.model = (mujoco_urdf if is_urdf else mujoco_mjcf)(path)
        finally:
            mujoco.set_mju_user_warning(before)
        self.followers = _followers(self.model) if is_urdf and mimic else []
        self.data = mujoco.MjData(self.model)
        bodies = [self.model.body(body).name or f"body#{body}" for body in range(self.model.nbody)]
        self.links = {name: body for body, name in enumerate(bodies)}
        self.joints = {_joint_name(self.model, bodies, i): i for i in range(self.model.njnt)}
        if is_urdf:  # a planar joint has three, of which the first stands for all
            planar = [joint.get("name") for joint in xml_root(path).iterfind(PLANAR)]
            self.joints |= {name: self.joints[f"{name}_TX"] for name in planar if name}
        at = self.model.jnt_dofadr
        self.columns = {name: int(at[joint]) for name, joint in self.joints.items()}

    def update_kinematics(self, values: Mapping[str, FloatArray]) -> None:
        """Set the coordinates of joints, others being as in the file; compute poses, Jacobians."""
        q, q0, at = self.data.qpos, self.model.qpos0, self.model.jnt_qposadr
        q[:] = q0
        for name in values.keys() & self.joints.keys():
            first, value = at[self.joints[name]], values[name]
            q[first : first + len(value)] = value
        for joint, leader, shift, multiplier in self.followers:
            displacement = q[at[leader]] - q0[at[leader]]
            q[at[joint]] = q0[at[joint]] + shift + multiplier * displacement
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def link_poses(self, links: list[str]) -> LinkPoses:
        """Return the current poses of some links."""
        bodies = [self.links[link] for link in links]
        return LinkPoses(self.data.xpos[bodies], self.data.xmat[bodies].reshape(-1, 3, 3))

    def centre_of_mass(self) -> FloatArray:
        """Return the current centre of mass of all bodies [m], (3,)."""
        return self.data.subtree_com[0].copy()

    def _centre_of_mass_jacobian(self) -> FloatArray:
        J = np.empty((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, J, 0)
        return J

    def _displacement(self, start: Mapping[str, FloatArray]) -> FloatArray:
        end, v = self.data.qpos.copy(), np.empty(self.model.nv)
        self.update_kinematics(start)
        mujoco.mj_differentiatePos(self.model, v, 1.0, self.data.qpos, end)
        return v

    def _jacobians(self, links: list[str]) -> FloatArray:
        J = np.empty((len(links), 6, self.model.nv))
        for part, link in zip(J, links, strict=True):
            mujoco.mj_jacBody(self.model, self.data, part[:3], part[3:], self.links[link])
        at = self.model.jnt_dofadr
        for joint, leader, _, multiplier in reversed(self.followers):
            J[..., at[leader]] += multiplier * J[..., at[joint]]
        return J


def mujoco_urdf(path: Path) -> mujoco.MjModel:
    """Return the model of the links and joints of a URDF file, or raise a ValueError.

    Shapes are removed because their files may be missing; inertias are replaced because MuJoCo
    refuses many. MuJoCo's fusion of links connected by fixed joints is disabled.
    """
    root = xml_root(path)
    for link in root.findall("link"):
        for child in [child for child in link if child.tag in LEFT_OUT]:
            link.remove(child)
        link.append(ElementTree.fromstring(UNIT_INERTIA))
    for settings in root.findall("mujoco"):
        root.remove(settings)
    root.append(ElementTree.fromstring(SETTINGS))
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))


def mujoco_mjcf(path: Path) -> mujoco.MjModel:
    """Return the model of an MJCF file, or raise a ValueError.

    Shapes are removed and masses made equal if MuJoCo refuses the file, as files of shapes may be
    missing and some masses are refused.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        with contextlib.suppress(ValueError):
            spec = mujoco.MjSpec.from_file(str(path))
            for kind in SHAPES:
                for element in list(getattr(spec, kind)):
                    spec.delete(element)
            for body in spec.bodies:
                body.explicitinertial, body.mass, body.inertia = True, 1.0, np.ones(3)
                body.fullinertia = np.full(6, np.nan)
            return spec.compile()
        raise error


def _joint_name(model: mujoco.MjModel, bodies: list[str], joint: int) -> str:
    """Return a joint's name, or else a name of its body, its type and its index there."""
    body = model.jnt_bodyid[joint]
    index = joint - model.body_jntadr[body] + 1
    return model.joint(joint).name or f"{bodies[body]}/{KINDS[model.jnt_type[joint]]}{index}"


def _followers(model: mujoco.MjModel) -> list[Follower]:
    """Return the followers, each after its leader; raise a ValueError if some form a ring."""
    equalities = np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT)
    joints, leaders = model.eq_obj1id[equalities].tolist(), model.eq_obj2id[equalities].tolist()
    by_joint = {
        joint: Follower(joint, leader, *polynomial)
        for joint, leader, polynomial in zip(
            joints, leaders, model.eq_data[equalities, :2].tolist(), strict=True
        )
    }
    try:
        order = TopologicalSorter({f.joint: [f.leader] for f in by_joint.values()}).static_order()
        return [by_joint[joint] for joint in order if joint in by_joint]
    except CycleError:
        raise ValueError("its mimic joints follow each other in a ring") from None
