"""Forward kinematics by components."""

import numpy as np


def multiply(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    return np.array([w, x, y, z])


def rotate(q, v):
    w, x, y, z = q
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    rx = v[0] + w * tx + y * tz - z * ty
    ry = v[1] + w * ty + z * tx - x * tz
    rz = v[2] + w * tz + x * ty - y * tx
    return np.array([rx, ry, rz])


def forward_kinematics(parents, offsets, local_rotations):
    positions, rotations = [], []
    for j in range(len(parents)):
        p = parents[j]
        if p < 0:
            positions.append(offsets[j])
            rotations.append(local_rotations[j])
        else:
            positions.append(positions[p] + rotate(rotations[p], offsets[j]))
            rotations.append(multiply(rotations[p], local_rotations[j]))
    return {"positions": np.array(positions), "rotations": np.array(rotations)}
