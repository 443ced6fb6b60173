"""Skeletons in MuJoCo, with a body and a ball joint for each joint."""

import mujoco
import numpy as np

from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose, Skeleton

from .mujoco_bodies import add_point_mass


class MujocoSkeleton:
    """A skeleton as a MuJoCo model, with a body and a ball joint for each joint.

    MuJoCo orders bodies depth first: joints are found by name. It normalises quaternions itself.

    Attributes:
        model: the mujoco.MjModel; its bodies and joints carry our names.
        data: its mujoco.MjData.
        bodies: MuJoCo's index of each of our joints' bodies.
        columns: indices of each joint's (w, x, y, z) in qpos, shape (joint, 4).
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = mujoco_skeleton(skeleton)
        self.data = mujoco.MjData(self.model)
        self.bodies = np.array([self.model.body(name).id for name in skeleton.names])
        first = np.array([self.model.joint(name).qposadr[0] for name in skeleton.names])
        self.columns = first[:, None] + np.arange(4)

    def update_kinematics(self, q: FloatArray) -> None:
        """Set the coordinates and compute forward kinematics."""
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)

    def pose(self) -> Pose:
        """Return the current pose of all joints."""
        return Pose(self.data.xpos[self.bodies], self.data.xquat[self.bodies])

    def position(self, joint: int) -> FloatArray:
        """Return the current position of a joint [m], shape (3,)."""
        return np.array(self.data.xpos[self.bodies[joint]])

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Set the coordinates and return the Jacobian of a joint's position [m], (3, 3 joint).

        `mj_jacBody` requires the joint axes that `mj_comPos` computes.
        """
        self.update_kinematics(q)
        mujoco.mj_comPos(self.model, self.data)
        J = np.empty((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, J, None, self.bodies[joint])
        return J

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates after motion from q with velocity v for 1 s."""
        result = np.array(q)
        mujoco.mj_integratePos(self.model, result, v, 1.0)
        return result


def mujoco_skeleton(skeleton: Skeleton) -> mujoco.MjModel:
    """Return a tree of bodies with ball joints, each at its offset in its parent's frame.

    MuJoCo requires masses, which do not affect kinematics.
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
