"""Skeletons in MuJoCo: a body with a ball joint for each of ours."""

import mujoco
import numpy as np

from reference.arguments import FloatArray
from reference.skeleton import Pose, Skeleton

from .mujoco_bodies import add_point_mass


class MujocoSkeleton:
    """A skeleton as a MuJoCo model: a body with a ball joint for each of our joints.

    MuJoCo orders bodies depth-first, we keep the order given: joints are found by name. It
    normalises quaternions itself.

    Attributes:
        model: the mujoco.MjModel; its bodies and joints carry our names.
        data: its mujoco.MjData.
        bodies: MuJoCo's index of each of our joints' bodies.
        columns: where each joint's (w, x, y, z) stand in qpos, shape (joint, 4).
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = mujoco_skeleton(skeleton)
        self.data = mujoco.MjData(self.model)
        self.bodies = np.array([self.model.body(name).id for name in skeleton.names])
        first = np.array([self.model.joint(name).qposadr[0] for name in skeleton.names])
        self.columns = first[:, None] + np.arange(4)

    def place(self, q: FloatArray) -> None:
        """Put the skeleton where the coordinates q say."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)

    def pose(self) -> Pose:
        """Read where `place` has put every joint."""
        return Pose(self.data.xpos[self.bodies], self.data.xquat[self.bodies])

    def position(self, joint: int) -> FloatArray:
        """Read where `place` has put one joint [m], shape (3,)."""
        return np.array(self.data.xpos[self.bodies[joint]])

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Place, and return the joint's velocity [m] per velocity coordinate, (3, 3 joint).

        `mj_jacBody` reads the joints' axes that `mj_comPos` computes from the kinematics.
        """
        self.place(q)
        mujoco.mj_comPos(self.model, self.data)
        J = np.empty((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, J, None, self.bodies[joint])
        return J

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates reached from q by moving with the velocity v for 1 s."""
        moved = np.array(q)
        mujoco.mj_integratePos(self.model, moved, v, 1.0)
        return moved


def mujoco_skeleton(skeleton: Skeleton) -> mujoco.MjModel:
    """Return the tree of bodies, each at its offset in its parent's frame, with a ball joint there.

    MuJoCo asks for masses; kinematics does not read them.
    """
    spec = mujoco.MjSpec()
    bodies: list[mujoco.MjsBody] = []
    for name, parent, offset in zip(
        skeleton.names, skeleton.parents, skeleton.offsets, strict=True
    ):
        above = spec.worldbody if parent < 0 else bodies[parent]
        body = add_point_mass(above, name, offset, 1.0)
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_BALL)
        bodies.append(body)
    return spec.compile()
