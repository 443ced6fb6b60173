"""Draw a heart with an arm: every frame from rest, then from the last frame; write it as BVH."""

import numpy as np

from plumbob import curves, formats, forward_kinematics, scenes, track

arm, _ = scenes.lab_arm()
heart = curves["heart"]()
from_rest, from_last = (track(arm, heart, warm=warm) for warm in (False, True))
for name, motion in {"from rest": from_rest, "from the last frame": from_last}.items():
    joints = forward_kinematics(arm, motion.local_rotations).positions
    jumps = np.linalg.norm(np.diff(joints, axis=0), axis=-1)
    print(f"{name}: {len(joints)} frames, a joint jumps {1e3 * jumps.max():.1f} mm at most")
formats.bvh.write("heart.bvh", arm, from_last.local_rotations)  # opens in an animation program
