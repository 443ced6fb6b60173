"""A robot's kinematics in rotation matrices as textbooks write them, right or with faults.

Coordinates q have the shape (..., joint); leading axes are configurations.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from plumbob.reference import rotation
from plumbob.reference.arguments import FloatArray

Inputs = Mapping[str, Any]
# The entries of a rotation matrix whose sine may have the wrong sign, by the number of `sign`.
SIGNS = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))
DIFFERENCE = 1e-6  # of coordinates, for numerical derivatives [rad, m]
# Differences before and after a configuration that are too long, by the number of `difference`.
COARSE = [(0.0, h) for h in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 5e-2, 5e-3)]
COARSE += [(h, h) for h in (1e-1, 1e-2, 1e-3, 5e-2)]
# Products of small rotations by larger angles overflow [rad].
MAX_SMALL = 1e3
UPRIGHT = np.array([0.0, 0.0, 1.0])


def roll_pitch_yaw(R: FloatArray) -> tuple[float, float, float]:
    """Return the angles about the fixed axes x, y and z whose rotations in turn make R [rad].

    Roll is read off after yaw is undone, so that it is exact also where pitch is a right angle.
    """
    yaw = math.atan2(R[1, 0], R[0, 0])
    sine, cosine = math.sin(yaw), math.cos(yaw)
    pitch = math.atan2(-R[2, 0], cosine * R[0, 0] + sine * R[1, 0])
    roll = math.atan2(sine * R[0, 2] - cosine * R[1, 2], cosine * R[1, 1] - sine * R[0, 1])
    return roll, pitch, yaw


class RobotSwitches(NamedTuple):
    """The number of the fault in each rule; 0 is right."""

    hinge: int = 0  # the rotation matrix of a hinge
    sign: int = 0  # the entry of that matrix with a wrong sign
    product: int = 0  # of the parent's rotation, that of the joint's frame and the joint's own
    origin: int = 0  # what rotates a joint's origin
    slide: int = 0  # what rotates the direction of a slide
    tool: int = 0  # what rotates the tool's position
    axis: int = 0  # Jacobian: what rotates an axis
    column: int = 0  # Jacobian: what the columns are
    arm: int = 0  # Jacobian: whether arms begin where the joints are before they move
    frame: int = 0  # whether frames are composed like hinges, from roll, pitch and yaw
    difference: int = 0  # Jacobian: the lengths of differences


class RobotFrames(NamedTuple):
    """Where the joints and the tool are in each configuration."""

    origins: FloatArray  # of the joints [m], (..., joint, 3)
    starts: FloatArray  # the same before the joints move
    axes: FloatArray  # of the joints, (..., joint, 3)
    position: FloatArray  # of the tool [m], (..., 3)
    rotation: FloatArray  # of the tool, (..., 3, 3)


def hinge_matrix(axis: FloatArray, angle: FloatArray, faults: RobotSwitches) -> FloatArray:
    """Return the rotations about an axis, a 1 + b [axis] + c axis axis^T, (..., 3, 3).

    By Rodrigues' formula a is the cosine, b the sine and c one minus the cosine.
    """
    angle = np.asarray(angle)[..., None, None]
    s, c = np.sin(angle), np.cos(angle)
    small = np.clip(angle, -MAX_SMALL, MAX_SMALL)
    forms = (
        (c, s, 1.0 - c), (c, s, 1.0 + c), (-c, s, 1.0 + c), (c, s, 0.0), (1.0, s, 0.0), (c, s, c),
        (1.0 - c, s, c), (s, c, 1.0 - s), (s, c, 1.0 - c), (c, s, 1.0), (1.0, small, 0.0),
        (1.0, s + 1.0 - c, 0.0), (c, -s, 1.0 - c),
    )  # fmt: skip
    a, b, outer = forms[faults.hinge]
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    K[SIGNS[faults.sign]] *= -1.0
    return np.asarray(a * np.eye(3) + b * K + outer * axis[:, None] * axis)


def frames_at(inputs: Inputs, q: FloatArray, faults: RobotSwitches) -> RobotFrames:
    """Return the frames of a robot at coordinates q."""
    unit = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    quaternions = np.concatenate([inputs["orientations"], [inputs["tool_rotation"]]])
    *frames, tool_frame = rotation.to_matrix(quaternions)
    if faults.frame:
        *frames, tool_frame = (_composed(matrix, faults) for matrix in (*frames, tool_frame))
    places, starts, axes = list[tuple[FloatArray, FloatArray]](), list[FloatArray](), []
    for j, p in enumerate(inputs["parents"]):
        x, P = places[p] if p >= 0 else (np.zeros_like(unit[..., 0]), unit)
        axis, origin, slides = (inputs[name][j] for name in ("axes", "origins", "slides"))
        F, coordinate = frames[j], q[..., j]
        M = unit if slides else hinge_matrix(axis, coordinate, faults)
        R = (P @ F @ M, M @ P @ F, F @ M, P @ M @ F, P @ M @ F)[faults.product]
        starts.append(x + P @ origin)
        x = x + (P, unit, R, P @ M)[3 if faults.product == 4 else faults.origin] @ origin
        directions = (P @ F, unit, P, R, P @ F, np.swapaxes(P @ F, -1, -2))
        if slides:
            is_upright = faults.slide > 2
            direction = directions[0 if is_upright else faults.slide]
            x = x + coordinate[..., None] * (direction @ (UPRIGHT if is_upright else axis))
        places.append((x, R))
        is_upright = faults.axis == 4 or (slides and faults.slide == 4)
        axes.append(directions[faults.axis] @ (UPRIGHT if is_upright else axis))
    x, R = places[inputs["effector"]]
    position = x + (R, unit)[faults.tool] @ inputs["tool_position"]
    origins = np.stack([place[0] for place in places], axis=-2)
    return RobotFrames(
        origins, np.stack(starts, axis=-2), np.stack(axes, axis=-2), position, R @ tool_frame
    )


def _composed(R: FloatArray, faults: RobotSwitches) -> FloatArray:
    """Return the product of rotations by roll, pitch and yaw that hinges with faults make."""
    x, y, z = (
        hinge_matrix(axis, np.array(angle), faults)
        for axis, angle in zip(np.eye(3), roll_pitch_yaw(R), strict=True)
    )
    return np.asarray(z @ y @ x)


def jacobians_at(inputs: Inputs, q: FloatArray, faults: RobotSwitches) -> Iterator[FloatArray]:
    """Yield the Jacobians, (..., 6, joint), that programs with these faults may compute.

    Their axes are those before the joint moves, or those after; or they are differences.
    """
    if faults.difference:
        yield _differences(inputs, q, faults, *COARSE[faults.difference - 1])
        return
    yield geometric_jacobian(inputs, q, faults)
    if faults.product:
        yield geometric_jacobian(inputs, q, faults._replace(axis=3))
        yield geometric_jacobian(inputs, q, faults._replace(arm=1))
    if faults[:6] != RobotSwitches()[:6]:
        yield _differences(inputs, q, faults, DIFFERENCE, DIFFERENCE)
    if (faults.hinge or faults.sign) and not faults.frame:
        yield from jacobians_at(inputs, q, faults._replace(frame=1))


def _differences(
    inputs: Inputs, q: FloatArray, faults: RobotSwitches, before: float, after: float
) -> FloatArray:
    """Return the tool's moves between coordinates so far before and after, over the distance."""
    unit = np.eye(q.shape[-1])
    first, last = (frames_at(inputs, q[..., None, :] + h * unit, faults) for h in (-before, after))
    moves = np.concatenate(
        [last.position - first.position, rotation_error(first.rotation, last.rotation)], -1
    )
    return np.asarray(np.swapaxes(moves, -1, -2) / (before + after))


