"""Motion: how a skeleton moves, frame by frame."""

from typing import NamedTuple

import numpy as np

from ...arguments import FloatArray
from ...articulation import Articulation
from ...kinematics import forward_kinematics
from ...skeleton import Pose, Skeleton


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
        """
        here = Skeleton(self.skeleton.parents, np.zeros_like(self.skeleton.offsets))
        q = np.concatenate([self.offsets, self.local_rotations], axis=-1)
        return forward_kinematics(
            Articulation(here, "free"), q.reshape(len(q), 7 * here.joint_count)
        )
