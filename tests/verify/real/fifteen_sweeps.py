"""CCD in single precision that always makes fifteen sweeps, unless the tip arrives before."""

import numpy as np

F = np.float32
SWEEPS = 15


class Arm:
    """The joints from the root to a tip as a list of links, each with its own quaternion."""

    def __init__(self, parents, offsets, rotations, tip):
        self.offset, self.rotation = offsets.astype(F), rotations.astype(F)
        self.parent, self.chain = parents, []
        while tip >= 0:
            self.chain.append(int(tip))
            tip = parents[tip]

    def world(self, joint):
        """Return the world position and quaternion of a joint, climbing to the root."""
        place, turn = self.offset[joint], self.rotation[joint]
        while (joint := self.parent[joint]) >= 0:
            place = self.offset[joint] + spin(self.rotation[joint], place)
            turn = times(self.rotation[joint], turn)
        return place, turn


def times(a, b):
    left = np.array([
        [a[0], -a[1], -a[2], -a[3]],
        [a[1], a[0], -a[3], a[2]],
        [a[2], a[3], a[0], -a[1]],
        [a[3], -a[2], a[1], a[0]],
    ], dtype=F)  # fmt: skip
    return left @ b


def spin(q, v):
    inverse = q * np.array([1, -1, -1, -1], F)
    return times(times(q, np.append(F(0), v).astype(F)), inverse)[1:]


def local_turn(q, to, source):
    """Return q followed by the rotation, in its own frame, of one direction to another."""
    a, b = source / np.linalg.norm(source), to / np.linalg.norm(to)
    half = a + b
    if np.linalg.norm(half) < F(1e-6):
        return q
    half /= np.linalg.norm(half)
    turned = times(q, np.append(a @ half, np.cross(a, half)).astype(F))
    return turned / np.linalg.norm(turned)


def inverse_kinematics(parents, offsets, local_rotations, target, effector, tolerance):
    arm = Arm(parents, offsets, local_rotations, effector)
    target, limit = target.astype(F), F(tolerance) ** 2
    for _sweep in range(SWEEPS):
        for joint in arm.chain[1:]:
            place, turn = arm.world(joint)
            inverse = turn * np.array([1, -1, -1, -1], F)
            tip = spin(inverse, arm.world(effector)[0] - place)
            goal = spin(inverse, target - place)
            arm.rotation[joint] = local_turn(arm.rotation[joint], goal, tip)
        miss = arm.world(effector)[0] - target
        if miss @ miss < limit:
            break
    return {"local_rotations": arm.rotation}


PLUMBOB = {"precision": "single", "methods": ["ccd"]}