def geometric_jacobian(inputs: Inputs, q: FloatArray, faults: RobotSwitches) -> FloatArray:
    """Return the axes and their moments about the tool, (..., 6, joint)."""
    frames = frames_at(inputs, q, faults)
    tool = frames.position[..., None, :]
    origins = frames.starts if faults.arm else frames.origins
    if faults.column == 12:
        joints, parents = np.arange(len(inputs["parents"])), inputs["parents"]
        origins = origins[..., np.where(parents >= 0, parents, joints), :]
    last = origins[..., inputs["effector"], None, :]
    arms = (
        tool - origins, 0.0 * origins, tool + 0.0 * origins, origins - tool, last - origins,
        tool + origins,
    )[{1: 1, 2: 2, 6: 3, 8: 4, 13: 5}.get(faults.column, 0)]  # fmt: skip
    slides = inputs["slides"][:, None] & (faults.column != 3)
    linear = np.where(slides, frames.axes, np.cross(frames.axes, arms))
    angular = np.where(slides & (faults.column != 7), 0.0, frames.axes)
    if faults.column == 5:
        angular = angular @ frames.rotation
    if faults.column == 9:
        linear = linear @ frames.rotation
    if faults.column == 10:
        angular = 0.0 * angular
    if faults.column == 14:
        angular = angular @ np.swapaxes(np.linalg.inv(_axes_of_angles(frames.rotation)), -1, -2)
    if faults.column == 11:
        linear[..., -1, :] = angular[..., -1, :] = 0.0
    J = np.swapaxes(np.concatenate([linear, angular], axis=-1), -1, -2)
    J = J * ancestors(inputs) * (-1.0 if faults.column == 4 else 1.0)
    return np.asarray(J[..., ::-1] if faults.column == 15 else J)


def _axes_of_angles(R: FloatArray) -> FloatArray:
    """Return the axes about which roll, pitch and yaw rotate, in the columns of (..., 3, 3)."""
    roll = R[..., 0]
    pitch = np.cross(UPRIGHT, roll)
    pitch = pitch / np.linalg.norm(pitch, axis=-1, keepdims=True)
    return np.stack([roll, pitch, np.broadcast_to(UPRIGHT, roll.shape)], axis=-1)


def ancestors(inputs: Inputs) -> FloatArray:
    """Return 1 for the joints that move the tool, 0 for the others, (joint,)."""
    moves, j = np.zeros(len(inputs["parents"])), inputs["effector"]
    while j >= 0:
        moves[j], j = 1.0, inputs["parents"][j]
    return moves


def rotation_error(R: FloatArray, target: FloatArray) -> FloatArray:
    """Return the rotation vectors from matrices, also such that are no rotations, to others."""
    sines = sine_error(R, target)
    sine = np.linalg.norm(sines, axis=-1, keepdims=True)
    trace = np.einsum("...ij,...ij->...", R, target)[..., None]
    return np.arctan2(sine, 0.5 * (trace - 1.0)) / np.maximum(sine, 1e-300) * sines


def sine_error(R: FloatArray, target: FloatArray) -> FloatArray:
    """Return half the sum of the cross products of columns, which is the axis times the sine."""
    return np.asarray(0.5 * np.cross(R, target, axis=-2).sum(axis=-1))
