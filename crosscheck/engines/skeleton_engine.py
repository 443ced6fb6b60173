"""The interface of a skeleton in an engine, and forward kinematics through it."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from plumbob.reference.arguments import FloatArray
from plumbob.reference.skeleton import Pose, Skeleton


class SkeletonEngine(Protocol):
    """A skeleton in an engine, with the engine's coordinates q.

    In both engines a velocity consists of the angular velocities of the balls, each in the frame of
    its own joint: `integrate` multiplies rotations from the right.

    Attributes:
        columns: indices of each joint's (w, x, y, z) in q, shape (joint, 4).
    """

    columns: np.ndarray

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
