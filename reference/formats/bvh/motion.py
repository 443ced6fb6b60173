"""A recorded motion: a skeleton with its local rotations and offsets in every frame."""

from typing import NamedTuple

import numpy as np

from ... import arguments, rotation
from ...arguments import FloatArray
from ...articulation import Articulation
from ...kinematics import forward_kinematics
from ...skeleton import Pose, Skeleton, checked_skeleton


class Motion(NamedTuple):
    """A skeleton and its poses over time; `bvh.write(path, *motion)` writes it to a file."""

    skeleton: Skeleton  # the offset of its root is the root's position in the first frame
    local_rotations: FloatArray  # (frame, joint, 4)
    frame_time: float  # time between frames [s]
    # each joint's position in its parent's frame, for the root in the world, (frame, joint, 3);
    # equal to the skeleton's offsets for joints without position channels
    offsets: FloatArray

    def pose(self) -> Pose:
        """Return the global poses of all joints, with frames as the leading axis.

        Without position channels it equals `forward_kinematics(skeleton, local_rotations)`.

        Raises:
            ValueError: if the skeleton is none, or the rotations or offsets are not its own.
        """
        skeleton = checked_skeleton(self.skeleton)
        count = skeleton.joint_count
        R = arguments.array("local_rotations", self.local_rotations, "frame", count, 4)
        x = arguments.array("offsets", self.offsets, len(R), count, 3)
        centred = Skeleton(skeleton.parents, np.zeros_like(skeleton.offsets))
        q = np.concatenate([x, rotation.unit("local_rotations", R)], axis=-1)
        return forward_kinematics(Articulation(centred, "free"), q.reshape(len(q), 7 * count))
