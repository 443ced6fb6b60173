"""A reader of motion files would build this tree: end sites have no channels, so no rotation."""

import math


class Joint:
    """A joint or an end site of a hierarchy, with the local-to-world transform of a frame."""

    def __init__(self, index, offset):
        self.index, self.offset, self.children = index, offset, []

    @property
    def is_end_site(self):
        return not self.children


def product(a, b):
    w, x, y, z = a
    s, i, j, k = b
    return (
        w * s - x * i - y * j - z * k,
        w * i + x * s + y * k - z * j,
        w * j - x * k + y * s + z * i,
        w * k + x * j - y * i + z * s,
    )


def turned(q, v):
    conjugate = (q[0], -q[1], -q[2], -q[3])
    return product(product(q, (0.0, *v)), conjugate)[1:]


def hierarchy(parents, offsets):
    joints = [Joint(i, tuple(offset)) for i, offset in enumerate(offsets)]
    for joint, parent in zip(joints, parents, strict=True):
        if parent >= 0:
            joints[parent].children.append(joint)
    return joints


def visit(joint, origin, rotation, channels, frame):
    """Store the transform of a joint in the frame, then visit its children."""
    place = tuple(o + d for o, d in zip(origin, turned(rotation, joint.offset), strict=True))
    if not joint.is_end_site:
        rotation = product(rotation, channels[joint.index])
    frame[joint.index] = place, rotation
    for child in joint.children:
        visit(child, place, rotation, channels, frame)


def forward_kinematics(parents, offsets, local_rotations):
    joints = hierarchy(parents, offsets)
    channels = [tuple(c / math.hypot(*q) for c in q) for q in local_rotations]
    frame = {}
    visit(joints[0], (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), channels, frame)
    return [frame[j][0] for j in range(len(joints))], [frame[j][1] for j in range(len(joints))]
