"""Motion: how a skeleton moves, frame by frame."""

from typing import NamedTuple

import numpy as np

from ... import arguments, rotation
from ...arguments import FloatArray
from ...articulation import Articulation
from ...kinematics import forward_kinematics
from ...skeleton import Pose, Skeleton, checked_skeleton


class Motion(NamedTuple):
    """A skeleton and its poses; `bvh.write(path, *motion)` writes it.

    Attributes:
        skeleton: its root is where it is in the first frame.
        local_rotations: (frame, joint, 4).
        frame_time: from a frame to the next [s].
        offsets: each joint's position in its parent's frame, the root's global one, (frame, joint,
            3): the skeleton's offsets but for joints that shift.
    """

    skeleton: Skeleton
    local_rotations: FloatArray
    frame_time: float
    offsets: FloatArray

    def pose(self) -> Pose:
        """Return the global poses of all joints, shifts included; the frames are a leading axis.

        Where only rotations change, `forward_kinematics(skeleton, local_rotations)` is the same.

        Raises:
            ValueError: if the skeleton is none, or the rotations or offsets are not its own.
        """
        skeleton = checked_skeleton(self.skeleton)
        count = skeleton.joint_count
        R = arguments.array("local_rotations", self.local_rotations, "frame", count, 4)
        x = arguments.array("offsets", self.offsets, len(R), count, 3)
        here = Skeleton(skeleton.parents, np.zeros_like(skeleton.offsets))
        q = np.concatenate([x, rotation.unit("local_rotations", R)], axis=-1)
        return forward_kinematics(Articulation(here, "free"), q.reshape(len(q), -1))
