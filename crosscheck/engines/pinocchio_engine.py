"""Skeletons in Pinocchio, with a spherical joint for each joint."""

import numpy as np
import pinocchio

from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose, Skeleton

# Indices of w, x, y, z in Pinocchio's quaternions (x, y, z, w).
XYZW = np.array([3, 0, 1, 2])


class PinocchioSkeleton:
    """A skeleton as a Pinocchio model.

    Pinocchio does not normalise quaternions: they must be unit ones.

    Attributes:
        model: the pinocchio.Model; its joints carry our names.
        data: its pinocchio.Data.
        joints: Pinocchio's index of each of our joints, found by name.
        columns: indices of each joint's (w, x, y, z) in q, shape (joint, 4).
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = pinocchio_model(skeleton)
        self.data = self.model.createData()
        self.joints = [self.model.getJointId(name) for name in skeleton.names]
        first = np.array([self.model.joints[joint].idx_q for joint in self.joints])
        self.columns = first[:, None] + XYZW

    def update_kinematics(self, q: FloatArray) -> None:
        """Set the coordinates and compute forward kinematics."""
        pinocchio.forwardKinematics(self.model, self.data, q)

    def pose(self) -> Pose:
        """Return the current pose of all joints."""
        placements = [self.data.oMi[joint] for joint in self.joints]
        rotations = [pinocchio.Quaternion(M.rotation).coeffs()[XYZW] for M in placements]
        return Pose(np.array([M.translation for M in placements]), np.array(rotations))

    def position(self, joint: int) -> FloatArray:
        """Return the current position of a joint [m], shape (3,)."""
        return np.array(self.data.oMi[self.joints[joint]].translation)

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Set the coordinates and return the Jacobian of a joint's position [m], (3, 3 joint).

        `getJointJacobian` requires a call of `computeJointJacobians`, in the plural.
        """
        pinocchio.computeJointJacobians(self.model, self.data, q)
        frame = pinocchio.LOCAL_WORLD_ALIGNED
        return pinocchio.getJointJacobian(self.model, self.data, self.joints[joint], frame)[:3]

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates after motion from q with velocity v for 1 s."""
        return pinocchio.integrate(self.model, q, v)


def pinocchio_model(skeleton: Skeleton) -> pinocchio.Model:
    """Return the tree of spherical joints, each at its offset in its parent's frame.

    The root is a spherical joint that is fixed to the world at its offset.
    """
    model = pinocchio.Model()
    world = 0
    for name, parent, offset in zip(
        skeleton.names, skeleton.parents, skeleton.offsets, strict=True
    ):
        above = world if parent < 0 else model.getJointId(skeleton.names[parent])
        placement = pinocchio.SE3(np.eye(3), np.array(offset))
        model.addJoint(above, pinocchio.JointModelSpherical(), placement, name)
    return model
