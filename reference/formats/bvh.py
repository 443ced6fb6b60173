"""BVH, the Biovision hierarchy: motions of a skeleton, a common format of animation programs.

The joints follow the order of the file, depth first. An end site becomes a joint without channels,
named after its parent with " end" added, or " end 2" and so on if the name is taken. An end at its
parent's position is left out. Rotation channels compose in their order, R = R_1 R_2 R_3, about
moving axes. Position channels replace the OFFSET, axis by axis, as animation programs write them. A
program that adds the two reads the same from a file whose root has OFFSET zero. Lengths are in the
unit of the file; angles are in degrees in the file and become quaternions.
"""

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import arguments, rotation
from ..arguments import LARGEST_COORDINATE, FloatArray, frozen
from ..articulation import Articulation
from ..kinematics import forward_kinematics
from ..quaternion import IDENTITY, multiply
from ..skeleton import Pose, Skeleton, checked_skeleton
from .robot import MAX_JOINTS, ORIGIN
from .source import checked_path, read_text, warn

# Frames times joints: a motion needs at most about a gigabyte.
MAX_POSES = 20_000_000
# In a line of the hierarchy.
MAX_CHARACTERS = 100_000
CHANNEL = re.compile(r"([XYZ])(POSITION|ROTATION)", re.IGNORECASE)
COUNT = re.compile(r"[0-9]{1,9}")
BRACES = re.compile(r"([{}])")
ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
CYCLIC = ("XYZ", "YZX", "ZXY")
# Decimals of lengths [m] and angles [degrees]: rounding moves the end of a metre by 9 nm.
DECIMALS = 6
POSITIONS = "Xposition Yposition Zposition"
# Deeper joints are not indented further: the text of a long chain stays linear in its length.
DEEPEST_INDENT = 40


class Motion(NamedTuple):
    """A skeleton and its poses over time; `bvh.write(path, *motion)` writes a motion to a file."""

    skeleton: Skeleton  # the offset of its root is the root's position in the first frame
    local_rotations: FloatArray  # (frame, joint, 4)
    frame_time: float  # time between frames [s]
    # each joint's position in its parent's frame, for the root in the world, (frame, joint, 3);
    # equal to the skeleton's offsets for joints without position channels
    offsets: FloatArray

    def pose(self) -> Pose:
        """Return the global poses of all joints, with frames as the leading axis.

        Without position channels the poses equal `forward_kinematics(skeleton, local_rotations)`.
        Raise a ValueError if the skeleton is none, or the rotations or offsets are not its own.
        """
        skeleton = checked_skeleton(self.skeleton)
        count = skeleton.joint_count
        R = arguments.array("local_rotations", self.local_rotations, "frame", count, 4)
        x = arguments.array("offsets", self.offsets, len(R), count, 3)
        centred = Skeleton(skeleton.parents, np.zeros_like(skeleton.offsets))
        q = np.concatenate([x, rotation.unit("local_rotations", R)], axis=-1)
        return forward_kinematics(Articulation(centred, "free"), q.reshape(len(q), 7 * count))


def read(path: str | Path) -> Motion:
    """Return the motion in a file.

    A single frame beyond the count in the file, as some programs write, is dropped with a warning.
    Raise a ValueError, naming file and line, if the file cannot be read or is not a BVH file.
    """
    return _motion(read_text(path), str(path))


def parse(text: str) -> Motion:
    """Return the motion described by a text; see `read`."""
    return _motion(arguments.text("text", text), "BVH")


@dataclass
class _Joint:
    name: str
    parent: int
    is_end: bool
    offset: tuple[float, ...] = ()
    channels: tuple[tuple[int, bool], ...] | None = None  # (axis, whether a rotation)


