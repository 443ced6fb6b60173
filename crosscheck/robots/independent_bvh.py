"""An independent reader of valid BVH files, based on matrices, to check the reference's reader."""

import re
from collections.abc import Iterator

import numpy as np

from plumbob.reference.arguments import FloatArray

MOTION = re.compile(r"^[ \t]*MOTION[ \t]*$", re.IGNORECASE | re.MULTILINE)
FRAMES = re.compile(r"Frames:\s*(\d+)\s*Frame Time:\s*\S+", re.IGNORECASE)


def global_poses(text: str) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield each joint's name, positions, (frame, 3), and rotation matrices, (frame, 3, 3).

    Rows beyond the count of `Frames:` are ignored, and end sites that coincide with their parents.
    Other end sites are named after these, several of one joint alike.
    """
    head, tail = MOTION.split(text, maxsplit=1)
    words = re.sub(r"([{}])", r" \1 ", head).split()[1:]
    columns = _columns(tail)
    path: list[tuple[str, FloatArray, FloatArray]] = []
    while words:
        if words[0] == "}":
            path.pop()
            del words[0]
            continue
        name, x, channels = _joint(words)
        is_distinct = name != "" or x.any()
        if not name and path:
            name = f"{path[-1][0]} end"
        offset, local = _local_pose(x, channels, columns)
        columns = columns[:, len(channels) :]
        if path:
            _, x, R = path[-1]
            offset, local = x + np.einsum("nij,nj->ni", R, offset), R @ local
        path.append((name, offset, local))
        if is_distinct:
            yield path[-1]


def _local_pose(
    x: FloatArray, channels: list[str], columns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the offsets and rotation matrices of a joint from its OFFSET and its channels."""
    offset, local = np.tile(x, (len(columns), 1)), np.tile(np.eye(3), (len(columns), 1, 1))
    for channel, column in zip(channels, columns.T, strict=False):
        axis = "XYZ".index(channel[0].upper())
        if channel[1:].upper() == "POSITION":
            offset[:, axis] = column
        else:
            local = local @ _about(axis, np.radians(column))
    return offset, local


def _columns(motion: str) -> FloatArray:
    """Return the numbers after the header of a motion, (frame, channel)."""
    header = FRAMES.search(motion)
    assert header is not None
    count = int(header[1])
    rows = motion[header.end() :].split("\n")
    words = [row.split() for row in rows if row.strip()][:count]
    return np.array(words, dtype=float).reshape(count, -1 if count else 0)


def _joint(words: list[str]) -> tuple[str, FloatArray, list[str]]:
    """Remove a joint from the words; return its name, "" for an end, its OFFSET and channels."""
    begin = words.index("{")
    name = "" if words[0].upper() == "END" else " ".join(words[1:begin])
    offset = np.array(words[begin + 2 : begin + 5], dtype=float)
    del words[: begin + 5]
    count = 2 + int(words[1]) if words[0].upper() == "CHANNELS" else 0
    channels = words[2:count]
    del words[:count]
    return name, offset, channels


def _about(axis: int, angles: FloatArray) -> FloatArray:
    """Return the matrices of rotations about an axis, (frame, 3, 3)."""
    R = np.tile(np.eye(3), (len(angles), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[:, i, i] = R[:, j, j] = np.cos(angles)
    R[:, j, i] = np.sin(angles)
    R[:, i, j] = -R[:, j, i]
    return R
