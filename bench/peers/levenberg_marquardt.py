"""Levenberg-Marquardt on anyone's kinematics: the reference's method as a loop for all.

The velocities v = J' (J J' + mu I)^-1 e bring the effector closer by the error e. The damping
follows the error, mu = |e|² / 2 (Sugihara 2011), large far from the target and zero at the target.
Three unknowns at a time, for any number of joints.
"""

from typing import NamedTuple

import numpy as np

from plumbob.crosscheck.engines import SkeletonEngine
from plumbob.reference import Skeleton, forward_kinematics, rotation
from plumbob.reference.arguments import FloatArray


class LoopOutput(NamedTuple):
    """The coordinates found, the distance left [m] and the number of iterations."""

    q: FloatArray
    residual: float
    iterations: int


def within_reach(targets: FloatArray, root: FloatArray, reach: float) -> FloatArray:
    """Return targets, (..., 3) [m], moved to the nearest point within reach."""
    arms = targets - root
    distances = np.linalg.norm(arms, axis=-1, keepdims=True)
    nearest = root + arms * (reach / np.maximum(distances, reach))
    return np.where(distances > reach, nearest, targets)


def levenberg_marquardt(
    kinematics: SkeletonEngine,
    q: FloatArray,
    target: FloatArray,
    effector: int,
    *,
    tolerance: float,
    max_iterations: int,
) -> LoopOutput:
    """Return coordinates that bring the effector to the target, from q."""
    for iteration in range(max_iterations + 1):
        J = kinematics.jacobian(q, effector)
        e = target - kinematics.position(effector)
        residual = float(np.sqrt(e @ e))
        if residual <= tolerance or iteration == max_iterations:
            break
        damped = J @ J.T
        damped[np.diag_indices(3)] += 0.5 * residual**2
        q = kinematics.integrate(q, J.T @ np.linalg.solve(damped, e))
    return LoopOutput(q, residual, iteration)


class ReferenceKinematics(SkeletonEngine):
    """A skeleton in the reference: q are its local rotations in a row, velocities local."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.columns = np.arange(4 * skeleton.joint_count).reshape(-1, 4)

    def position(self, joint: int) -> FloatArray:
        """Return where `jacobian` has put a joint [m], (3,)."""
        return self._positions[joint]

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Update forward kinematics; return the joint's velocity per velocity, (3, 3 joint).

        A joint i of the path moves the effector, at the arm r = x - x_i, by R_i w x r. Its column
        for the axis a is (R_i a) x r.
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