def _motion(text: str, origin: str) -> Motion:
    lines = _Lines(text)
    try:
        joints = _hierarchy(lines)
        frame_time, values = _frames(lines, joints, len(text))
        extra = _extra_frame(lines, values)
    except ValueError as error:
        raise ValueError(f"{origin}, line {lines.number}: {error}") from None
    if extra:
        problem = f"expected the end after {len(values):,} frames, got one more, which is left out"
        warn(f"{origin}, line {extra}: {problem}")
    offsets, rotations = _poses(joints, values)
    rest = np.array([joint.offset for joint in joints])
    if len(offsets):
        rest[0] = offsets[0, 0]
    skeleton = Skeleton([joint.parent for joint in joints], rest, [joint.name for joint in joints])
    return Motion(skeleton, frozen(rotations), frame_time, frozen(offsets))


class _Lines:
    """An iterator over the non-empty lines of a text with the current line number."""

    def __init__(self, text: str) -> None:
        self.numbered = enumerate(text.split("\n"), 1)
        self.number = 1

    def __iter__(self) -> Iterator[str]:
        for number, line in self.numbered:
            self.number = number
            if line.strip():
                yield line.strip()

    def next(self, expected: str) -> str:
        """Return the next line."""
        for line in self:
            return line
        raise ValueError(f"expected {expected}, got the end of the file")


def _hierarchy(lines: _Lines) -> list[_Joint]:
    """Read the lines up to MOTION; return the joints."""
    first = lines.next("HIERARCHY")
    if first.upper() != "HIERARCHY":
        raise ValueError(f"expected HIERARCHY, got {first!r:.40}")
    tree = _Tree()
    for line in lines:
        if line.upper() == "MOTION":
            if tree.path or not tree.joints:
                path = [tree.joints[joint].name for joint in tree.path]
                got = f"{path[-1]!r:.40} still open" if path else "none"
                raise ValueError(f"expected complete joints before MOTION, got {got}")
            tree.name_ends()
            return tree.joints
        if len(line) > MAX_CHARACTERS:
            raise ValueError(f"expected lines of at most {MAX_CHARACTERS:,} characters")
        for piece in BRACES.split(line):
            if piece.strip():
                tree.take(piece.strip())
    raise ValueError("expected MOTION, got the end of the file")


class _Tree:
    """The joints read so far, and the path of joints with open braces."""

    def __init__(self) -> None:
        self.joints: list[_Joint] = []
        self.names: set[str] = set()
        self.path: list[int] = []
        self.unopened = False

    def take(self, piece: str) -> None:
        """Process the next statement: a brace, or a keyword with its arguments."""
        word, *rest = piece.split(maxsplit=1)
        word = word.upper()
        if self.unopened != (word == "{"):
            expected = "{" if self.unopened else "a statement"
            raise ValueError(f"expected {expected}, got {piece!r:.40}")
        if word == "{":
            self.unopened = False
        elif word in ("ROOT", "JOINT", "END"):
            self.open(word, *rest)
        elif word in ("OFFSET", "CHANNELS", "}") and self.path:
            joint = self.joints[self.path[-1]]
            if word == "}":
                self.close(joint)
            elif word == "CHANNELS":
                _set_channels(joint, *rest)
            elif joint.offset:
                raise ValueError(f"expected one OFFSET in {joint.name!r:.40}, got two")
            else:
                joint.offset = tuple(_numbers(" ".join(rest), 3))
        else:
            raise ValueError(f"expected a joint or what belongs to one, got {piece!r:.40}")

    def open(self, word: str, name: str = "") -> None:
        """Start a joint or an end site; its opening brace must follow."""
        if (word == "ROOT") == bool(self.joints) or (word != "ROOT" and not self.path):
            raise ValueError(f"expected one ROOT and all joints in it, got {word} {name!r:.40}")
        parent = self.path[-1] if self.path else -1
        if self.joints and self.joints[parent].is_end:
            raise ValueError(f"expected nothing in an end site, got {word} {name!r:.40}")
        if word == "END":
            name = f"{self.joints[parent].name} end"
        elif not name or name in self.names:
            raise ValueError(f"expected a name of its own, got {name!r:.40}")
        else:
            self.names.add(name)
        if len(self.joints) == MAX_JOINTS:
            raise ValueError(f"expected at most {MAX_JOINTS:,} joints, got more")
        self.path.append(len(self.joints))
        self.joints.append(_Joint(name, parent, word == "END"))
        self.unopened = True

    def close(self, joint: _Joint) -> None:
        """Finish a joint; drop an end site at its parent's position."""
        if not joint.offset:
            raise ValueError(f"expected an OFFSET in {joint.name!r:.40}, got none")
        self.path.pop()
        if joint.is_end and joint.offset == ORIGIN:
            self.joints.pop()

    def name_ends(self) -> None:
        """Give each end site a name of its own."""
        counts: dict[int, int] = {}
        for joint in self.joints:
            stem, count = joint.name, counts.get(joint.parent, 1)
            while joint.is_end and joint.name in self.names:
                count += 1
                joint.name = f"{stem} {count}"
            self.names.add(joint.name)
            counts[joint.parent] = count


