"""Our forward kinematics as the Levenberg-Marquardt loop asks for it."""

import numpy as np

from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.reference.arguments import FloatArray


class ReferenceKinematics:
    """A skeleton in the reference: q are its local rotations in a row, velocities local."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.columns = np.arange(4 * skeleton.joint_count).reshape(-1, 4)

    def position(self, joint: int) -> FloatArray:
        """Return where `jacobian` has put a joint [m], (3,)."""
        return self._positions[joint]

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Update forward kinematics; return the joint's velocity per velocity, (3, 3 joint).

        A joint i of the path rotates the arm r = x - x_i, and with it the effector, by R_i w x r:
        its column for the axis a is (R_i a) x r.
        """
        self._positions, rotations = forward_kinematics(self.skeleton, q[self.columns])
        path = self.skeleton.path(joint)
        arms = self._positions[joint] - self._positions[path]
        axes = np.swapaxes(rotation.to_matrix(rotations[path]), -1, -2)
        J = np.zeros((self.skeleton.joint_count, 3, 3))
        J[path] = np.cross(axes, arms[:, None, :])
        return J.reshape(-1, 3).T

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates reached from q by moving with the velocity v for 1 s."""
        rotated = rotation.multiply(q.reshape(-1, 4), rotation.exponential(v.reshape(-1, 3)))
        return rotated.ravel()
