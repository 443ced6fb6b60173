"""Write BVH files."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ... import arguments, rotation
from ...arguments import FloatArray
from ...articulation import Articulation
from ...skeleton import Skeleton, checked_skeleton
from ..source import checked_path

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
CYCLIC = ("XYZ", "YZX", "ZXY")
DECIMALS = 6
POSITIONS = "Xposition Yposition Zposition"
# Deeper joints are not indented further, so that the text of a long chain stays linear in it.
DEEPEST_INDENT = 40


def write(
    path: str | Path,
    skeleton: Skeleton | Articulation,
    local_rotations: ArrayLike,
    frame_time: float = 1.0 / 60.0,
    offsets: ArrayLike | None = None,
    *,
    order: str = "ZXY",
) -> None:
    """Write a motion to a file, replacing an existing one.

    Args:
        path: of the file.
        skeleton: a Skeleton or an Articulation.
        local_rotations: (frame, joint, 4), or (joint, 4) for one pose, as `solve_ik` and `track`
            return them; for an Articulation its coordinates, (frame, coordinate).
        frame_time: time between frames [s].
        offsets: each joint's position in its parent's frame, (frame, joint, 3), or the root's
            position, (frame, 3); by default the skeleton's offsets.
        order: the axes of the rotation channels.

    Numbers have six decimals: an offset is rounded by at most 9e-7, a rotation by 2.7e-8 rad. The
    position of a joint at depth n, along links of total length L, is off by at most (n + 1) 9e-7 +
    n L 2.7e-8. Angles are continuous, without jumps of 360 degrees. Joints are written depth first,
    which is their order when read back, and keep their names.

    Raises:
        ValueError: if an argument is invalid or a name cannot be written; names the argument.
        OSError: if the file cannot be written.
    """
    text = format(skeleton, local_rotations, frame_time, offsets, order=order)
    Path(checked_path(path)).write_text(text, encoding="utf-8", newline="\n")


def format(
    skeleton: Skeleton | Articulation,
    local_rotations: ArrayLike,
    frame_time: float = 1.0 / 60.0,
    offsets: ArrayLike | None = None,
    *,
    order: str = "ZXY",
) -> str:
    """Return the text of a motion; see `write`."""
    arguments.choice("order", order, ORDERS)
    frame_time = arguments.number("frame_time", frame_time, above=0.0)
    if isinstance(skeleton, Articulation):
        if offsets is not None:
            got = "beside an Articulation's coordinates, got some"
            raise ValueError(f"offsets: expected none {got}")
        q = skeleton.checked("local_rotations", local_rotations)
        x, R = skeleton.local_transforms(_framed("local_rotations", q, 2))
        skeleton = skeleton.skeleton
    else:
        x, R = _rotated(checked_skeleton(skeleton), local_rotations, offsets)
    for name in skeleton.names:
        if name != " ".join(name.split()) or set(name) & set("{}\0"):
            raise ValueError(f"skeleton: expected names without braces or line ends, got {name!r}")
    shifts = (x != skeleton.offsets).any(axis=(0, 2))
    shifts[0] = True
    ends = _end_sites(skeleton, R, shifts)
    joints, hierarchy = _hierarchy(skeleton, shifts, ends, order)
    angles = euler_angles(R, order)
    columns = [part for j in joints for part in ([x[:, j]] if shifts[j] else []) + [angles[:, j]]]
    frames = _lines(np.concatenate(columns, axis=-1))
    head = ["MOTION", f"Frames: {len(frames)}", f"Frame Time: {frame_time!r}"]
    return "\n".join(["HIERARCHY", *hierarchy, *head, *frames, ""])


def euler_angles(R: FloatArray, order: str) -> FloatArray:
    """Return angles [degrees], (frame, joint, 3), of R = R_1(a_1) R_2(a_2) R_3(a_3), (..., 4).

    Bernardes and Viollet 2022: with e the sign of the axes' order, (a_3 + e a_1)/2 and
    (a_3 - e a_1)/2 are the polar angles of two points in the plane whose coordinates are sums of
    the quaternion's components, and the ratio of their radii gives a_2. At gimbal lock one of them
    is the origin, whose angle is arbitrary and has no effect. Angles start between -180 and 180 and
    are continuous from frame to frame.
    """
    first, second, third = (R[..., 1 + "XYZ".index(axis)] for axis in order)
    first = -first if order in CYCLIC else first
    w = R[..., 0]
    a, b, c, d = w - second, third + first, w + second, first - third
    half_sum, half_difference = np.arctan2(b, a), np.arctan2(d, c)
    angles = np.stack(
        [
            half_sum + half_difference,
            2.0 * np.arctan2(np.hypot(c, d), np.hypot(a, b)) - 0.5 * np.pi,
            half_sum - half_difference,
        ],
        axis=-1,
    )
    angles[..., 0] *= -1.0 if order in CYCLIC else 1.0
    angles = np.degrees(np.unwrap(angles, axis=0))
    return angles - 360.0 * np.round(angles[:1] / 360.0)


def _rotated(
    skeleton: Skeleton, local_rotations: ArrayLike, offsets: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return offsets and local rotations of each frame."""
    count = skeleton.joint_count
    values = arguments.floats("local_rotations", local_rotations, "...", count, 4)
    R = _framed("local_rotations", rotation.unit("local_rotations", values), 3)
    x = np.tile(skeleton.offsets, (len(R), 1, 1))
    if offsets is None:
        return x, R
    shifts = arguments.coordinates("offsets", offsets, "...", 3)
    if shifts.ndim == 2:
        x[:, 0] = arguments.coordinates("offsets", shifts, len(R), 3)
        return x, R
    return arguments.coordinates("offsets", shifts, len(R), count, 3), R


