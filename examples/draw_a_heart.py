"""Draw a heart with an arm: frame after frame, then as the smoothest motion; write it as BVH."""

import numpy as np

from plumbob import curves, formats, forward_kinematics, scenes, track

arm, _ = scenes.lab_arm()
heart = curves["heart"]()
frame_by_frame = track(arm, heart)
coherent = track(arm, heart, coherent=True, closed=True)
for name, motion in {"frame by frame": frame_by_frame, "coherent": coherent}.items():
    joints = forward_kinematics(arm, motion.local_rotations).positions
    moves = joints - np.roll(joints, 1, axis=0)  # from the last frame to the first as well
    jumps = np.linalg.norm(moves, axis=-1)
    print(f"{name}: {len(joints)} frames, a joint jumps {1e3 * jumps.max():.1f} mm at most")
formats.bvh.write("heart.bvh", arm, coherent.local_rotations)  # opens in an animation program
