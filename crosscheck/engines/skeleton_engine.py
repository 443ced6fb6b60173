"""Skeletons in an engine, and in MuJoCo, with a ball joint for each joint."""

from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose, Skeleton

from .mujoco_mass_spring import add_point_mass


class SkeletonEngine(Protocol):
    """A skeleton in an engine, with the engine's coordinates q.

    In both engines a velocity is the angular velocities of the balls, each in the frame of its own
    joint: `integrate` multiplies rotations from the right.
    """

    columns: np.ndarray  # indices of each joint's (w, x, y, z) in q, shape (joint, 4)

    def __init__(self, skeleton: Skeleton) -> None: ...

    def update_kinematics(self, q: FloatArray) -> None:
        """Set the coordinates and compute the engine's forward kinematics."""

    def pose(self) -> Pose:
        """Return the current pose of all joints."""

    def position(self, joint: int) -> FloatArray:
        """Return the current position of a joint [m], shape (3,)."""

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Set the coordinates and return the Jacobian of a joint's position [m], (3, 3 joint)."""

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates after motion from q with velocity v for 1 s."""


class MujocoSkeleton(SkeletonEngine):
    """A skeleton as a MuJoCo model, with a body and a ball joint for each joint.

    MuJoCo orders bodies depth first: joints are found by name. MuJoCo normalises quaternions
    itself, and requires masses, which do not affect kinematics.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        spec, bodies = mujoco.MjSpec(), list[mujoco.MjsBody]()
        for name, parent, offset in zip(
            skeleton.names, skeleton.parents, skeleton.offsets, strict=True
        ):
            above = spec.worldbody if parent < 0 else bodies[parent]
            bodies.append(add_point_mass(above, name, offset, 1.0))
            bodies[-1].add_joint(name=name, type=mujoco.mjtJoint.mjJNT_BALL)
        self.model = spec.compile()
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


def coordinates(engine: SkeletonEngine, local_rotations: ArrayLike) -> FloatArray:
    """Return the engine's coordinates, (..., 4 joint), of unit quaternions (..., joint, 4)."""
    local = np.asarray(local_rotations, dtype=np.float64)
    q = np.empty((*local.shape[:-2], engine.columns.size))
    q[..., engine.columns] = local
    return q


def forward_kinematics_by(engine: SkeletonEngine, local_rotations: ArrayLike) -> Pose:
    """Return the engine's pose for local rotations, shape (..., joint, 4), as our `Pose`."""
    q = coordinates(engine, local_rotations)
    poses = []
    for row in q.reshape(-1, q.shape[-1]):
        engine.update_kinematics(row)
        poses.append(engine.pose())
    batch = (*q.shape[:-1], len(engine.columns))
    positions = np.array([pose.positions for pose in poses])
    rotations = np.array([pose.rotations for pose in poses])
    return Pose(positions.reshape(*batch, 3), rotations.reshape(*batch, 4))
