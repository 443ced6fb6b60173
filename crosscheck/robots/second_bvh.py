"""A second reader of BVH, written independently: words, a stack, matrices; nothing is checked."""

import re
from collections.abc import Iterator

import numpy as np

from reference.arguments import FloatArray

MOTION = re.compile(r"^\s*MOTION\s*$", re.IGNORECASE | re.MULTILINE)
FRAMES = re.compile(r"Frames:\s*(\d+)\s*Frame Time:\s*\S+", re.IGNORECASE)


def placements(text: str) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Yield each joint's name, positions, (frame, 3), and rotation matrices, (frame, 3, 3).

    Rows behind those that `Frames:` counts are left out.
    """
    head, tail = MOTION.split(text, maxsplit=1)
    words = re.sub(r"([{}])", r" \1 ", head).split()[1:]
    columns = _columns(tail)
    above: list[tuple[str, FloatArray, FloatArray]] = []
    while words:
        if words[0] == "}":
            above.pop()
            del words[0]
            continue
        name, x, channels = _joint(words)
        if not name and above:
            name = f"{above[-1][0]} end"
        offset, turned = np.tile(x, (len(columns), 1)), np.tile(np.eye(3), (len(columns), 1, 1))
        for channel in channels:
            axis, values = "XYZ".index(channel[0].upper()), columns[:, 0]
            columns = columns[:, 1:]
            if channel[1:].upper() == "POSITION":
                offset[:, axis] = values
            else:
                turned = turned @ _about(axis, np.radians(values))
        if above:
            _, x, R = above[-1]
            offset, turned = x + np.einsum("nij,nj->ni", R, offset), R @ turned
        above.append((name, offset, turned))
        yield above[-1]


def _columns(motion: str) -> FloatArray:
    """Return the numbers behind the head of a motion, (frame, channel)."""
    found = FRAMES.search(motion)
    assert found is not None
    count = int(found[1])
    rows = motion[found.end() :].split("\n")
    values = [row.split() for row in rows if row.strip()][:count]
    return np.array(values, dtype=float).reshape(count, -1 if count else 0)


def _joint(words: list[str]) -> tuple[str, FloatArray, list[str]]:
    """Take a joint off the words up to its channels: its name, "" for an end, OFFSET, channels."""
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