def _set_channels(joint: _Joint, text: str = "") -> None:
    count, *names = text.split(maxsplit=7) or [""]
    matches = filter(None, map(CHANNEL.fullmatch, names))
    channels = [("XYZ".index(m[1].upper()), m[2].upper() == "ROTATION") for m in matches]
    if joint.is_end or joint.channels is not None:
        raise ValueError(f"expected CHANNELS once, and in joints only, got {text!r:.40}")
    if not COUNT.fullmatch(count) or not int(count) == len(names) == len(set(channels)):
        raise ValueError(f"expected a count and so many different channels, got {text!r:.80}")
    joint.channels = tuple(channels)


def _numbers(text: str, count: int) -> list[float]:
    """Return the numbers in a text, separated by white space."""
    words = text.split(maxsplit=count)
    if len(words) != count:
        got = "more" if len(words) > count else len(words)
        raise ValueError(f"expected {count} numbers, got {got}")
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise ValueError(f"expected numbers, got {str(error).partition(': ')[2]:.40}") from None
    if "_" in text or not all(abs(number) <= LARGEST_COORDINATE for number in numbers):
        raise ValueError(f"expected numbers of at most {LARGEST_COORDINATE:g}, got {text!r:.80}")
    return numbers


def _frames(lines: _Lines, joints: list[_Joint], size: int) -> tuple[float, FloatArray]:
    """Return the time between frames and the values of the channels, (frame, channel)."""
    count_text = _after("Frames:", lines)
    (frame_time,) = _numbers(_after("Frame Time:", lines), 1)
    if not COUNT.fullmatch(count_text):
        raise ValueError(f"expected a count of frames, got {count_text!r:.40}")
    if frame_time <= 0.0:
        raise ValueError(f"expected a frame time greater than 0, got {frame_time:g}")
    count, width = int(count_text), sum(len(joint.channels or ()) for joint in joints)
    if count * len(joints) > MAX_POSES:
        raise ValueError(f"expected at most {MAX_POSES:,} frames times joints, got more")
    if count and (width == 0 or 2 * count * width > size):  # two characters a number
        raise ValueError(f"expected {count:,} frames of {width:,} numbers, got a shorter file")
    values = np.empty((count, width))
    for frame in range(count):
        values[frame] = _numbers(lines.next(f"{count:,} frames"), width)
    return frame_time, values


def _extra_frame(lines: _Lines, values: FloatArray) -> int:
    """Return the line number of a single extra frame, 0 if the text ends after the last frame."""
    count, width = values.shape
    line = next(iter(lines), "")
    number = lines.number
    follows = line
    with contextlib.suppress(ValueError):
        if line and len(_numbers(line, width)) == width > 0:
            follows = next(iter(lines), "")
    if follows:
        raise ValueError(f"expected the end after {count:,} frames, got {follows!r:.40}")
    return number if line else 0


