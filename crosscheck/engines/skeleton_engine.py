"""What every engine's skeleton can do, and forward kinematics with any of them."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from reference.arguments import FloatArray
from reference.skeleton import Pose, Skeleton


class SkeletonEngine(Protocol):
    """A skeleton inside an engine: its coordinates q, and where they put the joints.

    In both engines the 3 joint coordinates of a velocity are the angular velocities of the balls,
    each in the frame of its own joint: `integrate` turns by them from the right.

    Attributes:
        columns: where each joint's (w, x, y, z) stand in q, shape (joint, 4).
    """

    columns: np.ndarray

    def __init__(self, skeleton: Skeleton) -> None: ...

    def place(self, q: FloatArray) -> None:
        """Put the skeleton where the coordinates q say: the engine's forward kinematics."""

    def pose(self) -> Pose:
        """Read where `place` has put every joint."""

    def position(self, joint: int) -> FloatArray:
        """Read where `place` has put one joint [m], shape (3,)."""

    def jacobian(self, q: FloatArray, joint: int) -> FloatArray:
        """Place, and return the joint's velocity [m] per velocity coordinate, (3, 3 joint)."""

    def integrate(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the coordinates reached from q by moving with the velocity v for 1 s."""


def coordinates(engine: SkeletonEngine, local_rotations: ArrayLike) -> FloatArray:
    """Return the engine's coordinates, (..., 4 joint), of unit quaternions (..., joint, 4)."""
    local = np.asarray(local_rotations, dtype=np.float64)
    q = np.empty((*local.shape[:-2], engine.columns.size))
    q[..., engine.columns] = local
    return q


def forward_kinematics_by(engine: SkeletonEngine, local_rotations: ArrayLike) -> Pose:
    """Return the pose the engine gives to local rotations, shape (..., joint, 4), as our `Pose`."""
    q = coordinates(engine, local_rotations)
    poses = []
    for row in q.reshape(-1, q.shape[-1]):
        engine.place(row)
        poses.append(engine.pose())
    batch = (*q.shape[:-1], len(engine.columns))
    positions = np.array([pose.positions for pose in poses])
    rotations = np.array([pose.rotations for pose in poses])
    return Pose(positions.reshape(*batch, 3), rotations.reshape(*batch, 4))
