"""Forward kinematics."""

from .parts.rotations import multiply, rotate


def forward_kinematics(parents, offsets, local_rotations):
    q = local_rotations  # w, x, y, z
    x, R = offsets.copy(), q.copy()  # as they are at the root
    for j in range(1, len(parents)):
        p = parents[j]
        R[j] = multiply(R[p], q[j])
        x[j] = x[p] + rotate(R[p], offsets[j])
    return {"positions": x, "rotations": R}
