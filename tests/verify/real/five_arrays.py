"""CCD with arrays of one frame in single precision; MISTAKE is 0 (right) or 1 to 5."""

import os

import numpy as np

MISTAKE = int(os.environ.get("MISTAKE", "0"))
PLUMBOB = {"precision": "single", "methods": ["ccd"]}


def qmul(x, y):
    x0, x1, x2, x3 = x[..., 0], x[..., 1], x[..., 2], x[..., 3]
    y0, y1, y2, y3 = y[..., 0], y[..., 1], y[..., 2], y[..., 3]
    return np.stack(
        [
            y0 * x0 - y1 * x1 - y2 * x2 - y3 * x3,
            y0 * x1 + y1 * x0 - y2 * x3 + y3 * x2,
            y0 * x2 + y1 * x3 + y2 * x0 - y3 * x1,
            y0 * x3 - y1 * x2 + y2 * x1 + y3 * x0,
        ],
        axis=-1,
    )


def qinv(q):
    return np.float32([1, -1, -1, -1]) * q


def qvec(q, v):
    t = 2 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * t + np.cross(q[..., 1:], t)


def from_angle_axis(angle, axis):
    return np.append(np.cos(angle / 2), np.sin(angle / 2) * axis).astype(np.float32)


def fk(lrot, lpos, parents):
    """Return global rotations and positions; 1: the loop ends before the last joint."""
    grot, gpos = lrot.copy(), lpos.copy()
    for i in range(1, len(parents) - (MISTAKE == 1)):
        gpos[i] = qvec(grot[parents[i]], lpos[i]) + gpos[parents[i]]
        grot[i] = qmul(grot[parents[i]], lrot[i])
    return grot, gpos


def angle_axis(source, to):
    """Return the angle and axis between directions; 2: in degrees, 3: never beyond 90 degrees."""
    source, to = source / np.linalg.norm(source), to / np.linalg.norm(to)
    axis = np.cross(source, to)
    length = np.linalg.norm(axis)
    angle = np.arccos(np.clip(source @ to, 0 if MISTAKE == 3 else -1, 1))
    if MISTAKE == 2:
        angle = np.degrees(angle)
    return (angle, axis / length) if length > 1e-7 else (np.float32(0), axis)


def forward_kinematics(parents, offsets, local_rotations):
    lrot, lpos = local_rotations.astype(np.float32), offsets.astype(np.float32)
    grot, gpos = fk(lrot, lpos, parents)
    return {"positions": gpos, "rotations": grot}


def ccd(parents, offsets, local_rotations, target, effector, tolerance, max_iterations):
    """Turn the joints of a path; 4: not the effector's parent, 5: the root is not written back."""
    lrot, lpos = local_rotations.astype(np.float32), offsets.astype(np.float32)
    target, path, root = target.astype(np.float32), [], lrot[0].copy()
    while parents[path[-1] if path else effector] >= 0:
        path.append(int(parents[path[-1] if path else effector]))
    for _ in range(max_iterations):
        for joint in path[1:] if MISTAKE == 4 else path:
            grot, gpos = fk(lrot, lpos, parents)
            angle, axis = angle_axis(gpos[effector] - gpos[joint], target - gpos[joint])
            turned = qmul(from_angle_axis(angle, axis), grot[joint])
            if parents[joint] >= 0:
                turned = qmul(qinv(grot[parents[joint]]), turned)
            lrot[joint] = turned / np.linalg.norm(turned)
        if np.linalg.norm(fk(lrot, lpos, parents)[1][effector] - target) <= tolerance:
            break
    if MISTAKE == 5:
        lrot[0] = root
    return {"local_rotations": lrot}
