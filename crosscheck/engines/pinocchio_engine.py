"""Skeletons in Pinocchio: a spherical joint for each of ours."""

import numpy as np
import pinocchio

from reference.arguments import FloatArray
from reference.skeleton import Pose, Skeleton

# Pinocchio writes a quaternion (x, y, z, w): where our w, x, y, z stand in it.
XYZW = np.array([3, 0, 1, 2])


class PinocchioSkeleton:
    """A skeleton as a Pinocchio model.

    Pinocchio does not normalise: it must be given unit quaternions.

    Attributes:
        model: the pinocchio.Model; its joints carry our names.
        data: its pinocchio.Data.
        joints: Pinocchio's index of each of our joints, found by name.
        columns: where each joint's (w, x, y, z) stand in q, shape (joint, 4).
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.model = pinocchio_model(skeleton)
        self.data = self.model.createData()
        self.joints = [self.model.getJointId(name) for name in skeleton.names]
        first = np.array([self.model.joints[joint].idx_q for joint in self.joints])
        self.columns = first[:, None] + XYZW

    def place(self, q: FloatArray) -> None:
        """Put the skeleton where the coordinates q say."""
        pinocchio.forwardKinematics(self.model, self.data, q)

    def pose(self) -> Pose:
        """Read where `place` has put every joint."""
        placements = [self.data.oMi[joint] for joint in self.joints]
        rotations = [pinocchio.Quaternion(M.rotation).coeffs()[XYZW] for M in placements]
        return Pose(np.array([M.translation for M in placements]), np.array(rotations))

    def position(self, joint: int) -> FloatArray:
        """Read where `place` has put one joint [m], shape (3,)."""
        return np.array(self.data.oMi[self.joints[joint]].translation)

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Place, and return the joint's velocity [m] per velocity coordinate, (3, 3 joint).

        It is `computeJointJacobians`, in the plural, that fills what `getJointJacobian` reads.
        """
        pinocchio.computeJointJacobians(self.model, self.data, q)
        frame = pinocchio.LOCAL_WORLD_ALIGNED
        return pinocchio.getJointJacobian(self.model, self.data, self.joints[joint], frame)[:3]

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates reached from q by moving with the velocity v for 1 s."""
        return pinocchio.integrate(self.model, q, v)


def pinocchio_model(skeleton: Skeleton) -> pinocchio.Model:
    """Return the tree of spherical joints, each placed at its offset in its parent's frame.

    Our root turns about a point fixed in the world, its offset: it is a spherical joint there.
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
