"""Draw a heart with an arm: frame after frame, then as the smoothest motion; write it as BVH."""

import numpy as np

from plumbob import curves, formats, forward_kinematics, scenes, track

arm, _ = scenes.lab_arm()
heart = curves["heart"]()
for name, options in {"frame by frame": {}, "coherent": {"coherent": True, "closed": True}}.items():
    motion = track(arm, heart, **options)
    joints = forward_kinematics(arm, motion.local_rotations).positions
    moves = joints - np.roll(joints, 1, axis=0)  # from the last frame to the first as well
    jumps = np.linalg.norm(moves, axis=-1)
    print(f"{name}: {len(joints)} frames, a joint jumps {1e3 * jumps.max():.1f} mm at most")
formats.bvh.write("heart.bvh", arm, motion.local_rotations)  # opens in an animation program
