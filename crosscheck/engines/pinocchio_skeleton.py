"""Skeletons in Pinocchio, with a ball joint for each joint."""

import numpy as np
import pinocchio

from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose, Skeleton

from .skeleton_engine import SkeletonEngine

# Indices of w, x, y, z in Pinocchio's quaternions (x, y, z, w).
XYZW = np.array([3, 0, 1, 2])


class PinocchioSkeleton(SkeletonEngine):
    """A skeleton as a Pinocchio model, whose root is fixed to the world at its offset.

    Joints are found by name. Pinocchio does not normalise: quaternions must be of unit length.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = pinocchio.Model()
        for name, parent, offset in zip(
            skeleton.names, skeleton.parents, skeleton.offsets, strict=True
        ):
            above = 0 if parent < 0 else self.model.getJointId(skeleton.names[parent])
            placement = pinocchio.SE3(np.eye(3), np.array(offset))
            self.model.addJoint(above, pinocchio.JointModelSpherical(), placement, name)
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