def _framed(name: str, values: FloatArray, axes: int) -> FloatArray:
    """Return an array with frames as its leading axis, which is added to a single pose."""
    if values.ndim not in (axes - 1, axes):
        raise ValueError(f"{name}: expected one pose or a row of frames, got {values.shape}")
    return values if values.ndim == axes else values[None]


def _children(skeleton: Skeleton) -> list[list[int]]:
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents[1:], 1):
        children[parent].append(joint)
    return children


def _end_sites(skeleton: Skeleton, R: FloatArray, shifts: np.ndarray) -> set[int]:
    """Return the joints that can be written as end sites without loss."""
    ends = set()
    children = _children(skeleton)
    for siblings in children:
        j = siblings[0] if len(siblings) == 1 else 0
        is_named = skeleton.names[j] == f"{skeleton.names[skeleton.parents[j]]} end"
        distinct = np.round(skeleton.offsets[j], DECIMALS).any()
        fixed = not shifts[j] and (np.abs(R[:, j, 0]) == 1.0).all()
        if is_named and distinct and fixed and not children[j]:
            ends.add(j)
    return ends


def _hierarchy(
    skeleton: Skeleton, shifts: np.ndarray, ends: set[int], order: str
) -> tuple[list[int], list[str]]:
    """Return the joints with channels, in the order of the file, and the lines of the hierarchy."""
    children = _children(skeleton)
    rotations = " ".join(f"{axis}rotation" for axis in order)
    joints: list[int] = []
    lines: list[str] = []
    depths = np.zeros(skeleton.joint_count, dtype=int)
    waiting: list[int | str] = [0]
    while waiting:
        j = waiting.pop()
        if isinstance(j, str):
            lines.append(j)
            continue
        depths[children[j]] = depths[j] + 1
        pad = "\t" * min(depths[j], DEEPEST_INDENT)
        offset = skeleton.offsets[j] if j else np.zeros(3)
        if j in ends:
            lines += _block(pad, "End Site", offset)
            continue
        joints.append(j)
        channels = f"6 {POSITIONS} {rotations}" if shifts[j] else f"3 {rotations}"
        title = f"{'JOINT' if j else 'ROOT'} {skeleton.names[j]}"
        lines += [*_block(pad, title, offset)[:-1], f"{pad}\tCHANNELS {channels}"]
        lines += [] if children[j] else _block(pad + "\t", "End Site", np.zeros(3))
        waiting += [pad + "}", *reversed(children[j])]
    return joints, lines


def _block(pad: str, title: str, offset: FloatArray) -> list[str]:
    return [pad + title, pad + "{", f"{pad}\tOFFSET {_lines(offset[None])[0]}", pad + "}"]


def _lines(rows: FloatArray) -> list[str]:
    """Return a line for each row; no number is written as -0."""
    pattern = " ".join([f"%.{DECIMALS}f"] * rows.shape[1])
    return [pattern % tuple(row) for row in np.round(rows, DECIMALS) + 0.0]