def _after(title: str, lines: _Lines) -> str:
    """Return the rest of the next line, which must begin with the title."""
    line = lines.next(f"'{title}'")
    if not line.upper().startswith(title.upper()):
        raise ValueError(f"expected '{title}', got {line!r:.40}")
    return line[len(title) :].strip()


def _poses(joints: list[_Joint], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return offsets, (frame, joint, 3), and local rotations, (frame, joint, 4)."""
    offsets = np.tile(np.array([joint.offset for joint in joints]), (len(values), 1, 1))
    rotations = np.empty((len(values), len(joints), 4))
    columns = iter(values.T)
    for j, joint in enumerate(joints):
        R = IDENTITY
        for axis, is_rotation in joint.channels or ():
            if is_rotation:
                vector: list[Any] = [0.0, 0.0, 0.0]
                half = 0.5 * np.radians(next(columns))
                vector[axis] = np.sin(half)
                R = multiply(R, (np.cos(half), *vector))
            else:
                offsets[:, j, axis] = next(columns)
        for part in range(4):
            rotations[:, j, part] = R[part]
    return offsets, rotations


def write(
    path: str | Path,
    skeleton: Skeleton | Articulation,
    local_rotations: ArrayLike,
    frame_time: float = 1.0 / 60.0,
    offsets: ArrayLike | None = None,
    *,
    order: str = "ZXY",
) -> None:
    """Write a motion to a file, in place of an existing file.

    Args:
        path: of the file.
        skeleton: a Skeleton or an Articulation.
        local_rotations: (frame, joint, 4), or (joint, 4) for a single pose, as returned by
            `solve_ik` and `track`; for an Articulation its coordinates, (frame, coordinate).
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
    joints, hierarchy = _joint_lines(skeleton, shifts, ends, order)
    angles = euler_angles(R, order)
    columns = [part for j in joints for part in ([x[:, j]] if shifts[j] else []) + [angles[:, j]]]
    frames = _number_lines(np.concatenate(columns, axis=-1))
    head = ["MOTION", f"Frames: {len(frames)}", f"Frame Time: {frame_time!r}"]
    return "\n".join(["HIERARCHY", *hierarchy, *head, *frames, ""])


def euler_angles(R: FloatArray, order: str) -> FloatArray:
    """Return angles [degrees], (frame, joint, 3), of R = R_1(a_1) R_2(a_2) R_3(a_3), (..., 4).

    Bernardes and Viollet 2022: let e be the sign of the axes' order. Then (a_3 + e a_1)/2 and (a_3
    - e a_1)/2 are the polar angles of two points in the plane, whose coordinates are sums of the
    quaternion's components. The ratio of their radii gives a_2. At gimbal lock one point is the
    origin, whose angle is arbitrary and has no effect. Angles start between -180 and 180 and are
    continuous from frame to frame.
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
    """Return values with a leading axis of frames: a single pose becomes a motion of one frame."""
    if values.ndim not in (axes - 1, axes):
        raise ValueError(f"{name}: expected one pose or a row of frames, got {values.shape}")
    return values if values.ndim == axes else values[None]


def _children(skeleton: Skeleton) -> list[list[int]]:
    children: list[list[int]] = [[] for _ in skeleton.names]
    for joint, parent in enumerate(skeleton.parents[1:], 1):
        children[parent].append(joint)
    return children


def _end_sites(skeleton: Skeleton, R: FloatArray, shifts: np.ndarray) -> set[int]:
    """Return the joints that end sites can stand for without loss."""
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


def _joint_lines(
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
    return [pad + title, pad + "{", f"{pad}\tOFFSET {_number_lines(offset[None])[0]}", pad + "}"]


def _number_lines(rows: FloatArray) -> list[str]:
    """Return a line for each row; no number is written as -0."""
    pattern = " ".join([f"%.{DECIMALS}f"] * rows.shape[1])
    return [pattern % tuple(row) for row in np.round(rows, DECIMALS) + 0.0]
